//! Data association: deciding which object a detection shows if the source does not name it. A run selects
//! the method by name in `association`.
//!
//! An [`Associator`] assigns an object to each detection of a frame, and learns from the frame once it is in
//! the map. Later evidence may correct an assignment: two objects are [merged](ObjectMerge), or detections
//! [move](DetectionMove) to a different object. [`ObjectIdChanges`] maps each original id to the current one.
mod assignment;
mod given;
mod likelihood;
mod names;

use manifactor_geometry::Se3;
use manifactor_quadric::DualQuadric;
use manifactor_recording::class::ClassAliases;
use manifactor_recording::prior_map::PriorObject;
use manifactor_recording::sequence::{Detection, ObjectId};
use std::fmt::Debug;
use std::sync::Arc;

pub use assignment::best_assignment;
pub use given::GivenAssociation;
pub use likelihood::LikelihoodAssociation;
pub use names::{DetectionMove, ObjectIdChanges, ObjectMerge};

/// A method of data association.
#[typetag::serialize(tag = "type")]
pub trait Association: Debug + Send + Sync {
    /// Creates the associator. `known` are the objects of a prior map with trusted covariances; empty without
    /// a prior map.
    fn create_associator(&self, aliases: &ClassAliases, known: &[Arc<PriorObject>]) -> Box<dyn Associator>;

    /// Returns whether the method takes the object ids of the source. If not, these ids can serve to score
    /// it.
    fn uses_source_ids(&self) -> bool {
        false
    }
}

manifactor_graph::kind!(dyn Association, "association");

/// Associates detections with objects, frame by frame.
pub trait Associator: Debug + Send {
    /// Returns the object of each detection of a frame: a known one, a new one, or `None`. The last pose of
    /// the map is the predicted pose of this frame.
    fn associate(&self, image: &FrameDetections<'_>, map: &dyn MapEstimate) -> Vec<Option<ObjectId>>;

    /// Assigns the detections of an earlier frame again, with all later frames known. `names` are the objects
    /// assigned so far.
    fn reassociate(
        &self,
        _: &FrameDetections<'_>,
        names: &[Option<ObjectId>],
        _: &dyn MapEstimate,
    ) -> Vec<Option<ObjectId>> {
        names.to_vec()
    }

    /// Learns from the detections of a frame that is in the map now, under these object ids.
    fn learn_from_frame(
        &mut self,
        image: &FrameDetections<'_>,
        names: &[Option<ObjectId>],
        map: &dyn MapEstimate,
    ) -> Corrections;

    /// Learns from all frames together, after the last one.
    fn finish_association(&mut self, _: &dyn MapEstimate) -> Corrections {
        Corrections::default()
    }
}

/// Corrections to earlier frames that follow from a frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Corrections {
    /// Pairs of objects that are merged.
    pub merged: Vec<ObjectMerge>,
    /// Detections that move to a different object. Applied before the merges.
    pub moved: Vec<DetectionMove>,
    /// Objects with too few detections; the associator no longer tracks them.
    pub forgotten: Vec<ObjectId>,
}

impl Corrections {
    /// Returns whether no detection changes its object.
    pub fn changes_no_object(&self) -> bool {
        self.moved.is_empty() && self.merged.is_empty()
    }
}

/// The data of a frame that an associator uses.
#[derive(Debug, Clone, Copy)]
pub struct FrameDetections<'a> {
    /// Index of the frame among the frames in the map.
    pub frame: usize,
    /// Unit: seconds.
    pub timestamp: f64,
    /// Detections of the frame.
    pub detections: &'a [Detection],
}

/// The current estimate of poses and objects.
pub trait MapEstimate {
    /// Returns the pose of the first camera of a frame, or `None` if it is no longer in the map.
    fn pose(&self, frame: usize) -> Option<Se3>;

    /// Returns an object, or `None` if it is not in the map.
    fn object(&self, id: ObjectId) -> Option<DualQuadric>;
}
