//! The PNG of a sheet.
use super::font::{Outlines, outlines, text_width};
use super::{Anchor, DASHES, Ink, Item, Sheet, Text, Theme};
use tiny_skia::{Color, FillRule, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, StrokeDash, Transform};

/// Resolution of a PNG, so that it is sharp when enlarged or printed. Reduced for large sheets. Unit:
/// pixels per pixel of the sheet.
const SCALE: f64 = 2.0;
/// Largest width and height. Unit: pixels.
const MOST: f64 = 16_000.0;

impl Sheet {
    /// Returns the bytes of the PNG, or the reason why it cannot be drawn.
    pub(crate) fn png(&self, theme: Theme) -> Result<Vec<u8>, String> {
        let scale = SCALE.min(MOST / self.width.max(self.height));
        let [width, height] = [self.width, self.height].map(|x| x * scale);
        if !(width >= 1.0 && height >= 1.0) {
            let (width, height) = (self.width, self.height);
            return Err(format!("a picture of {width:.0} by {height:.0} pixels is out of reach"));
        }
        let pixels = Pixmap::new(width.round() as u32, height.round() as u32);
        let mut pixels = pixels.ok_or_else(|| "there is no room for its pixels".to_owned())?;
        pixels.fill(color(Ink::Paper, theme, 1.0));
        let transform = Transform::from_scale(scale as f32, scale as f32);
        for item in self.drawable() {
            match item {
                Item::Path { points, closed, stroke, fill } => {
                    let Some(path) = polygon(&points, closed) else { continue };
                    if let Some((ink, opacity)) = fill {
                        pixels.fill_path(
                            &path,
                            &paint(ink, theme, opacity),
                            FillRule::Winding,
                            transform,
                            None,
                        );
                    }
                    if let Some(stroke) = stroke {
                        let [dash, gap] = DASHES.map(|x| x as f32);
                        let dash = stroke.dashed.then(|| StrokeDash::new(vec![dash, gap], 0.0)).flatten();
                        let width = stroke.width as f32;
                        let drawn = Stroke { width, dash, line_join: LineJoin::Round, ..Stroke::default() };
                        pixels.stroke_path(&path, &paint(stroke.ink, theme, 1.0), &drawn, transform, None);
                    }
                }
                Item::Dot { at, radius, ink } => {
                    let [x, y, r] = [at[0], at[1], radius].map(|x| x as f32);
                    if let Some(path) = PathBuilder::from_circle(x, y, r) {
                        pixels.fill_path(&path, &paint(ink, theme, 1.0), FillRule::Winding, transform, None);
                    }
                }
                Item::Text(text) => {
                    if let Some(path) = letters(&text) {
                        pixels.fill_path(
                            &path,
                            &paint(text.ink, theme, 1.0),
                            FillRule::Winding,
                            transform,
                            None,
                        );
                    }
                }
            }
        }
        pixels.encode_png().map_err(|error| error.to_string())
    }
}

fn color(ink: Ink, theme: Theme, opacity: f64) -> Color {
    let [red, green, blue] = ink.rgb(theme);
    Color::from_rgba8(red, green, blue, (opacity.clamp(0.0, 1.0) * 255.0).round() as u8)
}

fn paint(ink: Ink, theme: Theme, opacity: f64) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color(color(ink, theme, opacity));
    paint
}

fn polygon(points: &[[f64; 2]], closed: bool) -> Option<Path> {
    let (first, rest) = points.split_first()?;
    let mut builder = PathBuilder::new();
    builder.begin(*first);
    rest.iter().for_each(|p| builder.line(*p));
    if closed {
        builder.close();
    }
    builder.finish()
}

/// Returns the outline of a text at its position.
fn letters(text: &Text) -> Option<Path> {
    let width = text_width(&text.text, text.size, text.bold);
    let before = match text.anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => 0.5 * width,
        Anchor::End => width,
    };
    let mut builder = PathBuilder::new();
    outlines(&text.text, text.size, text.bold, &mut builder);
    let [x, y] = text.at.map(|x| x as f32);
    // letters have y upward
    let stand = Transform::from_row(1.0, 0.0, 0.0, -1.0, -before as f32, 0.0);
    let turn = if text.upward { Transform::from_rotate(-90.0) } else { Transform::identity() };
    builder.finish()?.transform(stand.post_concat(turn).post_translate(x, y))
}

impl Outlines for PathBuilder {
    fn begin(&mut self, [x, y]: [f64; 2]) {
        self.move_to(x as f32, y as f32);
    }
    fn line(&mut self, [x, y]: [f64; 2]) {
        self.line_to(x as f32, y as f32);
    }
    fn quadratic(&mut self, [a, b]: [f64; 2], [x, y]: [f64; 2]) {
        self.quad_to(a as f32, b as f32, x as f32, y as f32);
    }
    fn cubic(&mut self, [[a, b], [c, d]]: [[f64; 2]; 2], [x, y]: [f64; 2]) {
        self.cubic_to(a as f32, b as f32, c as f32, d as f32, x as f32, y as f32);
    }
    fn end(&mut self) {
        self.close();
    }
}
