//! Labels of KITTI's tracking benchmark.
use super::DetectionRow;
use super::format::Entry;
use super::frames::Frames;
use crate::error::Mistake;
use crate::lines::{id, lines, number};

/// Type of regions that are no objects.
const NO_OBJECT: &str = "DontCare";

pub(super) fn entries(text: &str, frames: &Frames) -> Vec<Entry> {
    let is_object = |(_, text): &(usize, &str)| text.split_whitespace().nth(2) != Some(NO_OBJECT);
    lines(text).filter(is_object).map(|(line, text)| (line, row(text, frames))).collect()
}

fn row(text: &str, frames: &Frames) -> Result<DetectionRow, Mistake> {
    let fields: Vec<&str> = text.split_whitespace().collect();
    let [frame, _, class, _, _, _, left, top, right, bottom, ref rest @ ..] = fields[..] else {
        let (expected, layout) = (
            17,
            "frame track type truncated occluded alpha left top right bottom height width length x y z rotation_y",
        );
        return Err(Mistake::FieldCount { expected, layout, found: fields.len() });
    };
    let score = rest.get(7).map_or(Ok(1.0), |score| number(score))?;
    let sides = [number(left)?, number(top)?, number(right)?, number(bottom)?];
    Ok(DetectionRow::of_box(frames.time(id(frame)?)?, class, score, sides))
}
