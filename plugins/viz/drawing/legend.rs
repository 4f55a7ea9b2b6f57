//! The legend: names of lines and colours, in rows.
use super::axes::{NUMBERS, fitted};
use crate::canvas::{Ink, Sheet, Stroke, Text, text_width};

/// One entry.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Entry {
    pub(crate) name: String,
    pub(crate) mark: Mark,
}

/// The sample of an entry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Mark {
    Line(Stroke),
    Patch(Ink),
}

/// Height of a row, width of a sample, and gap between a sample and its name. Unit: pixels.
const ROW: f64 = 18.0;
const MARK: f64 = 22.0;
const GAP: f64 = 5.0;

impl Entry {
    pub(crate) fn line(name: &str, stroke: Stroke) -> Self {
        Self { name: name.to_owned(), mark: Mark::Line(stroke) }
    }

    pub(crate) fn patch(name: &str, ink: Ink) -> Self {
        Self { name: name.to_owned(), mark: Mark::Patch(ink) }
    }
}

/// Draws entries side by side, in as many rows as the width requires.
pub(crate) fn legend(entries: &[Entry], width: f64) -> Sheet {
    let mut sheet = Sheet::new(width, 0.0);
    let (mut x, mut y) = (0.0, 0.0);
    for Entry { name, mark } in entries {
        let name = fitted(name, NUMBERS, width - MARK - GAP);
        let wide = MARK + GAP + text_width(&name, NUMBERS, false);
        if x > 0.0 && x + wide > width {
            (x, y) = (0.0, y + ROW);
        }
        let middle = y + 0.5 * ROW;
        match mark {
            Mark::Line(stroke) => sheet.line(vec![[x, middle], [x + MARK, middle]], *stroke),
            Mark::Patch(ink) => sheet.area([x + 5.0, middle - 5.0, x + MARK - 5.0, middle + 5.0], *ink, 1.0),
        }
        sheet.text(Text::new(name, [x + MARK + GAP, middle + 4.0], NUMBERS, Ink::Text));
        x += wide + 16.0;
    }
    sheet.height = if entries.is_empty() { 0.0 } else { y + ROW };
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_go_to_the_next_row_where_there_is_no_room() {
        let entries: Vec<_> = (0..6).map(|i| Entry::patch(&format!("class {i}"), Ink::Class(i))).collect();
        assert_eq!(legend(&entries, 2000.0).height, ROW);
        assert_eq!(legend(&entries, 200.0).height, 3.0 * ROW);
        assert_eq!(legend(&[], 200.0).height, 0.0);
    }
}
