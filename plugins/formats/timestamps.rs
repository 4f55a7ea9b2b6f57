//! Lists of images as TUM RGB-D writes them: `timestamp filename`, one image a line (`rgb.txt`).
use crate::error::{FormatError, Problems};
use crate::lines::{Fields, lines};
use crate::text::read_text;
use crate::tum::increasing;
use std::path::Path;

/// An image at a time.
#[derive(Debug, Clone, PartialEq)]
pub struct StampedFile {
    /// Seconds.
    pub timestamp: f64,
    /// As it is written, relative to the list's folder.
    pub file: String,
}

/// Reads a list of images.
///
/// # Errors
/// All malformed lines; time that does not increase.
pub fn read(path: impl AsRef<Path>) -> Result<Vec<StampedFile>, FormatError> {
    let path = path.as_ref();
    parse(&read_text(path)?, path)
}

/// As [`read`], of a text; `path` is what errors name.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Vec<StampedFile>, FormatError> {
    let mut problems = Problems::of(path.as_ref(), text);
    let mut list: Vec<StampedFile> = vec![];
    for (line, text) in lines(text) {
        let previous = list.last().map(|f| f.timestamp);
        let file = Fields::of(text, "timestamp filename").and_then(|mut fields| {
            let timestamp = fields.number()?;
            increasing(previous, timestamp)?;
            Ok(StampedFile { timestamp, file: fields.text().to_owned() })
        });
        list.extend(problems.ok(line, file));
    }
    problems.finish().map(|()| list)
}
