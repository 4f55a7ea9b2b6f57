//! Samples of an inertial measurement unit, and their noise.
use manifactor_graph::checked::Positive;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Largest rate of a gyroscope, in rad/s. The fastest gyroscopes measure up to 4000°/s, which is 70 rad/s.
pub const MAX_RATE: f64 = 100.0;
/// Largest acceleration, in m/s². Accelerometers of robots measure up to 16 g, those for impacts up to 200 g.
const MAX_ACCELERATION: f64 = 2000.0;

/// One sample, in the frame of the IMU. It holds for a time of `seconds`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImuSample {
    /// Duration, in seconds.
    pub seconds: f64,
    /// Rate of rotation, in rad/s.
    pub gyroscope: Vector3<f64>,
    /// Specific force, in m/s²: acceleration minus gravity. At rest it points up, with a length of 9.8 m/s².
    pub accelerometer: Vector3<f64>,
}

/// A reading of an inertial measurement unit, in its frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImuReading {
    /// Timestamp, in seconds.
    pub timestamp: f64,
    /// Rate of rotation, in rad/s.
    pub gyroscope: Vector3<f64>,
    /// Specific force, in m/s²: acceleration minus gravity. At rest it points up, with a length of 9.8 m/s².
    pub accelerometer: Vector3<f64>,
}

impl ImuReading {
    /// Returns the reading at a time between this one and `to`, by linear interpolation.
    fn at(&self, to: &Self, timestamp: f64) -> Self {
        let share = (timestamp - self.timestamp) / (to.timestamp - self.timestamp);
        Self {
            timestamp,
            gyroscope: self.gyroscope.lerp(&to.gyroscope, share),
            accelerometer: self.accelerometer.lerp(&to.accelerometer, share),
        }
    }

    /// Returns the samples from one time to another. Each is the mean of two readings, or of interpolated
    /// readings at the ends.
    ///
    /// # Errors
    /// If the readings do not cover the time, or two of them are more than `max_gap` seconds apart.
    pub fn samples(
        readings: &[Self],
        from: f64,
        to: f64,
        max_gap: f64,
    ) -> Result<Vec<ImuSample>, CoverageError> {
        let first = readings.partition_point(|reading| reading.timestamp <= from).saturating_sub(1);
        let end = readings.partition_point(|reading| reading.timestamp < to);
        let (Some(begin), Some(last)) = (readings.first(), readings.last()) else {
            return Err(CoverageError::Missing { from, to });
        };
        if begin.timestamp > from || last.timestamp < to || to <= from {
            return Err(CoverageError::Missing { from, to });
        }
        let mut samples = vec![];
        for pair in readings.get(first..=end).unwrap_or_default().windows(2) {
            let [a, b] = pair else { continue };
            let gap = b.timestamp - a.timestamp;
            if gap > max_gap {
                return Err(CoverageError::Gap { after: a.timestamp, gap, max_gap });
            }
            let (begin, end) = (a.timestamp.max(from), b.timestamp.min(to));
            if end > begin {
                let (begin, end) = (a.at(b, begin), a.at(b, end));
                samples.push(ImuSample {
                    seconds: end.timestamp - begin.timestamp,
                    gyroscope: (begin.gyroscope + end.gyroscope) * 0.5,
                    accelerometer: (begin.accelerometer + end.accelerometer) * 0.5,
                });
            }
        }
        Ok(samples)
    }
}

/// The reason why readings do not cover a time.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CoverageError {
    /// There are no readings for a part of the time.
    #[error(
        "the readings of the IMU do not cover the time from {from:.3} to {to:.3} s: check the clocks of IMU and camera"
    )]
    Missing {
        /// Begin of the time.
        from: f64,
        /// End of the time.
        to: f64,
    },
    /// Two readings are too far apart.
    #[error("the IMU has no reading for {gap:.3} s after {after:.3} s, expected gaps of at most {max_gap} s")]
    Gap {
        /// Time of the reading before the gap.
        after: f64,
        /// Length of the gap, in seconds.
        gap: f64,
        /// Largest gap, in seconds.
        max_gap: f64,
    },
}

/// The reason why samples cannot be integrated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// There is no sample.
    #[error("expected at least one sample of the IMU, got none")]
    None,
    /// The arrays of a document have different lengths.
    #[error(
        "expected arrays of one length, got {seconds} durations, {gyroscope} samples of the gyroscope and {accelerometer} of the accelerometer"
    )]
    Lengths {
        /// Number of durations.
        seconds: usize,
        /// Number of rates.
        gyroscope: usize,
        /// Number of specific forces.
        accelerometer: usize,
    },
    /// A sample's duration is not a positive number.
    #[error("sample {sample} lasts {seconds} s: expected a positive number of seconds")]
    Duration {
        /// Index of the sample, from 0.
        sample: usize,
        /// Its duration.
        seconds: f64,
    },
    /// A rate is not finite, or too large to be in rad/s.
    #[error(
        "sample {sample} turns with {rate} rad/s: expected at most {MAX_RATE} rad/s; convert degrees to radians"
    )]
    Rate {
        /// Index of the sample, from 0.
        sample: usize,
        /// Its rate.
        rate: f64,
    },
    /// A specific force is not finite, or too large to be in m/s².
    #[error("sample {sample} accelerates with {acceleration} m/s²: expected at most {MAX_ACCELERATION} m/s²")]
    Acceleration {
        /// Index of the sample, from 0.
        sample: usize,
        /// Its specific force.
        acceleration: f64,
    },
    /// The covariance of the relative motion cannot be inverted.
    #[error(
        "the covariance of the motion over {seconds} s cannot be inverted: check the noise densities of the IMU"
    )]
    Covariance {
        /// Duration of all samples.
        seconds: f64,
    },
}

impl ImuSample {
    /// Checks that the sample can be integrated. `index` is its index for the message.
    ///
    /// # Errors
    /// If a number is not finite, or too large for its unit.
    pub fn check(&self, index: usize) -> Result<(), SampleError> {
        let (rate, acceleration) = (self.gyroscope.norm(), self.accelerometer.norm());
        if !(self.seconds > 0.0 && self.seconds.is_finite()) {
            return Err(SampleError::Duration { sample: index, seconds: self.seconds });
        }
        if rate.is_nan() || rate > MAX_RATE {
            return Err(SampleError::Rate { sample: index, rate });
        }
        if acceleration.is_nan() || acceleration > MAX_ACCELERATION {
            return Err(SampleError::Acceleration { sample: index, acceleration });
        }
        Ok(())
    }
}

/// Noise of an IMU: spectral densities, as in its datasheet or from its Allan variance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ImuDensities {
    /// White noise of the gyroscope, in rad/s/√Hz.
    pub gyroscope: Positive,
    /// White noise of the accelerometer, in m/s²/√Hz.
    pub accelerometer: Positive,
    /// Random walk of the gyroscope's bias, in rad/s²/√Hz.
    pub gyroscope_walk: Positive,
    /// Random walk of the accelerometer's bias, in m/s³/√Hz.
    pub accelerometer_walk: Positive,
}

/// Densities of a small MEMS sensor (ADIS16448), with margin for its vibration and its model.
impl Default for ImuDensities {
    fn default() -> Self {
        Self {
            gyroscope: Positive::literal(1.7e-4),
            accelerometer: Positive::literal(2e-3),
            gyroscope_walk: Positive::literal(2e-5),
            accelerometer_walk: Positive::literal(3e-3),
        }
    }
}
