//! Accelerometer readings in TUM RGB-D format: `timestamp ax ay az`, one reading per line.
//!
//! Several readings may share a timestamp, because the sensor is read in bursts, but timestamps must not
//! decrease.
use crate::error::{FormatError, Mistake, ProblemList};
use crate::lines::{Fields, lines};
use crate::text::read_text;
use nalgebra::Vector3;
use std::path::Path;

/// An accelerometer reading with its timestamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StampedAcceleration {
    /// Timestamp, in seconds.
    pub timestamp: f64,
    /// Acceleration in the sensor's frame, in m/s²; at rest it points up.
    pub acceleration: Vector3<f64>,
}

/// Reads a file of accelerometer readings.
///
/// # Errors
/// If a line is malformed or timestamps decrease; the error lists all such lines.
pub fn read(path: impl AsRef<Path>) -> Result<Vec<StampedAcceleration>, FormatError> {
    let path = path.as_ref();
    parse(&read_text(path)?, path)
}

/// Works like [`read`], for a given text; `path` is used only in errors.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Vec<StampedAcceleration>, FormatError> {
    let mut problems = ProblemList::of(path.as_ref(), text);
    let mut readings: Vec<StampedAcceleration> = vec![];
    for (line, text) in lines(text) {
        let previous = readings.last().map_or(f64::NEG_INFINITY, |r| r.timestamp);
        let reading = Fields::of(text, "timestamp ax ay az").and_then(|mut fields| {
            let found = fields.number()?;
            if found < previous {
                return Err(Mistake::NotIncreasing { previous, found });
            }
            Ok(StampedAcceleration { timestamp: found, acceleration: fields.numbers::<3>()?.into() })
        });
        readings.extend(problems.ok(line, reading));
    }
    problems.finish().map(|()| readings)
}
