//! An object from its first box to its birth, and after.
use manifactor_geometry::Se3;
use manifactor_mapping::mapping::measurements::{Measured, ObjectBox};
use manifactor_quadric::{Camera, DualQuadric};
use manifactor_smoother::FactorId;
use nalgebra::Vector3;

/// What is known of an object besides its boxes.
#[derive(Debug, Clone)]
pub(super) enum Tracked {
    /// It cannot be placed yet.
    Waiting(Sights),
    /// It is in the map.
    Mapped(Mapped),
    /// It was in the map, and its boxes turned out to be those of several things.
    Withdrawn,
}

/// From where an object was seen.
#[derive(Debug, Clone)]
pub(super) struct Sights {
    /// Lines of sight, in the map's frame, by the poses at the time.
    lines: Vec<Vector3<f64>>,
    /// The smallest cosine between two of them.
    cosine: f64,
    /// Boxes that it had when it was last tried in vain.
    tried: usize,
}

/// An object in the map.
#[derive(Debug, Clone)]
pub(super) struct Mapped {
    /// Where it began.
    pub start: DualQuadric,
    /// The factors of its boxes, each with its frame.
    pub boxes: Vec<(usize, FactorId)>,
    /// Its class when rules were last asked.
    pub class: Option<String>,
}

/// After a try in vain, the number of boxes grows by this factor before the next.
const MORE: f64 = 1.2;

impl Default for Tracked {
    fn default() -> Self {
        Self::Waiting(Sights::new())
    }
}

impl Tracked {
    /// One that an earlier map has.
    pub(super) fn known(measured: &Measured) -> Option<Self> {
        let start = measured.prior.as_ref()?.quadric;
        let class = measured.class_name().map(str::to_owned);
        Some(Self::Mapped(Mapped { start, boxes: vec![], class }))
    }

    pub(super) fn is_mapped(&self) -> bool {
        matches!(self, Self::Mapped(_))
    }

    pub(super) fn born_as(&self) -> Option<DualQuadric> {
        match self {
            Self::Mapped(mapped) => Some(mapped.start),
            _ => None,
        }
    }
}

impl Sights {
    /// None yet.
    pub(super) fn new() -> Self {
        Self { lines: vec![], cosine: 1.0, tried: 0 }
    }

    /// Adds the line of sight of a box.
    pub(super) fn add(&mut self, view: &ObjectBox, pose: &Se3, camera: &Camera) {
        let ray = camera.ray(view.bounding_box.centre()).normalize();
        let line = pose.rotation.act(&ray);
        self.cosine = self.lines.iter().map(|other| other.dot(&line)).fold(self.cosine, f64::min);
        self.lines.push(line);
    }

    /// Returns whether it is worth while to try and place the object: it is seen under this angle, and there is more than at the last
    /// try.
    pub(super) fn are_enough(&self, measured: &Measured, degrees: f64) -> bool {
        let angle = self.cosine.clamp(-1.0, 1.0).acos().to_degrees();
        angle >= degrees && measured.views.len() as f64 >= MORE * self.tried as f64
    }

    /// Notes a try in vain, with so many boxes.
    pub(super) fn note_try(&mut self, boxes: usize) {
        self.tried = boxes;
    }
}
