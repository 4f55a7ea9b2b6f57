//! A sheet of lines, shapes and text, which is written as SVG or PNG.
mod clip;
mod font;
mod ink;
mod raster;
mod svg;

pub(crate) use font::text_width;
pub use ink::Theme;
pub(crate) use ink::{Ink, style_sheet};
pub(crate) use svg::Colors;

/// A drawing surface with x to the right and y downward. Unit: pixels.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Sheet {
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) items: Vec<Item>,
    /// Panels with curves, from top to bottom, so that a page can show values under the pointer.
    pub(crate) panels: Vec<Panel>,
    /// True if the horizontal axis is time, for the cursor that all charts of a page share.
    pub(crate) is_over_time: bool,
}

/// The area and the scales of a panel with curves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Panel {
    /// xmin, ymin, xmax, ymax. Unit: pixels.
    pub(crate) area: [f64; 4],
    pub(crate) x: PanelAxis,
    pub(crate) y: PanelAxis,
}

/// Values at the ends of an axis, and whether it is logarithmic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PanelAxis {
    pub(crate) ends: [f64; 2],
    pub(crate) log: bool,
}

/// One element of a sheet; later ones cover earlier ones.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Item {
    Path { points: Vec<[f64; 2]>, closed: bool, stroke: Option<Stroke>, fill: Option<(Ink, f64)> },
    Dot { at: [f64; 2], radius: f64, ink: Ink },
    Text(Text),
}

/// The style of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stroke {
    pub(crate) ink: Ink,
    pub(crate) width: f64,
    pub(crate) dashed: bool,
}

/// One line of text.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Text {
    pub(crate) text: String,
    /// Position of the start, middle or end of the baseline, as `anchor` selects. Unit: pixels.
    pub(crate) at: [f64; 2],
    pub(crate) anchor: Anchor,
    pub(crate) size: f64,
    pub(crate) ink: Ink,
    pub(crate) bold: bool,
    /// True for text that reads from bottom to top.
    pub(crate) upward: bool,
}

/// The point of a text that its position refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// Lengths of a dash and of the gap after it. Unit: pixels.
pub(crate) const DASHES: [f64; 2] = [6.0, 4.0];

impl Stroke {
    pub(crate) fn solid(ink: Ink, width: f64) -> Self {
        Self { ink, width, dashed: false }
    }

    pub(crate) fn dashed(ink: Ink, width: f64) -> Self {
        Self { ink, width, dashed: true }
    }
}

impl Text {
    pub(crate) fn new(text: impl Into<String>, at: [f64; 2], size: f64, ink: Ink) -> Self {
        Self { text: text.into(), at, anchor: Anchor::Start, size, ink, bold: false, upward: false }
    }

    pub(crate) fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    pub(crate) fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    pub(crate) fn upward(self) -> Self {
        Self { upward: true, ..self }
    }
}

impl Sheet {
    pub(crate) fn new(width: f64, height: f64) -> Self {
        Self { width, height, ..Self::default() }
    }

    pub(crate) fn text(&mut self, text: Text) {
        self.items.push(Item::Text(text));
    }

    pub(crate) fn line(&mut self, points: Vec<[f64; 2]>, stroke: Stroke) {
        self.items.push(Item::Path { points, closed: false, stroke: Some(stroke), fill: None });
    }

    pub(crate) fn outline(&mut self, points: Vec<[f64; 2]>, stroke: Stroke, fill: Option<(Ink, f64)>) {
        self.items.push(Item::Path { points, closed: true, stroke: Some(stroke), fill });
    }

    pub(crate) fn area(&mut self, [xmin, ymin, xmax, ymax]: [f64; 4], ink: Ink, opacity: f64) {
        let points = vec![[xmin, ymin], [xmax, ymin], [xmax, ymax], [xmin, ymax]];
        self.items.push(Item::Path { points, closed: true, stroke: None, fill: Some((ink, opacity)) });
    }

    pub(crate) fn dot(&mut self, at: [f64; 2], radius: f64, ink: Ink) {
        self.items.push(Item::Dot { at, radius, ink });
    }

    /// Adds another sheet to this one, with its corner at `at`.
    pub(crate) fn place(&mut self, other: Self, [x, y]: [f64; 2]) {
        let moved = |p: [f64; 2]| [p[0] + x, p[1] + y];
        self.items.extend(other.items.into_iter().map(|item| match item {
            Item::Path { points, closed, stroke, fill } => {
                Item::Path { points: points.into_iter().map(moved).collect(), closed, stroke, fill }
            }
            Item::Dot { at, radius, ink } => Item::Dot { at: moved(at), radius, ink },
            Item::Text(text) => Item::Text(Text { at: moved(text.at), ..text }),
        }));
    }
}
