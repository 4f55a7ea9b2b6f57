use super::{Gravity, GravityError, MapFrame, first_frame};
use manifactor_geometry::{RotationError, So3};
use manifactor_graph::checked::NotNegative;
use manifactor_graph::{Direction, register};
use manifactor_recording::sequence::{Frame, Sequence};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The up direction is the mean of accelerometer readings.
///
/// At rest, an accelerometer measures 9.8 m/s² upwards. A hand-held camera is never at rest. So each reading
/// is rotated into the odometry frame by the pose of the nearest frame. The mean over the window cancels
/// accelerations back and forth. The map stays in the odometry frame.
///
/// ```toml
/// gravity = { type = "accelerometer", window = 10.0, camera_from_sensor = [0.0, 0.0, 1.0, 0.0] }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Accelerometer")]
pub struct AccelerometerGravity {
    /// Largest time difference to the first frame at which a reading is used. A longer window reduces the
    /// effect of accelerations and increases the effect of odometry drift. Unit: seconds.
    pub window: NotNegative,
    /// Rotation from the sensor frame to the camera frame, as a unit quaternion (x, y, z, w). For the Kinect
    /// of TUM RGB-D it is half a turn about z: [0, 0, 1, 0].
    pub camera_from_sensor: Quaternion,
}

/// A unit quaternion (x, y, z, w).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "[f64; 4]", into = "[f64; 4]")]
#[schemars(with = "[f64; 4]")]
pub struct Quaternion(pub So3);

impl TryFrom<[f64; 4]> for Quaternion {
    type Error = RotationError;
    fn try_from(xyzw: [f64; 4]) -> Result<Self, RotationError> {
        So3::from_quaternion_xyzw(xyzw).map(Self)
    }
}
impl From<Quaternion> for [f64; 4] {
    fn from(q: Quaternion) -> [f64; 4] {
        q.0.quaternion_xyzw()
    }
}

impl Default for AccelerometerGravity {
    fn default() -> Self {
        Self { window: NotNegative::literal(10.0), camera_from_sensor: Quaternion(So3::identity()) }
    }
}

#[typetag::serialize(name = "accelerometer")]
impl Gravity for AccelerometerGravity {
    fn locate(&self, sequence: &Sequence) -> Result<MapFrame, GravityError> {
        let first = first_frame(sequence)?;
        let near = |timestamp: f64| (timestamp - first.timestamp).abs() <= *self.window;
        let mut near = sequence.accelerometer.iter().filter(|r| near(r.timestamp)).peekable();
        if near.peek().is_none() {
            return Err(GravityError::NoReadings { timestamp: first.timestamp, within: *self.window });
        }
        let up: Vector3<f64> = near
            .map(|reading| {
                let felt = self.camera_from_sensor.0.act(&reading.acceleration);
                frame_at(&sequence.frames, reading.timestamp)
                    .unwrap_or(first)
                    .world_from_camera
                    .rotation
                    .act(&felt)
            })
            .sum();
        Ok(MapFrame::of_odometry(Some(Direction::new(up)?)))
    }

    fn final_after_s(&self) -> f64 {
        *self.window
    }
}
register!(dyn Gravity, "accelerometer", AccelerometerGravity);

/// Returns the frame nearest in time.
fn frame_at(frames: &[Frame], timestamp: f64) -> Option<&Frame> {
    let after = frames.partition_point(|frame| frame.timestamp < timestamp);
    let around = frames.get(after.saturating_sub(1)..frames.len().min(after + 1)).unwrap_or_default();
    let away = |frame: &Frame| (frame.timestamp - timestamp).abs();
    around.iter().min_by(|a, b| away(a).total_cmp(&away(b)))
}

#[cfg(test)]
mod tests {
    use super::super::tests::sequence;
    use super::*;
    use manifactor_recording::sequence::Acceleration;

    fn reading(timestamp: f64, acceleration: [f64; 3]) -> Acceleration {
        Acceleration { timestamp, acceleration: acceleration.into() }
    }

    fn half_turn() -> AccelerometerGravity {
        let camera_from_sensor = Quaternion(So3::from_quaternion_xyzw([0.0, 0.0, 1.0, 0.0]).unwrap());
        AccelerometerGravity { window: NotNegative::literal(1.0), camera_from_sensor }
    }

    #[test]
    fn up_is_the_average_of_what_is_felt_at_first() {
        let accelerometer = vec![
            reading(9.5, [1.0, 9.0, 0.0]),
            reading(10.5, [-1.0, 9.0, 0.0]),
            reading(13.0, [9.0, 0.0, 0.0]),
        ];
        let map = half_turn().locate(&Sequence { accelerometer, ..sequence() }).unwrap();
        assert!((*map.up.unwrap() - Vector3::new(0.0, -1.0, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn a_camera_that_turns_feels_the_same_up() {
        let quarter = So3::exp(&Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
        let mut sequence = sequence();
        sequence.frames[1].world_from_camera.rotation = quarter;
        // up is -y in the world, and -x in the second camera
        sequence.accelerometer = vec![reading(10.1, [0.0, 9.0, 0.0]), reading(10.9, [9.0, 0.0, 0.0])];
        let map = half_turn().locate(&sequence).unwrap();
        assert!((*map.up.unwrap() - Vector3::new(0.0, -1.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn free_fall_and_silence_are_errors() {
        let fall = vec![reading(10.0, [0.0; 3])];
        let fall = AccelerometerGravity::default().locate(&Sequence { accelerometer: fall, ..sequence() });
        assert!(matches!(fall, Err(GravityError::NoDirection(_))));
        let silence = AccelerometerGravity::default().locate(&sequence());
        assert!(matches!(silence, Err(GravityError::NoReadings { .. })));
    }
}
