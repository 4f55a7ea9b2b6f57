//! Labels next to their objects, without overlaps.
use crate::canvas::{Ink, Sheet, Text, text_width};

/// A name, and the box around its object: xmin, ymin, xmax, ymax. Unit: pixels.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Label {
    pub(crate) text: String,
    pub(crate) around: [f64; 4],
    pub(crate) ink: Ink,
}

const SIZE: f64 = 11.0;
const GAP: f64 = 3.0;

/// Draws the labels that fit within `area`: above, below, to the right or to the left of their object. A
/// label without room is omitted, because the legend has its colour.
pub(crate) fn place(sheet: &mut Sheet, labels: &[Label], area: [f64; 4]) {
    let mut taken: Vec<[f64; 4]> = vec![];
    for label in labels {
        let (width, height) = (text_width(&label.text, SIZE, false), SIZE);
        let [xmin, ymin, xmax, ymax] = label.around;
        let (x, y) = (0.5 * (xmin + xmax), 0.5 * (ymin + ymax));
        let corners = [
            [x - 0.5 * width, ymin - GAP - height],
            [x - 0.5 * width, ymax + GAP],
            [xmax + GAP, y - 0.5 * height],
            [xmin - GAP - width, y - 0.5 * height],
            [xmin, ymin - GAP - height],
            [xmax - width, ymax + GAP],
            [x - 0.5 * width, y - 0.5 * height],
        ];
        let boxes = corners.map(|[x, y]| [x, y, x + width, y + height]);
        let free = |own: &&[f64; 4]| within(own, &area) && !taken.iter().any(|other| overlap(own, other));
        let Some(own) = boxes.iter().find(free) else { continue };
        sheet.text(Text::new(label.text.as_str(), [own[0], own[3] - 2.0], SIZE, label.ink));
        taken.push(*own);
    }
}

fn within(a: &[f64; 4], area: &[f64; 4]) -> bool {
    a[0] >= area[0] && a[1] >= area[1] && a[2] <= area[2] && a[3] <= area[3]
}

fn overlap(a: &[f64; 4], b: &[f64; 4]) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::Item;

    #[test]
    fn no_label_lies_on_another() {
        let label = |i: usize| {
            let x = 100.0 + i as f64;
            Label { text: format!("cup {i}"), around: [x, 100.0, x + 20.0, 120.0], ink: Ink::Text }
        };
        let labels: Vec<_> = (0..40).map(label).collect();
        let mut sheet = Sheet::new(300.0, 300.0);
        place(&mut sheet, &labels, [0.0, 0.0, 300.0, 300.0]);
        let boxes: Vec<[f64; 4]> = sheet
            .items
            .iter()
            .map(|item| {
                let Item::Text(text) = item else { panic!("a label is a text") };
                let [x, y] = text.at;
                [x, y + 2.0 - SIZE, x + text_width(&text.text, SIZE, false), y + 2.0]
            })
            .collect();
        assert!(boxes.len() >= 4);
        for (i, a) in boxes.iter().enumerate() {
            assert!(within(a, &[0.0, 0.0, 300.0, 300.0]));
            assert!(boxes[..i].iter().all(|b| !overlap(a, b)));
        }
    }
}
