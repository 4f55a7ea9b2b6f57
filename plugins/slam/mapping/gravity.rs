//! Which way is up, and in which frame the map is drawn.
//!
//! Orientation factors need the world's up, and odometry alone does not know it.
use manifactor_geometry::Se3;
use manifactor_graph::{Direction, NoDirection};
use manifactor_recording::sequence::{Frame, Sequence};
use std::fmt::Debug;

mod accelerometer;
mod ground_truth;
mod source;
mod vector;

pub use accelerometer::Accelerometer;
pub use ground_truth::GroundTruthPose;
pub use source::FromSource;
pub use vector::UpVector;

/// Tells where up is. Chosen by name in a run's `[gravity]`.
#[typetag::serialize(tag = "type")]
pub trait Gravity: Debug + Send + Sync {
    /// Up, and the frame of the map.
    ///
    /// # Errors
    /// If the sequence does not have what this needs.
    fn locate(&self, sequence: &Sequence) -> Result<MapFrame, GravityError>;

    /// In a stream: seconds after the first frame from which on nothing that comes makes a difference.
    fn settled_after(&self) -> f64 {
        0.0
    }
}

manifactor_graph::kind!(dyn Gravity, "gravity");

/// The frame of the map, and up in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapFrame {
    /// Takes the poses of the odometry to the map.
    pub map_from_odometry: Se3,
    /// Up in the map; `None` if unknown.
    pub up: Option<Direction>,
}

impl MapFrame {
    /// The odometry's own frame.
    pub fn of_odometry(up: Option<Direction>) -> Self {
        Self { map_from_odometry: Se3::identity(), up }
    }
}

/// Why up could not be had.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GravityError {
    /// A sequence of nothing.
    #[error("the sequence has no frames")]
    NoFrames,
    /// No ground truth near the first frame.
    #[error(
        "no ground-truth pose within {within} s of the first frame (at {timestamp} s{}): \
         give the source a ground truth, or choose another `[gravity]`",
        nearest.map_or(String::new(), |n| format!("; the nearest is at {n} s"))
    )]
    NoGroundTruth {
        /// The first frame's time stamp.
        timestamp: f64,
        /// How near it should be.
        within: f64,
        /// The time stamp of the nearest pose, if there is any.
        nearest: Option<f64>,
    },
    /// No readings near the first frame.
    #[error(
        "no accelerometer reading within {within} s of the first frame (at {timestamp} s): \
         give the source an accelerometer file, or choose another `[gravity]`"
    )]
    NoReadings {
        /// The first frame's time stamp.
        timestamp: f64,
        /// How near they should be.
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
        let frame = |timestamp: f64| Frame { timestamp, world_from_camera: Se3::identity() };
        Sequence {
            camera: Camera::new([500.0, 500.0, 320.0, 240.0], 640, 480).unwrap(),
            frames: vec![frame(10.0), frame(11.0)],
            detections: vec![],
            up: None,
            accelerometer: vec![],
            ground_truth: None,
            unused: vec![],
        }
    }

    /// The true world's z axis is the first camera's -y.
    pub(crate) fn upright_camera() -> Se3 {
        let quarter = So3::exp(&Vector3::new(-std::f64::consts::FRAC_PI_2, 0.0, 0.0));
        Se3::new(quarter, Vector3::new(1.0, 2.0, 3.0))
    }

    pub(crate) fn with_truth(timestamp: f64) -> Sequence {
        let trajectory = vec![StampedPose { timestamp, pose: upright_camera() }];
        Sequence { ground_truth: Some(GroundTruth { trajectory, objects: vec![] }), ..sequence() }
    }
}
