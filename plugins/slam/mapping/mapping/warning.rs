use manifactor_config::{nearest, quoted_list};
use manifactor_recording::journal::LostFrames;
use manifactor_recording::sequence::jumps::OdometryJump;
use serde::{Serialize, Serializer};
use std::fmt;
use std::path::PathBuf;

/// A warning to the user: nothing failed, but the result may be worse than expected.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// A semantic rule names a class that no object has.
    ClassWithoutObjects {
        /// Class name in the rule.
        class: String,
        /// Factor of the rule.
        factor: String,
        /// Classes of the objects.
        seen: Vec<String>,
    },
    /// The odometry looks like different units or a different order of numbers.
    Implausible {
        /// Description of the problem.
        what: String,
    },
    /// The odometry jumps, as after a loss of tracking.
    OdometryJump {
        /// The first jump.
        first: OdometryJump,
        /// Number of jumps.
        jumps: usize,
        /// True if the poses after them were corrected.
        is_corrected: bool,
    },
    /// Detections of the source that are not used.
    Unused {
        /// Their number and kind, the cause, and the remedy.
        what: String,
    },
    /// More unused detections than expected: the map does not cover the whole recording.
    TooManyUnused {
        /// Their number and kind, the cause, and the remedy.
        what: String,
        /// Expected share, from 0 to 1.
        allowed: f64,
    },
    /// Boxes that do not overlap the image of the camera, more than a detector makes by mistake.
    OutsideImage {
        /// Number of such boxes.
        outside: usize,
        /// Number of all boxes of the camera.
        boxes: usize,
        /// Setting of the camera.
        setting: String,
        /// Width and height of the image. Unit: pixels.
        image: [u32; 2],
    },
    /// Boxes that all lie between 0 and 1: shares of the image instead of pixels.
    NormalizedBoxes {
        /// Number of boxes of the camera.
        boxes: usize,
        /// Setting of the camera.
        setting: String,
        /// Width and height of the image. Unit: pixels.
        image: [u32; 2],
    },
    /// Detected objects that are not mapped, for one reason.
    NotMapped {
        /// The reason, with the number and keys of the objects.
        what: String,
        /// Setting to change.
        remedy: &'static str,
    },
    /// Objects whose size is not limited by boxes in some direction.
    RunAway {
        /// Keys and semi-axes of the objects.
        objects: Vec<String>,
    },
    /// Objects with a semi-axis far shorter than the others, see
    /// [`is_flat`](manifactor_quadric::DualQuadric::is_flat).
    Flat {
        /// Keys and semi-axes of the objects.
        objects: Vec<String>,
    },
    /// The estimated noise of the odometry is the largest that is tried.
    NoiseAtLimit {
        /// Standard deviation of the rotation. Unit: radians.
        rotation: f64,
        /// Standard deviation of the translation. Unit: metres.
        translation: f64,
    },
    /// Too many boxes belong to objects without an ellipsoid that explains them, so poses or camera are probably
    /// wrong.
    PosesMisfit {
        /// Number of such boxes.
        unexplained: usize,
        /// Number of these boxes and those of mapped objects.
        boxes: usize,
    },
    /// The boxes of a further camera contradict its pose on the body.
    Extrinsics {
        /// Name of the camera.
        camera: String,
        /// Angle between the given and the better rotation. Unit: radians.
        rotation: f64,
        /// Gain in log-likelihood.
        gain: f64,
    },
    /// None of the boxes can be used: they cannot be read, or have no pose.
    NoUsableBoxes {
        /// Number of boxes.
        boxes: usize,
    },
    /// The map has no objects.
    NoObjects {
        /// Number of boxes that were read.
        boxes: usize,
        /// Number of detected objects.
        detected: usize,
    },
    /// Data association may assign boxes to wrong objects, and without a loss they have full weight.
    NotRobust,
    /// Factors that are undefined at the estimate.
    Inactive {
        /// Number of such factors.
        inactive: usize,
        /// Number of all factors.
        factors: usize,
    },
    /// The solve ended without a minimum.
    NotConverged {
        /// Termination of the solve.
        termination: String,
    },
    /// Directions that no factor constrains, only damping.
    Undetermined {
        /// Description of the directions.
        what: String,
    },
    /// Trajectory errors that cover less than half of the poses.
    FewPoses {
        /// Poses with a true pose at their time.
        covered: usize,
        /// Poses of the estimate.
        poses: usize,
        /// Poses of the ground truth.
        truth: usize,
        /// Largest time difference, in seconds.
        within: f64,
    },
    /// The error is larger than the error of the odometry.
    WorseThanOdometry {
        /// Alignment of the comparison.
        alignment: String,
        /// Error of the odometry, in metres.
        odometry: f64,
        /// Error of the estimate, in metres.
        estimate: f64,
    },
    /// The start pose in the prior map is unknown.
    NotLocated {
        /// File of the prior map.
        file: PathBuf,
    },
    /// The journal lacks frames of its run.
    JournalIncomplete(LostFrames),
    /// Boxes could not be held out, and were used.
    NotHeldOut,
    /// The ground truth for the evaluation is missing.
    NotEvaluated {
        /// Cause.
        reason: String,
    },
}

impl Warning {
    /// Returns whether the map lacks a part of the detections that was expected in it.
    pub fn is_partial(&self) -> bool {
        matches!(
            self,
            Self::TooManyUnused { .. }
                | Self::OutsideImage { .. }
                | Self::NormalizedBoxes { .. }
                | Self::NoUsableBoxes { .. }
        )
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ClassWithoutObjects { class, factor, seen } => {
                write!(f, "no object is of class `{class}`, which `{factor}` is configured for")?;
                match nearest(class, seen.iter().map(String::as_str)) {
                    Some(near) => write!(f, "; did you mean `{near}`?"),
                    None if seen.is_empty() => Ok(()),
                    None => write!(f, "; there are {}", quoted_list(seen)),
                }
            }
            Self::OdometryJump { first, jumps, is_corrected } => {
                let OdometryJump { timestamp, seconds, translation, rotation } = first;
                let often = if *jumps == 1 { String::new() } else { format!(", the first of {jumps} jumps") };
                let degrees = rotation.to_degrees();
                write!(
                    f,
                    "the odometry jumps by {translation:.2} m and {degrees:.0}° in {seconds:.3} s before {timestamp} s{often}: {}",
                    if *is_corrected {
                        "the poses after it are corrected by objects that were seen before"
                    } else {
                        "objects may be mapped twice; map the part before and the part after it one by one, the second with \
                         the map of the first as `prior_map`"
                    }
                )
            }
            Self::Unused { what } => f.write_str(what),
            Self::TooManyUnused { what, allowed } => {
                write!(f, "{what}; `source.max_without_pose` allows a share of {allowed}")
            }
            Self::OutsideImage { outside, boxes, setting, image: [width, height] } => write!(
                f,
                "{outside} of {boxes} boxes lie outside of the image of {width} × {height} pixels and are left out: \
                 compare `{setting}.width` and `{setting}.height` with the images of the detector"
            ),
            Self::NormalizedBoxes { boxes, setting, image: [width, height] } => write!(
                f,
                "all {boxes} boxes of `{setting}` lie between 0 and 1, where pixels are expected: multiply x by the width, {width}, \
                 and y by the height, {height}"
            ),
            Self::NotMapped { what, remedy } => write!(f, "not mapped: {what}; {remedy}"),
            Self::NoUsableBoxes { boxes } => {
                write!(f, "none of {boxes} boxes can be used, so the map has no objects")
            }
            Self::NoObjects { boxes: 0, .. } => f.write_str("the source has no boxes, so the map has no objects"),
            Self::NoObjects { detected: 0, .. } => f.write_str(
                "no box says which object it shows; `association = { type = \"likelihood\" }` finds out",
            ),
            Self::NoObjects { detected, .. } => {
                write!(f, "none of {detected} detected objects is mapped; see why in objects.json")
            }
            Self::RunAway { objects } => write!(
                f,
                "boxes do not limit the shape of {}: {}; the factor `shape_prior` keeps the semi-axes of an object alike",
                if objects.len() == 1 { "an object" } else { "objects" },
                objects.join(", ")
            ),
            Self::PosesMisfit { unexplained, boxes } => write!(
                f,
                "no ellipsoid fits {unexplained} of {boxes} boxes: check that the poses are those of the camera (world \
                 from camera, z forward, quaternion in the order of the format), and compare cx, cy and the size of the image \
                 with the images of the detector"
            ),
            Self::Flat { objects } => write!(
                f,
                "flat, seen from one side: {}; boxes hardly determine their thickness, which the factor `shape_prior` does",
                objects.join(", ")
            ),
            Self::NoiseAtLimit { rotation, translation } => write!(
                f,
                "the estimated noise of the odometry, {rotation} rad and {translation} m, is the largest that is tried, as \
                 after a jump of the odometry; a robust `odometry.loss` reduces the weight of jumps, for example \
                 {{ type = \"geman_mcclure\", scale = 5.0 }}"
            ),
            Self::Extrinsics { camera, rotation, gain } => write!(
                f,
                "the boxes of the camera `{camera}` fit better if it is turned by {:.1}° (gain in log-likelihood: \
                 {gain:.0}): check `source.cameras.{camera}.body_from_camera`",
                rotation.to_degrees()
            ),
            Self::NotRobust => f.write_str(
                "data association assigns some boxes to wrong objects, and without a loss they have full weight: \
                 set `detections.loss = { type = \"cauchy\", scale = 1.0 }`",
            ),
            Self::Inactive { inactive, factors } => write!(
                f,
                "{inactive} of {factors} factors mean nothing at the estimate and take no part in its cost: \
                 their objects are not in view"
            ),
            Self::NotConverged { termination } => f.write_str(termination),
            Self::Undetermined { what } => f.write_str(what),
            Self::Implausible { what } => write!(f, "odometry: {what}"),
            Self::FewPoses { covered, poses, truth, within } => write!(
                f,
                "trajectory errors are over {covered} poses of {poses}; the truth has {truth}, and the others are more than {within} s \
                 away from these; `evaluation.max_time_difference` sets the limit"
            ),
            Self::WorseThanOdometry { alignment, odometry, estimate } => write!(
                f,
                "the trajectory is worse than the odometry that came in: ATE ({alignment}) {odometry:.5} m before, \
                 {estimate:.5} m after"
            ),
            Self::NotLocated { file } => write!(
                f,
                "it is not clear where in {} the run begins, so the map is one of its own: too few objects of it were seen, or they may \
                 be in several places; `prior_map.start` says where, if it is known",
                file.display()
            ),
            Self::JournalIncomplete(LostFrames { path, frames, reason }) => write!(
                f,
                "the journal {} is incomplete: it lacks the last {frames} frames ({reason}); the map has them, and a run that goes on \
                 from this journal would not",
                path.display()
            ),
            Self::NotHeldOut => f.write_str(
                "`evaluation.holdout` is for `manifactor run`, which knows all boxes before it begins: here none was held out",
            ),
            Self::NotEvaluated { reason } => write!(f, "the trajectory is not evaluated: {reason}"),
        }
    }
}

impl Serialize for Warning {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
