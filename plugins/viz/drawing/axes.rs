//! The frame of a chart: its scales on the sheet, and the lines and numbers around it.
use super::scale::Scale;
use crate::canvas::{Anchor, Ink, Panel, Sheet, Stroke, Text, text_width};

/// Font sizes of numbers, labels and titles. Unit: pixels.
pub(crate) const NUMBERS: f64 = 11.0;
pub(crate) const LABELS: f64 = 12.0;
pub(crate) const TITLE: f64 = 15.0;
/// Height of the title above a chart. Unit: pixels.
pub(crate) const HEAD: f64 = 26.0;

/// Two scales on a rectangle of the sheet.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axes {
    /// xmin, ymin, xmax, ymax in pixels of the sheet.
    pub(crate) area: [f64; 4],
    pub(crate) x: Scale,
    pub(crate) y: Scale,
    pub(crate) x_label: String,
    pub(crate) y_label: String,
}

impl Axes {
    /// Width of the numbers and of the label to the left of the area.
    pub(crate) fn left(y: &Scale, height: f64) -> f64 {
        let widest = y
            .ticks(rows(height))
            .iter()
            .map(|(_, text)| text_width(text, NUMBERS, false))
            .fold(0.0, f64::max);
        widest + LABELS + 18.0
    }

    /// Height of the numbers, and of the label if there is one, below the area.
    pub(crate) fn below(label: &str) -> f64 {
        if label.is_empty() { 20.0 } else { 38.0 }
    }

    /// Position of a point on the sheet.
    pub(crate) fn point(&self, x: f64, y: f64) -> [f64; 2] {
        let [xmin, ymin, xmax, ymax] = self.area;
        [xmin + self.x.place(x) * (xmax - xmin), ymax - self.y.place(y) * (ymax - ymin)]
    }

    pub(crate) fn panel(&self) -> Panel {
        Panel { area: self.area, x: self.x.axis(), y: self.y.axis() }
    }

    /// Draws the grid, the numbers and the labels.
    pub(crate) fn draw(&self, sheet: &mut Sheet) {
        self.draw_with(sheet, |text| text);
    }

    /// Draws the frame of an image, whose y grows downward. The scale holds -y, and the numbers show y.
    pub(crate) fn draw_downward(&self, sheet: &mut Sheet) {
        self.draw_with(sheet, |text| text.trim_start_matches('-').to_owned());
    }

    fn draw_with(&self, sheet: &mut Sheet, written: impl Fn(String) -> String) {
        let [xmin, ymin, xmax, ymax] = self.area;
        let thin = Stroke::solid(Ink::Grid, 1.0);
        let columns = ((xmax - xmin) / 75.0).clamp(2.0, 10.0) as usize;
        for (x, text) in self.x.ticks(columns) {
            let at = xmin + self.x.place(x) * (xmax - xmin);
            sheet.line(vec![[at, ymin], [at, ymax]], thin);
            sheet.text(Text::new(text, [at, ymax + 15.0], NUMBERS, Ink::Faint).anchored(Anchor::Middle));
        }
        for (y, text) in self.y.ticks(rows(ymax - ymin)) {
            let at = ymax - self.y.place(y) * (ymax - ymin);
            sheet.line(vec![[xmin, at], [xmax, at]], thin);
            sheet.text(
                Text::new(written(text), [xmin - 6.0, at + 4.0], NUMBERS, Ink::Faint).anchored(Anchor::End),
            );
        }
        let frame = vec![[xmin, ymin], [xmax, ymin], [xmax, ymax], [xmin, ymax]];
        sheet.outline(frame, Stroke::solid(Ink::Faint, 1.0), None);
        let (middle, label) = (0.5 * (xmin + xmax), fitted(&self.x_label, LABELS, xmax - xmin));
        sheet.text(Text::new(label, [middle, ymax + 33.0], LABELS, Ink::Text).anchored(Anchor::Middle));
        let label = fitted(&self.y_label, LABELS, ymax - ymin + 20.0);
        let at = [xmin - Self::left(&self.y, ymax - ymin) + LABELS, 0.5 * (ymin + ymax)];
        sheet.text(Text::new(label, at, LABELS, Ink::Text).anchored(Anchor::Middle).upward());
    }
}

/// Number of tick labels that fit vertically.
fn rows(height: f64) -> usize {
    (height / 32.0).clamp(3.0, 8.0) as usize
}

/// Shortens a text to a width.
pub(crate) fn fitted(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size, false) <= width {
        return text.to_owned();
    }
    let mut kept = String::new();
    for c in text.chars() {
        kept.push(c);
        if text_width(&format!("{kept}…"), size, false) > width {
            kept.pop();
            break;
        }
    }
    kept + "…"
}

/// Draws a title at the top of a sheet, shortened to the width of the sheet.
pub(crate) fn title(sheet: &mut Sheet, text: &str) {
    // bold letters are wider by a tenth
    let text = fitted(text, 1.12 * TITLE, sheet.width - 20.0);
    sheet.text(Text::new(text, [10.0, 19.0], TITLE, Ink::Text).bold());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_texts_are_cut_to_their_room() {
        assert_eq!(fitted("short", 12.0, 100.0), "short");
        let cut = fitted(&"long ".repeat(50), 12.0, 100.0);
        assert!(cut.ends_with('…') && text_width(&cut, 12.0, false) <= 100.0);
    }
}
