//! The first state, from readings at rest.
use super::{InertialState, VisualInertialSettings};
use crate::samples::ImuReading;
use manifactor_geometry::{ImuBias, Se3, So3, Velocity};
use nalgebra::{Rotation3, Vector3, Vector6};

/// Largest standard deviation of the rate at rest, in rad/s. Running rotors shake the IMU.
const MAX_RATE_DEVIATION: f64 = 0.2;
/// Largest mean of the rate at rest, in rad/s: a gyroscope's bias is smaller.
const MAX_RATE: f64 = 0.2;
/// Largest standard deviation of the specific force at rest, in m/s².
const MAX_FORCE_DEVIATION: f64 = 2.0;
/// Largest difference of the mean specific force from gravity, in m/s².
const MAX_FORCE_DIFFERENCE: f64 = 0.5;
/// Minimum number of readings.
const MIN_READINGS: usize = 10;

/// The reason why readings at the beginning do not determine the first state.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NotAtRest {
    /// There are too few readings.
    #[error("the first {seconds} s have {found} readings of the IMU, expected at least {MIN_READINGS}")]
    Few {
        /// Time at rest, in seconds.
        seconds: f64,
        /// Number of readings.
        found: usize,
    },
    /// The IMU turns.
    #[error(
        "the IMU turns in its first {seconds} s: mean {mean:.3} rad/s, standard deviation {deviation:.3} rad/s (at rest at most \
         {MAX_RATE} and {MAX_RATE_DEVIATION}); begin where it is at rest, or shorten `rest`"
    )]
    Turns {
        /// Time at rest, in seconds.
        seconds: f64,
        /// Length of the mean rate.
        mean: f64,
        /// Standard deviation of the rate.
        deviation: f64,
    },
    /// The IMU accelerates, or its unit is wrong.
    #[error(
        "the IMU accelerates in its first {seconds} s: mean specific force {mean:.2} m/s², standard deviation {deviation:.2} m/s² (at \
         rest {gravity} m/s² and at most {MAX_FORCE_DEVIATION}); begin where it is at rest, or shorten `rest`"
    )]
    Accelerates {
        /// Time at rest, in seconds.
        seconds: f64,
        /// Length of the mean specific force.
        mean: f64,
        /// Standard deviation of the specific force.
        deviation: f64,
        /// Length of gravity.
        gravity: f64,
    },
}

/// Returns mean and standard deviation of vectors, the latter over all directions.
fn mean_and_deviation(vectors: impl Iterator<Item = Vector3<f64>> + Clone) -> (Vector3<f64>, f64) {
    let count = vectors.clone().count().max(1) as f64;
    let mean = vectors.clone().sum::<Vector3<f64>>() / count;
    let variance = vectors.map(|x| (x - mean).norm_squared()).sum::<f64>() / count;
    (mean, variance.sqrt())
}

/// Returns the state at the first keyframe: gravity gives roll and pitch, the mean rate is the gyroscope's bias.
/// Heading and position are zero.
pub(super) fn at_rest(
    settings: &VisualInertialSettings,
    timestamp: f64,
    readings: &[ImuReading],
) -> Result<InertialState, NotAtRest> {
    let (seconds, gravity) = (settings.rest.get(), settings.gravity.get());
    let is_early = |reading: &&ImuReading| (timestamp..=timestamp + seconds).contains(&reading.timestamp);
    let early = readings.iter().filter(is_early);
    let found = early.clone().count();
    if found < MIN_READINGS {
        return Err(NotAtRest::Few { seconds, found });
    }
    let (rate, deviation) = mean_and_deviation(early.clone().map(|reading| reading.gyroscope));
    if !(rate.norm() <= MAX_RATE && deviation <= MAX_RATE_DEVIATION) {
        return Err(NotAtRest::Turns { seconds, mean: rate.norm(), deviation });
    }
    let (force, deviation) = mean_and_deviation(early.map(|reading| reading.accelerometer));
    let mean = force.norm();
    if !((mean - gravity).abs() <= MAX_FORCE_DIFFERENCE && deviation <= MAX_FORCE_DEVIATION) {
        return Err(NotAtRest::Accelerates { seconds, mean, deviation, gravity });
    }
    // for an IMU that is exactly upside down the rotation is not unique
    let upright = Rotation3::rotation_between(&force, &Vector3::z())
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    Ok(InertialState {
        timestamp,
        pose: Se3::new(So3::from_matrix(upright.matrix()), Vector3::zeros()),
        velocity: Velocity::zero(),
        bias: ImuBias(Vector6::new(rate.x, rate.y, rate.z, 0.0, 0.0, 0.0)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn still(gyroscope: Vector3<f64>, accelerometer: Vector3<f64>) -> Vec<ImuReading> {
        (0..100).map(|k| ImuReading { timestamp: f64::from(k) * 0.005, gyroscope, accelerometer }).collect()
    }

    #[test]
    fn gravity_gives_roll_and_pitch() {
        let force = Vector3::new(9.0, 0.5, -3.7);
        let bias = Vector3::new(0.0, 0.02, 0.08);
        let state =
            at_rest(&VisualInertialSettings::default(), 0.0, &still(bias, force.normalize() * 9.81)).unwrap();
        assert!((state.pose.rotation.act(&force.normalize()) - Vector3::z()).norm() < 1e-12);
        assert!((state.bias.gyroscope() - bias).norm() < 1e-12);
    }

    #[test]
    fn a_moving_imu_is_refused() {
        let settings = VisualInertialSettings::default();
        let up = Vector3::new(0.0, 0.0, 9.81);
        let turning = at_rest(&settings, 0.0, &still(Vector3::new(0.0, 0.0, 1.0), up)).unwrap_err();
        assert!(
            turning.to_string().contains("the IMU turns in its first 0.5 s: mean 1.000 rad/s"),
            "{turning}"
        );
        let falling = at_rest(&settings, 0.0, &still(Vector3::zeros(), up * 0.1)).unwrap_err();
        assert!(falling.to_string().contains("mean specific force 0.98 m/s²"), "{falling}");
        let none = at_rest(&settings, 7.0, &still(Vector3::zeros(), up)).unwrap_err();
        assert!(none.to_string().contains("have 0 readings"), "{none}");
    }
}
