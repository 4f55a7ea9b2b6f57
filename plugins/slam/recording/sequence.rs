//! Output of a data source: camera, odometry, detections, and ground truth if known.
//!
//! Recorded and simulated data have the same form. Names of frames read from right to left:
//! `world_from_camera` maps a point in the camera frame to the world frame. The camera looks along +z; in the
//! image x points right and y down.
use crate::camera::{Cameras, MountedCamera};
use crate::ellipse::ImageEllipse;
use crate::georeference::Georeference;
use crate::measurement::Quantities;
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::{Direction, Noise};
use manifactor_quadric::{BoundingBox, Box3};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::sync::Arc;

pub mod jumps;
mod observations;
pub mod pose_graph;

pub use crate::keys::ObjectId;
use jumps::OdometryJump;
pub(crate) use observations::Observations;
use pose_graph::{PoseFactor, PoseGraphChanges};

/// A recording of one or more cameras on a body that moves among objects.
#[derive(Debug, Clone)]
pub struct Sequence {
    /// Cameras, shared by all frames.
    pub cameras: Cameras,
    /// Pose of the first camera on the body whose odometry the source has. `None`: it is the odometry of the camera.
    pub body_from_camera: Option<Se3>,
    /// Frames in strictly increasing order of time.
    pub frames: Vec<Frame>,
    /// Detections in the order of their frames.
    pub detections: Vec<Detection>,
    /// Up direction in the odometry frame, if the source knows it.
    pub up: Option<Direction>,
    /// Place of the odometry on the Earth, if the source knows it.
    pub georeference: Option<Georeference>,
    /// Readings of an accelerometer, if there is one.
    pub accelerometer: Vec<Acceleration>,
    /// Ground truth to compare the estimate with.
    pub ground_truth: Option<GroundTruth>,
    /// Factors on poses in addition to odometry, each with the index of the frame with which it arrived.
    pub pose_factors: Vec<(usize, PoseFactor)>,
    /// Jumps of the odometry after which the poses were corrected.
    pub corrected_jumps: Vec<OdometryJump>,
    /// Input that the source contains but does not use.
    pub unused: Vec<UnusedInput>,
}

/// Unused input of a source, with the reason.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum UnusedInput {
    /// Rows of a file whose time has no pose.
    WithoutPose(DetectionsWithoutPose),
    /// A box that cannot be read.
    Box {
        /// Timestamp of its frame. Unit: seconds.
        timestamp: f64,
        /// Position in the frame, from 1.
        place: usize,
        /// The fault, with the expected form.
        fault: String,
    },
    /// An image without a pose.
    Image {
        /// Number of its boxes.
        boxes: usize,
        /// The fault, with the time and the remedy.
        fault: String,
    },
    /// Other data of a recording: their number, the fault, and the remedy.
    Recording(String),
    /// A change of the pose graph, or the noise of the odometry, that cannot be read or applied.
    PoseGraph {
        /// Timestamp of its frame. Unit: seconds.
        timestamp: f64,
        /// Its field, and its position in a list from 1.
        field: String,
        /// The fault, with the expected form.
        fault: String,
    },
}

impl UnusedInput {
    /// Returns the number of boxes that are not used for this reason.
    pub fn boxes(&self) -> usize {
        match self {
            Self::WithoutPose(without) => without.rows,
            Self::Box { .. } => 1,
            Self::Image { boxes, .. } => *boxes,
            Self::Recording(_) | Self::PoseGraph { .. } => 0,
        }
    }
}

/// Detections whose time has no pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DetectionsWithoutPose {
    /// Number of rows without a pose.
    pub rows: usize,
    /// Number of all rows.
    pub of: usize,
    /// Largest expected share of rows without a pose, from 0 to 1.
    pub allowed: f64,
    /// Largest time difference of a match. Unit: seconds.
    pub within: f64,
    /// True if poses are interpolated: then `within` is the largest time between two poses.
    pub is_interpolated: bool,
    /// The row without a pose that is closest to one: its timestamp, and its distance from the pose. Unit:
    /// seconds.
    pub nearest: (f64, f64),
}

impl DetectionsWithoutPose {
    /// Returns whether more rows than expected have no pose.
    pub fn is_too_many(&self) -> bool {
        self.rows as f64 > self.allowed * self.of as f64
    }
}

impl fmt::Display for DetectionsWithoutPose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rows, of, within, nearest: (at, away), .. } = self;
        if self.is_interpolated {
            return write!(
                f,
                "{rows} of {of} detections are not between two poses at most {within} s apart and are left out; \
                 `source.max_pose_gap` sets the limit"
            );
        }
        write!(
            f,
            "{rows} of {of} detections have no pose within {within} s and are left out; the closest, at {at} s, is {away:.6} s away \
             from a pose; `source.max_time_difference` sets the limit"
        )
    }
}

/// Data of a recording that are known before its first frame.
#[derive(Debug, Clone)]
pub struct SequenceHeader {
    /// Cameras, shared by all frames.
    pub cameras: Cameras,
    /// Pose of the first camera on the body whose odometry the source has. `None`: it is the odometry of the camera.
    pub body_from_camera: Option<Se3>,
    /// Up direction in the odometry frame, if the source knows it.
    pub up: Option<Direction>,
    /// Place of the odometry on the Earth, if the source knows it.
    pub georeference: Option<Georeference>,
    /// Ground truth to compare the estimate with.
    pub ground_truth: Option<GroundTruth>,
}

/// Data of one image.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Time of the image, and its pose by odometry.
    pub frame: Frame,
    /// Boxes in the image.
    pub detections: Vec<Detection>,
    /// Readings of the accelerometer since the previous frame.
    pub accelerometer: Vec<Acceleration>,
    /// Changes of the pose graph.
    pub pose_graph: PoseGraphChanges,
    /// Input of the frame that cannot be used.
    pub unused: Vec<UnusedInput>,
}

impl SequenceHeader {
    /// Creates an opening with only the cameras.
    pub fn new(cameras: impl Into<Cameras>) -> Self {
        Self {
            cameras: cameras.into(),
            body_from_camera: None,
            up: None,
            georeference: None,
            ground_truth: None,
        }
    }

    /// Converts the opening to a sequence without frames.
    pub fn into_sequence(self) -> Sequence {
        let Self { cameras, body_from_camera, up, georeference, ground_truth } = self;
        Sequence {
            cameras,
            body_from_camera,
            frames: vec![],
            detections: vec![],
            up,
            georeference,
            accelerometer: vec![],
            ground_truth,
            pose_factors: vec![],
            corrected_jumps: vec![],
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
    /// Returns the data that are known before the first frame.
    pub fn header(&self) -> SequenceHeader {
        SequenceHeader {
            cameras: self.cameras.clone(),
            body_from_camera: self.body_from_camera,
            up: self.up,
            georeference: self.georeference,
            ground_truth: self.ground_truth.clone(),
        }
    }

    /// Returns the frames in order of arrival. A reading of the accelerometer belongs to the first frame at
    /// or after its time.
    pub fn observations(&self) -> impl Iterator<Item = Observation> {
        Observations::from_sequence(self)
    }
}

/// One image, with its pose by odometry.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Timestamp. Unit: seconds.
    pub timestamp: f64,
    /// Dead-reckoned pose in a world frame that the odometry chooses. The measurement is the relative pose of
    /// consecutive frames.
    pub world_from_camera: Se3,
    /// Noise of the step from the previous frame, rotation before translation. Unit: rad, m. `None`: the noise
    /// of the settings.
    pub odometry_noise: Option<Arc<Noise>>,
}

impl Frame {
    /// Creates a frame whose odometry has the noise of the settings.
    pub fn new(timestamp: f64, world_from_camera: Se3) -> Self {
        Self { timestamp, world_from_camera, odometry_noise: None }
    }
}

impl Observation {
    /// Creates an image without boxes.
    pub fn new(frame: Frame) -> Self {
        Self {
            frame,
            detections: vec![],
            accelerometer: vec![],
            pose_graph: PoseGraphChanges::default(),
            unused: vec![],
        }
    }
}

/// One box from a detector, with or without the object that it shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// Index in [`Sequence::frames`].
    pub frame: usize,
    /// The object that the box shows, if known.
    pub object: Option<ObjectId>,
    /// Class scores of the detector.
    pub scores: ClassScores,
    /// The camera of the image.
    pub camera: Arc<MountedCamera>,
    /// Box in the image. Unit: pixels.
    pub bounding_box: BoundingBox,
    /// Measurements in addition to the box.
    pub quantities: Quantities,
    /// Outline of the object, if measured. It belongs to the box.
    pub ellipse: Option<ImageEllipse>,
}

/// Two boxes of one class with a larger overlap (intersection over union) show one object: detectors that suppress such
/// boxes do so from 0.45 to 0.7. In the boxes of freiburg1/desk, desk2, freiburg2/desk and freiburg3 (35,703 boxes of a
/// detector with a limit of 0.5) no two boxes of one class overlap by more than 0.5.
const MAX_OVERLAP: f64 = 0.7;

/// A box that is left out, because it repeats another box of its image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RepeatedBox {
    /// Its position in the image, from 1.
    place: usize,
    /// Position of the box that is kept.
    kept: usize,
    /// Overlap of the two.
    overlap: f64,
}

/// Removes boxes of one class that overlap almost completely, since each would be an object of its own. They come from
/// detectors without suppression, and from tables that were appended twice. The box with the highest score is kept, and of
/// equal ones the first.
pub(crate) fn remove_repeated(boxes: &mut Vec<Detection>) -> Vec<RepeatedBox> {
    let score = |place: &usize| boxes[*place].scores.best().map_or(0.0, |(_, score)| score);
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by(|a, b| score(b).total_cmp(&score(a)));
    let (mut kept, mut repeated): (Vec<usize>, Vec<RepeatedBox>) = (vec![], vec![]);
    for place in order {
        let same = |other: &&usize| boxes[place].shows_the_same_as(&boxes[**other]);
        match kept.iter().find(same) {
            Some(other) => {
                let overlap = boxes[place].bounding_box.iou(&boxes[*other].bounding_box);
                repeated.push(RepeatedBox { place: place + 1, kept: other + 1, overlap });
            }
            None => kept.push(place),
        }
    }
    repeated.sort_by_key(|repeated| repeated.place);
    for repeated in repeated.iter().rev() {
        boxes.remove(repeated.place - 1);
    }
    repeated
}

impl UnusedInput {
    /// A box that repeats another one of its image.
    pub(crate) fn repeated(timestamp: f64, RepeatedBox { place, kept, overlap }: RepeatedBox) -> Self {
        let fault = format!(
            "it shows what box {kept} shows: the class is the same, and they overlap by {overlap:.2}"
        );
        Self::Box { timestamp, place, fault }
    }
}

impl Detection {
    /// Returns whether two boxes of one image show one object.
    fn shows_the_same_as(&self, other: &Self) -> bool {
        let class = |detection: &Self| detection.scores.best().map(|(class, _)| class.to_owned());
        self.object == other.object
            && self.camera.index == other.camera.index
            && self.bounding_box.iou(&other.bounding_box) > MAX_OVERLAP
            && class(self) == class(other)
    }

    /// Creates a box in frame 0, of an unknown object and without further measurements.
    pub fn new(camera: Arc<MountedCamera>, bounding_box: BoundingBox, scores: ClassScores) -> Self {
        let quantities = Quantities::NONE;
        Self { frame: 0, object: None, scores, camera, bounding_box, quantities, ellipse: None }
    }
}

/// Scores of a detector by class, each from 0 to 1; classes that are not listed score 0. Classes with scores
/// outside of this range are dropped.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ClassScores(Vec<(String, f64)>);

impl ClassScores {
    /// Creates the scores of a detector that reports only its best class.
    pub fn single(class: impl Into<String>, score: f64) -> Self {
        std::iter::once((class.into(), score)).collect()
    }
    /// Returns the classes and their scores in the given order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, f64)> {
        self.0.iter().map(|(class, score)| (class.as_str(), *score))
    }
    /// Returns the class with the highest score; the first wins ties. `None` if no class is listed.
    pub fn best(&self) -> Option<(&str, f64)> {
        self.iter().reduce(|best, next| if next.1 > best.1 { next } else { best })
    }
}

impl FromIterator<(String, f64)> for ClassScores {
    fn from_iter<I: IntoIterator<Item = (String, f64)>>(scores: I) -> Self {
        Self(scores.into_iter().filter(|(_, score)| (0.0..=1.0).contains(score)).collect())
    }
}

/// Reading of an accelerometer. At rest it points up and has the length 9.8 m/s².
#[derive(Debug, Clone, PartialEq)]
pub struct Acceleration {
    /// Timestamp. Unit: seconds.
    pub timestamp: f64,
    /// Acceleration in the sensor frame. Unit: m/s².
    pub acceleration: Vector3<f64>,
}

/// Ground truth in its world frame: the odometry frame for simulated data, a separate frame for recorded
/// data.
#[derive(Debug, Clone, Default)]
pub struct GroundTruth {
    /// `world_from_camera` by time. Its timestamps may differ from the timestamps of the frames.
    pub trajectory: Vec<StampedPose>,
    /// True objects; empty if they were not measured.
    pub objects: Vec<TrueObject>,
}

/// A true object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrueObject {
    /// Number of the object.
    pub id: ObjectId,
    /// Class of the object.
    pub class: String,
    /// Pose of the enclosing cuboid: centre and axes.
    pub world_from_object: Se3,
    /// Half extents of the cuboid along its axes. Unit: metres.
    pub half_extents: Vector3<f64>,
    /// Axis-aligned box around the object in the world frame.
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
