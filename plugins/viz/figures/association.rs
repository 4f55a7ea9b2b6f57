//! Data association over time.
use crate::canvas::{Anchor, Ink, Sheet, Stroke, Text};
use crate::drawing::{Axes, HEAD, NUMBERS, Palette, Picture, Scale, TIME, title};
use manifactor_slam::record::VariantRecord;

/// Height of the row of an object. Unit: pixels.
const ROW: f64 = 18.0;
/// Largest number of objects.
const ROWS: usize = 100;

/// Draws the objects over time, sorted by their first detection: each has a row, with a dot at each frame in
/// which a detection is associated with it. `None` without a detection. Unit of `width`: pixels.
pub fn association(variant: &VariantRecord, text: &str, width: f64) -> Option<Picture> {
    let palette = Palette::new(variant.classes().into_iter());
    let start = variant.frames.first()?.timestamp;
    let times = |id| {
        let seen = variant.frames.iter().filter(move |frame| frame.boxes.iter().any(|b| b.object == id));
        seen.map(|frame| frame.timestamp - start).collect::<Vec<f64>>()
    };
    let mut rows: Vec<_> = variant.objects.iter().map(|object| (object, times(object.id))).collect();
    rows.retain(|(_, times)| !times.is_empty());
    rows.sort_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]));
    rows.truncate(ROWS);
    let x = Scale::over(rows.iter().flat_map(|(_, times)| times.iter().copied()), false)?;
    let area = [140.0, HEAD + 6.0, width - 18.0, HEAD + 6.0 + ROW * rows.len() as f64];
    let mut sheet = Sheet::new(width, area[3] + Axes::below("x") + 2.0);
    title(&mut sheet, text);
    let y = Scale::new(0.0, rows.len() as f64);
    let axes = Axes { area, x, y, x_label: TIME.to_owned(), y_label: String::new() };
    for (at, number) in axes.x.ticks(8) {
        let at = axes.point(at, 0.0)[0];
        sheet.line(vec![[at, area[1]], [at, area[3]]], Stroke::solid(Ink::Grid, 1.0));
        let number = Text::new(number, [at, area[3] + 15.0], NUMBERS, Ink::Faint);
        sheet.text(number.anchored(Anchor::Middle));
    }
    let label = Text::new(TIME, [0.5 * (area[0] + area[2]), area[3] + 33.0], NUMBERS, Ink::Text);
    sheet.text(label.anchored(Anchor::Middle));
    for (row, (object, times)) in rows.iter().enumerate() {
        let y = area[1] + (row as f64 + 0.5) * ROW;
        // an object that is not in the map is grey
        let ink = if object.estimate.is_some() { palette.ink(&object.class) } else { Ink::Faint };
        let name =
            Text::new(format!("{} {}", object.class, object.key), [area[0] - 8.0, y + 4.0], NUMBERS, ink);
        sheet.text(name.anchored(Anchor::End));
        let [first, last] =
            [times.first(), times.last()].map(|time| axes.point(time.copied().unwrap_or(0.0), 0.0)[0]);
        sheet.line(vec![[first, y], [last, y]], Stroke::solid(Ink::Grid, 2.0));
        times.iter().for_each(|time| sheet.dot([axes.point(*time, 0.0)[0], y], 2.2, ink));
    }
    Some(Picture::new("association", text, sheet))
}
