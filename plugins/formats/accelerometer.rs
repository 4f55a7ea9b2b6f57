//! Readings of an accelerometer as TUM RGB-D writes them: `timestamp ax ay az`, one a line.
//!
//! Several readings may share a time stamp (the sensor is read in bursts), but time does not run back.
use crate::error::{FormatError, Mistake, Problems};
use crate::lines::{Fields, lines};
use crate::text::read_text;
use nalgebra::Vector3;
use std::path::Path;

/// A reading at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Acceleration {
    /// Seconds.
    pub timestamp: f64,
    /// m/s² in the sensor's frame; at rest it points up.
    pub acceleration: Vector3<f64>,
}

/// Reads the readings.
///
/// # Errors
/// All malformed lines; time that runs back.
pub fn read(path: impl AsRef<Path>) -> Result<Vec<Acceleration>, FormatError> {
    let path = path.as_ref();
    parse(&read_text(path)?, path)
}

/// As [`read`], of a text; `path` is what errors name.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Vec<Acceleration>, FormatError> {
    let mut problems = Problems::of(path.as_ref(), text);
    let mut readings: Vec<Acceleration> = vec![];
    for (line, text) in lines(text) {
        let previous = readings.last().map_or(f64::NEG_INFINITY, |r| r.timestamp);
        let reading = Fields::of(text, "timestamp ax ay az").and_then(|mut fields| {
            let found = fields.number()?;
            if found < previous {
                return Err(Mistake::NotIncreasing { previous, found });
            }
            Ok(Acceleration { timestamp: found, acceleration: fields.numbers::<3>()?.into() })
        });
        readings.extend(problems.ok(line, reading));
    }
    problems.finish().map(|()| readings)
}
