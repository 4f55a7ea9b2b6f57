//! The font of the pictures: DejaVu Sans, embedded so that text widths and PNGs are identical on all systems.
use std::sync::LazyLock;
use ttf_parser::{Face, GlyphId, OutlineBuilder};

static REGULAR: LazyLock<Option<Face<'static>>> =
    LazyLock::new(|| Face::parse(dejavu::sans::regular(), 0).ok());
static BOLD: LazyLock<Option<Face<'static>>> = LazyLock::new(|| Face::parse(dejavu::sans::bold(), 0).ok());

fn face(bold: bool) -> Option<&'static Face<'static>> {
    if bold { BOLD.as_ref() } else { REGULAR.as_ref() }
}

fn glyph(face: &Face<'_>, c: char) -> GlyphId {
    face.glyph_index(c).unwrap_or_default()
}

/// Returns the width of a text at a font size. Unit: pixels.
pub(crate) fn text_width(text: &str, size: f64, bold: bool) -> f64 {
    let Some(face) = face(bold) else { return 0.6 * size * text.chars().count() as f64 };
    let units = text.chars().map(|c| f64::from(face.glyph_hor_advance(glyph(face, c)).unwrap_or(0)));
    units.sum::<f64>() * size / f64::from(face.units_per_em())
}

/// Draws the outline of each letter of a text that begins at the origin, y upward.
pub(crate) fn outlines(text: &str, size: f64, bold: bool, builder: &mut dyn Outlines) {
    let Some(face) = face(bold) else { return };
    let scale = size / f64::from(face.units_per_em());
    let mut x = 0.0;
    for c in text.chars() {
        let glyph = glyph(face, c);
        face.outline_glyph(glyph, &mut Placed { x, scale, to: builder });
        x += f64::from(face.glyph_hor_advance(glyph).unwrap_or(0)) * scale;
    }
}

/// A receiver of outlines. Unit: pixels.
pub(crate) trait Outlines {
    fn begin(&mut self, at: [f64; 2]);
    fn line(&mut self, to: [f64; 2]);
    fn quadratic(&mut self, by: [f64; 2], to: [f64; 2]);
    fn cubic(&mut self, by: [[f64; 2]; 2], to: [f64; 2]);
    fn end(&mut self);
}

struct Placed<'a> {
    x: f64,
    scale: f64,
    to: &'a mut dyn Outlines,
}

impl Placed<'_> {
    fn at(&self, x: f32, y: f32) -> [f64; 2] {
        [self.x + f64::from(x) * self.scale, f64::from(y) * self.scale]
    }
}

impl OutlineBuilder for Placed<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        self.to.begin(self.at(x, y));
    }
    fn line_to(&mut self, x: f32, y: f32) {
        self.to.line(self.at(x, y));
    }
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.to.quadratic(self.at(x1, y1), self.at(x, y));
    }
    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.to.cubic([self.at(x1, y1), self.at(x2, y2)], self.at(x, y));
    }
    fn close(&mut self) {
        self.to.end();
    }
}

#[cfg(test)]
mod tests {
    use super::text_width;

    #[test]
    fn wide_letters_are_wider_and_sizes_scale() {
        assert!(text_width("WWW", 10.0, false) > 2.0 * text_width("iii", 10.0, false));
        assert!(text_width("W", 10.0, true) > text_width("W", 10.0, false));
        assert!((text_width("a σ", 20.0, false) - 2.0 * text_width("a σ", 10.0, false)).abs() < 1e-9);
        assert_eq!(text_width("", 10.0, false), 0.0);
    }
}
