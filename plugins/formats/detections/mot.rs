//! MOT challenge: lines `frame,id,left,top,width,height,score,…`.
use super::DetectionRow;
use super::format::Entry;
use super::frames::Frames;
use crate::error::Mistake;
use crate::lines::{id, lines, number};

/// Number of fields of a row of a ground truth: frame, id, box, whether it is considered, class and visibility.
const TRUTH: usize = 9;

pub(super) fn entries(text: &str, class: &str, frames: &Frames) -> Vec<Entry> {
    let is_object = |(_, text): &(usize, &str)| {
        let mut fields = text.split(',').map(str::trim);
        fields.clone().count() != TRUTH || fields.nth(6) != Some("0")
    };
    lines(text).filter(is_object).map(|(line, text)| (line, row(text, class, frames))).collect()
}

fn row(text: &str, class: &str, frames: &Frames) -> Result<DetectionRow, Mistake> {
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    let [frame, _, left, top, width, height, score, ..] = fields[..] else {
        let (expected, layout) = (7, "frame,id,left,top,width,height,score");
        return Err(Mistake::FieldCount { expected, layout, found: fields.len() });
    };
    let [left, top, width, height, score] =
        [number(left)?, number(top)?, number(width)?, number(height)?, number(score)?];
    let sides = [left, top, left + width, top + height];
    Ok(DetectionRow::of_box(frames.time(id(frame)?)?, class, score, sides))
}
