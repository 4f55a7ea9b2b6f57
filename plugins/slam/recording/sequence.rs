//! What a data source hands to the pipeline: camera, odometry, detections, and the truth where it is known.
//!
//! Real data and simulated data have the same form. Frames read right to left in names:
//! `world_from_camera` maps a point in the camera's frame to the world's; the camera looks along +z,
//! x is right and y down in the image.
use crate::measurement::Quantities;
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::Direction;
use manifactor_quadric::{BoundingBox, Box3, Camera};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::fmt;

mod observations;

pub use crate::keys::ObjectId;
pub(crate) use observations::Observations;

/// A recording of one camera that moves among objects.
#[derive(Debug, Clone)]
pub struct Sequence {
    /// The camera; the same for all frames.
    pub camera: Camera,
    /// By time, strictly increasing.
    pub frames: Vec<Frame>,
    /// By frame.
    pub detections: Vec<Detection>,
    /// Up in the frame of the odometry, where the source knows it.
    pub up: Option<Direction>,
    /// Readings of an accelerometer, where there is one.
    pub accelerometer: Vec<Acceleration>,
    /// What the estimate can be compared with.
    pub ground_truth: Option<GroundTruth>,
    /// Detections that the source has and that are not used.
    pub unused: Vec<UnusedDetection>,
}

/// Detections that a source has and that are not used, and why.
#[derive(Debug, Clone, PartialEq)]
pub enum UnusedDetection {
    /// Rows of a file for which there is no pose at their time.
    WithoutPose(WithoutPose),
    /// A box that cannot be read.
    Box {
        /// Timestamp of its frame, in seconds.
        timestamp: f64,
        /// Its place in the frame, from 1.
        place: usize,
        /// The fault, with the expected form.
        fault: String,
    },
}

/// Detections for which there is no pose at their time.
#[derive(Debug, Clone, PartialEq)]
pub struct WithoutPose {
    /// Rows without a pose.
    pub rows: usize,
    /// All rows.
    pub of: usize,
    /// Largest share of the rows for which that is expected, from 0 to 1.
    pub allowed: f64,
    /// Largest difference in time that counts as a match, in seconds.
    pub within: f64,
    /// The row among them that is closest to a pose: its timestamp, and its distance from the pose, in seconds.
    pub nearest: (f64, f64),
}

impl WithoutPose {
    /// Returns whether they are more than was expected.
    pub fn is_too_many(&self) -> bool {
        self.rows as f64 > self.allowed * self.of as f64
    }
}

impl fmt::Display for WithoutPose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rows, of, within, nearest: (at, away), .. } = self;
        write!(
            f,
            "{rows} of {of} detections have no pose within {within} s and are left out; the closest, at {at} s, is {away:.6} s away \
             from a pose; `source.max_time_difference` sets the limit"
        )
    }
}

/// What is known of a recording before its first frame.
#[derive(Debug, Clone)]
pub struct Opening {
    /// The camera; the same for all frames.
    pub camera: Camera,
    /// Up in the frame of the odometry, where the source knows it.
    pub up: Option<Direction>,
    /// What the estimate can be compared with.
    pub ground_truth: Option<GroundTruth>,
}

/// What comes with one image.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// The image's time and its pose by odometry.
    pub frame: Frame,
    /// The boxes in it.
    pub detections: Vec<Detection>,
    /// Readings of the accelerometer since the frame before.
    pub accelerometer: Vec<Acceleration>,
    /// Boxes that cannot be used.
    pub unused: Vec<UnusedDetection>,
}

impl Opening {
    /// Nothing but a camera.
    pub fn new(camera: Camera) -> Self {
        Self { camera, up: None, ground_truth: None }
    }

    /// A sequence without frames.
    pub fn into_sequence(self) -> Sequence {
        let Self { camera, up, ground_truth } = self;
        Sequence {
            camera,
            frames: vec![],
            detections: vec![],
            up,
            accelerometer: vec![],
            ground_truth,
            unused: vec![],
        }
    }
}

impl AsRef<Self> for Sequence {
    fn as_ref(&self) -> &Self {
        self
    }
}

impl Sequence {
    /// What is known before the first frame.
    pub fn opening(&self) -> Opening {
        Opening { camera: self.camera, up: self.up, ground_truth: self.ground_truth.clone() }
    }

    /// Frame after frame, as they came. Readings of the accelerometer come with the first frame that is not before them.
    pub fn observations(&self) -> impl Iterator<Item = Observation> {
        Observations::of(self)
    }
}

/// One image, with a pose by odometry.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Seconds.
    pub timestamp: f64,
    /// The dead-reckoned pose, in a world frame of the odometry's own choice; what is measured is the
    /// relative pose of consecutive frames.
    pub world_from_camera: Se3,
}

/// One box that a detector drew, associated with an object or not.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// Place in [`Sequence::frames`].
    pub frame: usize,
    /// The object that it shows, where that is known.
    pub object: Option<ObjectId>,
    /// What the detector takes it for.
    pub scores: ClassScores,
    /// Where it is in the image, in pixels.
    pub bounding_box: BoundingBox,
    /// What is measured besides the box.
    pub quantities: Quantities,
}

/// A detector's scores by class, each from 0 to 1; classes that are not listed score 0. A class with another score is not listed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ClassScores(Vec<(String, f64)>);

impl ClassScores {
    /// All that is known is the best class and its score.
    pub fn single(class: impl Into<String>, score: f64) -> Self {
        std::iter::once((class.into(), score)).collect()
    }
    /// The classes and their scores, in the order given.
    pub fn iter(&self) -> impl Iterator<Item = (&str, f64)> {
        self.0.iter().map(|(class, score)| (class.as_str(), *score))
    }
    /// The class with the highest score, the first of equals; `None` where no class is listed.
    pub fn best(&self) -> Option<(&str, f64)> {
        self.iter().reduce(|best, next| if next.1 > best.1 { next } else { best })
    }
}

impl FromIterator<(String, f64)> for ClassScores {
    fn from_iter<I: IntoIterator<Item = (String, f64)>>(scores: I) -> Self {
        Self(scores.into_iter().filter(|(_, score)| (0.0..=1.0).contains(score)).collect())
    }
}

/// A reading of an accelerometer at rest points up, with length 9.8 m/s².
#[derive(Debug, Clone, PartialEq)]
pub struct Acceleration {
    /// Seconds.
    pub timestamp: f64,
    /// m/s², in the sensor's frame.
    pub acceleration: Vector3<f64>,
}

/// The truth, in a world frame of its own: that of the odometry for simulated data, another for real data.
#[derive(Debug, Clone, Default)]
pub struct GroundTruth {
    /// `world_from_camera` by time; its time stamps need not be those of the frames.
    pub trajectory: Vec<StampedPose>,
    /// The objects; empty if they were not measured.
    pub objects: Vec<TrueObject>,
}

/// An object as it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrueObject {
    /// Its number.
    pub id: ObjectId,
    /// Its class.
    pub class: String,
    /// Pose of the cuboid that encloses it, centre and axes.
    pub world_from_object: Se3,
    /// Half the extents of that cuboid along its own axes, in metres.
    pub half_extents: Vector3<f64>,
    /// The axis-aligned box around the solid itself, in the world's frame.
    pub bounding_box: Box3,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_class_has_a_score_from_0_to_1_or_is_not_listed() {
        let scores = [("cup", 0.5), ("bowl", f64::NAN), ("vase", 1e308), ("book", -1.0), ("chair", 1.0)];
        let scores: ClassScores = scores.iter().map(|(class, score)| ((*class).to_owned(), *score)).collect();
        assert_eq!(scores.iter().collect::<Vec<_>>(), [("cup", 0.5), ("chair", 1.0)]);
        assert_eq!(ClassScores::single("cup", f64::INFINITY), ClassScores::default());
    }
}
