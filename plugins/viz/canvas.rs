//! A sheet of lines, shapes and words, before it is a file: what SVG and PNG are made of.
mod clip;
mod font;
mod ink;
mod raster;
mod svg;

pub(crate) use font::text_width;
pub use ink::Theme;
pub(crate) use ink::{Ink, style_sheet};
pub(crate) use svg::Colors;

/// A sheet of this size, in pixels, x to the right and y downward.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Sheet {
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) items: Vec<Item>,
}

/// What is drawn, in order.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Item {
    Path { points: Vec<[f64; 2]>, closed: bool, stroke: Option<Stroke>, fill: Option<(Ink, f64)> },
    Dot { at: [f64; 2], radius: f64, ink: Ink },
    Text(Text),
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stroke {
    pub(crate) ink: Ink,
    pub(crate) width: f64,
    pub(crate) dashed: bool,
}

/// Words in one line.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Text {
    pub(crate) text: String,
    /// Where its baseline begins, has its middle, or ends.
    pub(crate) at: [f64; 2],
    pub(crate) anchor: Anchor,
    pub(crate) size: f64,
    pub(crate) ink: Ink,
    pub(crate) bold: bool,
    /// Whether it reads from below to above.
    pub(crate) upward: bool,
}

/// Which point of a text is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// Pixels of a dash and of the gap after it.
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
        Self { width, height, items: vec![] }
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

    /// Puts another sheet onto this one, its corner at `at`.
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
