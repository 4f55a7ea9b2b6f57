//! Lists of images in TUM RGB-D format: `timestamp filename`, one image per line (`rgb.txt`).
use crate::error::{FormatError, ProblemList};
use crate::lines::{Fields, lines};
use crate::text::read_text;
use crate::tum::check_increasing;
use std::path::Path;

/// An image file with its timestamp.
#[derive(Debug, Clone, PartialEq)]
pub struct StampedFile {
    /// Timestamp, in seconds.
    pub timestamp: f64,
    /// File name as written, relative to the folder of the list.
    pub file: String,
}

/// Reads a list of images.
///
/// # Errors
/// If a line is malformed or timestamps do not increase; the error lists all such lines.
pub fn read(path: impl AsRef<Path>) -> Result<Vec<StampedFile>, FormatError> {
    let path = path.as_ref();
    parse(&read_text(path)?, path)
}

/// Works like [`read`], for a given text; `path` is used only in errors.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Vec<StampedFile>, FormatError> {
    let mut problems = ProblemList::of(path.as_ref(), text);
    let mut list: Vec<StampedFile> = vec![];
    for (line, text) in lines(text) {
        let previous = list.last().map(|f| f.timestamp);
        let file = Fields::of(text, "timestamp filename").and_then(|mut fields| {
            let timestamp = fields.number()?;
            check_increasing(previous, timestamp)?;
            Ok(StampedFile { timestamp, file: fields.text().to_owned() })
        });
        list.extend(problems.ok(line, file));
    }
    problems.finish().map(|()| list)
}
