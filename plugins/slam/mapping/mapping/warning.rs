use manifactor_config::{nearest, quoted_list};
use manifactor_recording::journal::LostFrames;
use serde::{Serialize, Serializer};
use std::fmt;
use std::path::PathBuf;

/// What a user should know, though nothing failed.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// A class of a semantic rule that no object has.
    ClassWithoutObjects {
        /// The class, as the rule has it.
        class: String,
        /// The rule's factor.
        factor: String,
        /// The classes that objects have.
        seen: Vec<String>,
    },
    /// A sign of other units, or of another order of numbers.
    Implausible {
        /// Which.
        what: String,
    },
    /// Detections that the source has and that are not used.
    Unused {
        /// How many of what, why, and the remedy.
        what: String,
    },
    /// The same, and more of them than is expected: the map is not one of the whole recording.
    TooManyUnused {
        /// How many of what, why, and the remedy.
        what: String,
        /// The share that is expected, from 0 to 1.
        allowed: f64,
    },
    /// Objects that were detected and are not mapped, for one reason.
    NotMapped {
        /// The reason, how many objects it holds for, and their keys.
        what: String,
        /// The setting to change.
        remedy: &'static str,
    },
    /// Objects that no box limits in some direction.
    RunAway {
        /// Their keys and semi-axes.
        objects: Vec<String>,
    },
    /// A map without objects.
    NoObjects {
        /// Objects that were detected.
        detected: usize,
    },
    /// Boxes that may be put to wrong objects, and would count in full.
    NotRobust,
    /// Factors that take no part at the end.
    Inactive {
        /// How many.
        inactive: usize,
        /// Of how many.
        factors: usize,
    },
    /// A solve that ended without a minimum.
    NotConverged {
        /// How it ended.
        termination: String,
    },
    /// Directions that nothing but damping holds.
    Undetermined {
        /// Which.
        what: String,
    },
    /// Errors over less than half of the poses.
    FewPoses {
        /// Poses with a true one at their time.
        covered: usize,
        /// Poses of the estimate.
        poses: usize,
        /// Poses of the truth.
        truth: usize,
        /// Largest difference in time, in seconds.
        within: f64,
    },
    /// An error that grew.
    WorseThanOdometry {
        /// The alignment under which it did.
        alignment: String,
        /// Of the odometry, in metres.
        odometry: f64,
        /// Of the estimate, in metres.
        estimate: f64,
    },
    /// A run that is nowhere in the map that it was to begin with.
    NotLocated {
        /// The file of that map.
        file: PathBuf,
    },
    /// A journal that does not have all frames of its run.
    JournalIncomplete(LostFrames),
    /// Boxes that were to be held out, and took part.
    NotHeldOut,
    /// An estimate without the ground truth that it should be compared with.
    NotEvaluated {
        /// Why.
        reason: String,
    },
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
            Self::Unused { what } => f.write_str(what),
            Self::TooManyUnused { what, allowed } => {
                write!(f, "{what}; `source.max_without_pose` expects a larger share than {allowed}")
            }
            Self::NotMapped { what, remedy } => write!(f, "not mapped: {what}; {remedy}"),
            Self::NoObjects { detected: 0 } => f.write_str(
                "no box says which object it shows; `association = { type = \"likelihood\" }` finds out",
            ),
            Self::NoObjects { detected } => {
                write!(f, "none of {detected} detected objects is mapped; see why in objects.json")
            }
            Self::RunAway { objects } => write!(
                f,
                "boxes do not limit the shape of {}: {}; the factor `shape_prior` keeps the semi-axes of an object alike",
                if objects.len() == 1 { "an object" } else { "objects" },
                objects.join(", ")
            ),
            Self::NotRobust => f.write_str(
                "boxes without names are put to wrong objects now and then, and count in full; \
                 `detections.loss = { type = \"cauchy\", scale = 1.0 }` takes weight from them",
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
