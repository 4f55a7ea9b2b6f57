//! The SVG of a sheet.
use super::{Anchor, DASHES, Ink, Item, Panel, PanelAxis, Sheet, Stroke, Text, Theme};
use crate::xml::escape;
use std::fmt::Write as _;

/// Source of the colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Colors {
    /// The colours of a theme, for a file.
    Of(Theme),
    /// The variables of the surrounding page, which follow the reader's choice.
    OfPage,
}

impl Colors {
    fn of(self, ink: Ink) -> String {
        match (self, ink.variable()) {
            (Self::OfPage, Some(name)) => format!("var(--{name})"),
            (Self::OfPage, None) => ink.hex(Theme::Light).to_owned(),
            (Self::Of(theme), _) => ink.hex(theme).to_owned(),
        }
    }
}

/// Fonts with the width of DejaVu Sans, which measures the texts.
const FONT: &str = "DejaVu Sans, Verdana, sans-serif";

impl Sheet {
    /// Returns an SVG document, or a part of a page. Screen readers read `title` instead of the picture.
    pub(crate) fn svg(&self, title: &str, colors: Colors) -> String {
        let (width, height) = (number(self.width), number(self.height));
        let for_scripts = if colors == Colors::OfPage { self.panels_for_scripts() } else { String::new() };
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
             {for_scripts}role=\"img\" font-family=\"{FONT}\" stroke-linejoin=\"round\" stroke-linecap=\"butt\">\n<title>{}</title>\n",
            escape(title)
        );
        if let Colors::Of(_) = colors {
            svg += &format!("<rect width=\"100%\" height=\"100%\" fill=\"{}\"/>\n", colors.of(Ink::Paper));
        }
        svg + &self.parts(colors) + "</svg>\n"
    }

    /// Returns the attributes that the scripts of a page read. `data-panels` has for each panel its area and,
    /// for x and y, the ends of the axis and 1 if it is logarithmic.
    fn panels_for_scripts(&self) -> String {
        let axis = |axis: PanelAxis| [axis.ends[0], axis.ends[1], f64::from(u8::from(axis.log))];
        let panel = |panel: &Panel| {
            let numbers = panel.area.into_iter().chain(axis(panel.x)).chain(axis(panel.y));
            numbers.map(|x| format!("{x:e}")).collect::<Vec<_>>().join(" ")
        };
        let panels: Vec<String> = self.panels.iter().map(panel).collect();
        match panels.as_slice() {
            [] => String::new(),
            panels => {
                let time = if self.is_over_time { "data-time=\"\" " } else { "" };
                format!("data-panels=\"{}\" {time}", panels.join(";"))
            }
        }
    }

    /// Returns the elements of the sheet, without the document around them.
    pub(crate) fn parts(&self, colors: Colors) -> String {
        let mut svg = String::new();
        for item in self.drawable() {
            match item {
                Item::Path { points, closed, stroke, fill } => {
                    path(&mut svg, &points, closed, stroke, fill, colors);
                }
                Item::Dot { at: [x, y], radius, ink } => {
                    let (x, y, r) = (number(x), number(y), number(radius));
                    // writing to a String cannot fail
                    let _ = writeln!(
                        svg,
                        "<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\" fill=\"{}\"/>",
                        colors.of(ink)
                    );
                }
                Item::Text(text) => words(&mut svg, &text, colors),
            }
        }
        svg
    }
}

fn path(
    svg: &mut String,
    points: &[[f64; 2]],
    closed: bool,
    stroke: Option<Stroke>,
    fill: Option<(Ink, f64)>,
    colors: Colors,
) {
    let Some(([x, y], rest)) = points.split_first() else { return };
    let _ = write!(svg, "<path d=\"M{} {}", tenths(*x), tenths(*y));
    rest.iter().for_each(|[x, y]| _ = write!(svg, "L{} {}", tenths(*x), tenths(*y)));
    *svg += if closed { "Z\"" } else { "\"" };
    let _ = match fill {
        Some((ink, opacity)) if opacity < 1.0 => {
            write!(svg, " fill=\"{}\" fill-opacity=\"{}\"", colors.of(ink), number(opacity))
        }
        Some((ink, _)) => write!(svg, " fill=\"{}\"", colors.of(ink)),
        None => write!(svg, " fill=\"none\""),
    };
    if let Some(Stroke { ink, width, dashed }) = stroke {
        let _ = write!(svg, " stroke=\"{}\" stroke-width=\"{}\"", colors.of(ink), number(width));
        if dashed {
            let _ = write!(svg, " stroke-dasharray=\"{} {}\"", number(DASHES[0]), number(DASHES[1]));
        }
    }
    *svg += "/>\n";
}

fn words(svg: &mut String, text: &Text, colors: Colors) {
    let [x, y] = text.at.map(number);
    let _ = write!(
        svg,
        "<text x=\"{x}\" y=\"{y}\" font-size=\"{}\" fill=\"{}\"",
        number(text.size),
        colors.of(text.ink)
    );
    *svg += match text.anchor {
        Anchor::Start => "",
        Anchor::Middle => " text-anchor=\"middle\"",
        Anchor::End => " text-anchor=\"end\"",
    };
    if text.bold {
        *svg += " font-weight=\"bold\"";
    }
    if text.upward {
        let _ = write!(svg, " transform=\"rotate(-90 {x} {y})\"");
    }
    let _ = writeln!(svg, ">{}</text>", escape(&text.text));
}

/// Formats a corner of a line; the PNG has half a pixel of accuracy.
fn tenths(x: f64) -> String {
    number((x * 10.0).round() / 10.0)
}

/// Formats a number with hundredths of a pixel.
fn number(x: f64) -> String {
    let text = format!("{x:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}
