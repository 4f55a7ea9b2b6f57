//! The up direction and the frame of the map.
//!
//! Orientation factors need the up direction of the world, and odometry alone does not provide it.
use manifactor_geometry::Se3;
use manifactor_graph::{Direction, NoDirection};
use manifactor_recording::sequence::{Frame, Sequence};
use manifactor_recording::source::SequenceSource;
use std::fmt::Debug;

mod accelerometer;
mod ground_truth;
mod source;
mod vector;

pub use accelerometer::AccelerometerGravity;
pub use ground_truth::GroundTruthGravity;
pub use source::SourceGravity;
pub use vector::VectorGravity;

/// A method to find the up direction. Chosen by name in `[gravity]` of a run.
#[typetag::serialize(tag = "type")]
pub trait Gravity: Debug + Send + Sync {
    /// Returns the up direction and the frame of the map.
    ///
    /// # Errors
    /// If the sequence lacks the required data.
    fn locate(&self, sequence: &Sequence) -> Result<MapFrame, GravityError>;

    /// Returns whether the up direction may be found in data of `source`.
    fn may_find_up(&self, _source: &dyn SequenceSource) -> bool {
        true
    }

    /// Returns the time in a stream after which new data change nothing, in seconds after the first frame.
    fn final_after_s(&self) -> f64 {
        0.0
    }
}

manifactor_graph::kind!(dyn Gravity, "gravity");

/// The frame of the map, and the up direction in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapFrame {
    /// Transform from the odometry frame to the map frame.
    pub map_from_odometry: Se3,
    /// Up in the map; `None` if unknown.
    pub up: Option<Direction>,
}

impl MapFrame {
    /// Uses the odometry frame as the map frame.
    pub fn of_odometry(up: Option<Direction>) -> Self {
        Self { map_from_odometry: Se3::identity(), up }
    }
}

/// Reason why the up direction is unknown.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GravityError {
    /// The sequence has no frames.
    #[error("the sequence has no frames")]
    NoFrames,
    /// No ground truth near the first frame.
    #[error(
        "no ground-truth pose within {within} s of the first frame (at {timestamp} s{}): \
         give the source a ground truth, or choose another `[gravity]`",
        nearest.map_or(String::new(), |n| format!("; the nearest is at {n} s"))
    )]
    NoGroundTruth {
        /// Timestamp of the first frame.
        timestamp: f64,
        /// Allowed time difference, in seconds.
        within: f64,
        /// Timestamp of the nearest pose, if there is one.
        nearest: Option<f64>,
    },
    /// No readings near the first frame.
    #[error(
        "no accelerometer reading within {within} s of the first frame (at {timestamp} s): \
         give the source an accelerometer file, or choose another `[gravity]`"
    )]
    NoReadings {
        /// Timestamp of the first frame.
        timestamp: f64,
        /// Allowed time difference, in seconds.
        within: f64,
    },
    /// Readings that cancel out.
    #[error("the accelerometer's readings average to no direction: {0}")]
    NoDirection(#[from] NoDirection),
}

fn first_frame(sequence: &Sequence) -> Result<&Frame, GravityError> {
    sequence.frames.first().ok_or(GravityError::NoFrames)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use manifactor_formats::tum::StampedPose;
    use manifactor_geometry::So3;
    use manifactor_quadric::Camera;
    use manifactor_recording::sequence::GroundTruth;
    use nalgebra::Vector3;

    /// Two frames at 10 s and 11 s; the camera looks along the odometry's z axis.
    pub(crate) fn sequence() -> Sequence {
        let frame = |timestamp: f64| Frame::new(timestamp, Se3::identity());
        Sequence {
            cameras: Camera::new([500.0, 500.0, 320.0, 240.0], 640, 480).unwrap().into(),
            body_from_camera: None,
            frames: vec![frame(10.0), frame(11.0)],
            detections: vec![],
            up: None,
            accelerometer: vec![],
            ground_truth: None,
            georeference: None,
            pose_factors: vec![],
            corrected_jumps: vec![],
            unused: vec![],
        }
    }

    /// The z axis of the true world is -y of the first camera.
    pub(crate) fn upright_camera() -> Se3 {
        let quarter = So3::exp(&Vector3::new(-std::f64::consts::FRAC_PI_2, 0.0, 0.0));
        Se3::new(quarter, Vector3::new(1.0, 2.0, 3.0))
    }

    pub(crate) fn with_truth(timestamp: f64) -> Sequence {
        let trajectory = vec![StampedPose { timestamp, pose: upright_camera() }];
        Sequence { ground_truth: Some(GroundTruth { trajectory, objects: vec![] }), ..sequence() }
    }
}
