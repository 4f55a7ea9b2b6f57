//! YOLO: a text file per image, with boxes as shares of the image.
use super::DetectionRow;
use super::format::Entry;
use super::frames::Frames;
use crate::error::{FormatError, Mistake, ProblemList};
use crate::lines::{id, lines, number};
use std::path::Path;

/// Shares may exceed 0 to 1 by this much, from rounding.
const ROUNDING: f64 = 0.01;

/// Returns the classes of a text file with one class per line. Class `i` is that of line `i + 1`.
///
/// # Errors
/// A YAML file, an empty line before a class, or lines with numbers.
pub(super) fn classes<'a>(file: &Path, text: &'a str) -> Result<Vec<&'a str>, FormatError> {
    let fault = |line, fault: &str| Err(ProblemList::single(file, text, line, Mistake::Row(fault.into())));
    if file.extension().is_some_and(|extension| extension == "yaml" || extension == "yml") {
        return fault(
            0,
            "expected a text file with one class per line: write the `names` of the YAML file as lines",
        );
    }
    let content = text.strip_prefix('\u{feff}').unwrap_or(text).trim_end();
    let names: Vec<&str> = content.lines().map(str::trim).collect();
    if let Some(i) = names.iter().position(|name| name.is_empty()) {
        return fault(
            i + 1,
            "expected a class, got an empty line: the number of a class is that of its line, from 0",
        );
    }
    let has_number = |(i, name): (usize, &&str)| {
        name.split_once([':', ' ', ',']).is_some_and(|(first, _)| first.parse() == Ok(i))
    };
    let is_numbered = names.iter().enumerate().all(has_number);
    if let Some(i) = names.iter().position(|name| is_numbered || name.ends_with(':')) {
        return fault(i + 1, "expected the name of a class alone, one per line, in the order of the numbers");
    }
    Ok(names)
}

/// Returns whether the numbers after the class are a box and its keypoints, `x y width height` and then `x y visibility`
/// each: an outline has no such visibilities of 0, 1 or 2.
fn has_keypoints(numbers: &[f64]) -> bool {
    let [x, y, width, height, ref points @ ..] = *numbers else { return false };
    let is_inside = |[px, py, seen]: [f64; 3]| {
        let inside = (px - x).abs() <= 0.5 * width + ROUNDING && (py - y).abs() <= 0.5 * height + ROUNDING;
        [0.0, 1.0, 2.0].contains(&seen) && (seen == 0.0 || inside)
    };
    let (points, rest) = points.as_chunks::<3>();
    points.len() > 1 && rest.is_empty() && points.iter().all(|point| is_inside(*point))
}

/// Returns the boxes of an image; the file has its name.
pub(super) fn entries(
    file: &Path,
    text: &str,
    classes: &[&str],
    frames: &Frames,
    size: [u32; 2],
) -> Vec<Entry> {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let time = frames.time_of_name(&name);
    lines(text)
        .map(|(line, text)| (line, time.clone().and_then(|time| row(text, time, classes, size))))
        .collect()
}

fn row(text: &str, time: f64, classes: &[&str], [width, height]: [u32; 2]) -> Result<DetectionRow, Mistake> {
    let mut words = text.split_whitespace();
    let class = id(words.next().unwrap_or_default())?;
    let mut numbers = words.map(number).collect::<Result<Vec<f64>, _>>()?;
    if has_keypoints(&numbers) {
        numbers.truncate(4);
    }
    if let Some(wrong) = numbers.iter().find(|x| !(-ROUNDING..=1.0 + ROUNDING).contains(*x)) {
        return Err(Mistake::Row(format!(
            "expected numbers from 0 to 1, as shares of the image, got {wrong}: are they pixels?"
        )));
    }
    let (bounds, score) = match numbers[..] {
        [x, y, w, h] => ([x - 0.5 * w, y - 0.5 * h, x + 0.5 * w, y + 0.5 * h], 1.0),
        [x, y, w, h, score] => ([x - 0.5 * w, y - 0.5 * h, x + 0.5 * w, y + 0.5 * h], score),
        ref outline if outline.len() >= 6 => {
            let along = |axis: usize| outline.iter().skip(axis).step_by(2).take(outline.len() / 2).copied();
            let low = |axis| along(axis).fold(f64::INFINITY, f64::min);
            let high = |axis| along(axis).fold(f64::NEG_INFINITY, f64::max);
            let score = outline.last().filter(|_| outline.len() % 2 == 1).copied().unwrap_or(1.0);
            ([low(0), low(1), high(0), high(1)], score)
        }
        _ => {
            let (expected, layout) = (5, "class x y width height");
            return Err(Mistake::FieldCount { expected, layout, found: 1 + numbers.len() });
        }
    };
    let name = classes.get(class as usize).ok_or_else(|| {
        Mistake::Row(format!("there is no class {class}: the list of classes has {}, from 0", classes.len()))
    })?;
    let [xmin, ymin, xmax, ymax] = bounds;
    let (width, height) = (f64::from(width), f64::from(height));
    let sides = [xmin * width, ymin * height, xmax * width, ymax * height];
    Ok(DetectionRow::of_box(time, name, score, sides))
}
