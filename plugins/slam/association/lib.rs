//! Which object a box shows, where the source does not say: chosen by name in a run's `association`.
//!
//! An [`Associator`] names the boxes of a frame, and learns from it once the frame is in the map. What it names wrongly at first
//! it may mend later: two objects that turn out to be one are [merged](Merge), boxes that turn out to show another object [move](Move)
//! to it, and [`Names`] has the name that counts.
mod assignment;
mod given;
mod likelihood;
mod names;

use manifactor_geometry::Se3;
use manifactor_quadric::{Camera, DualQuadric};
use manifactor_recording::class::Aliases;
use manifactor_recording::prior_map::PriorObject;
use manifactor_recording::sequence::{Detection, ObjectId};
use std::fmt::Debug;
use std::sync::Arc;

pub use assignment::best_assignment;
pub use given::Given;
pub use likelihood::Likelihood;
pub use names::{Merge, Move, Names};

/// A way to associate boxes with objects.
#[typetag::serialize(tag = "type")]
pub trait Association: Debug + Send + Sync {
    /// Begins, with the objects of an earlier map, where there is one, known as well as they are trusted.
    fn begin(&self, camera: Camera, aliases: &Aliases, known: &[Arc<PriorObject>]) -> Box<dyn Associator>;

    /// Returns whether it takes the names that the source gives. Where it does not, they may serve to score it.
    fn uses_names(&self) -> bool {
        false
    }
}

manifactor_graph::kind!(dyn Association, "association");

/// Associates boxes with objects, frame by frame.
pub trait Associator: Debug + Send {
    /// Names the object of each box of a frame: one that is known, a new one, or none. The last pose of the map is that of the frame,
    /// as it is predicted.
    fn associate(&self, image: &Image<'_>, map: &dyn Map) -> Vec<Option<ObjectId>>;

    /// Names the boxes of a frame again that had these names, when all other frames have been seen.
    fn reconsider(&self, _: &Image<'_>, names: &[Option<ObjectId>], _: &dyn Map) -> Vec<Option<ObjectId>> {
        names.to_vec()
    }

    /// Learns from the boxes of a frame, which is in the map now, under these names.
    fn learn(&mut self, image: &Image<'_>, names: &[Option<ObjectId>], map: &dyn Map) -> Learned;

    /// Learns from all frames together when no other comes.
    fn settle(&mut self, _: &dyn Map) -> Learned {
        Learned::default()
    }
}

/// What a frame has taught of earlier ones.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Learned {
    /// Objects that turn out to be one.
    pub merged: Vec<Merge>,
    /// Boxes that turn out to show another object, before any are merged.
    pub moved: Vec<Move>,
    /// Objects that were seen too rarely to be any, and are not looked for any more.
    pub forgotten: Vec<ObjectId>,
}

impl Learned {
    /// Returns whether no box has another object for it.
    pub fn is_nothing(&self) -> bool {
        self.moved.is_empty() && self.merged.is_empty()
    }
}

/// What an associator sees of a frame.
#[derive(Debug, Clone, Copy)]
pub struct Image<'a> {
    /// Counts the frames that are in the map.
    pub frame: usize,
    /// Seconds.
    pub timestamp: f64,
    /// The boxes in it.
    pub detections: &'a [Detection],
}

/// What has been estimated so far.
pub trait Map {
    /// The pose of the camera in a frame, where it is still known.
    fn pose(&self, frame: usize) -> Option<Se3>;

    /// An object, where it is mapped.
    fn object(&self, id: ObjectId) -> Option<DualQuadric>;
}
