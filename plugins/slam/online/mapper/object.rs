//! State of an object, from its first box to the map and beyond.
use manifactor_geometry::Se3;
use manifactor_mapping::mapping::measurements::{ObjectBox, ObjectMeasurements};
use manifactor_quadric::DualQuadric;
use manifactor_smoother::FactorId;
use nalgebra::Vector3;

/// State of an object.
#[derive(Debug, Clone)]
pub(super) enum ObjectState {
    /// A tentative track: the object cannot be initialized yet.
    Tentative(ViewingDirections),
    /// The object is in the map.
    Mapped(MappedState),
    /// The object was removed from the map because its boxes belong to several objects.
    Removed,
}

/// Viewing directions of an object.
#[derive(Debug, Clone)]
pub(super) struct ViewingDirections {
    /// Lines of sight in the map frame, from the poses at the time.
    lines: Vec<Vector3<f64>>,
    /// Smallest cosine between two of them.
    cosine: f64,
    /// Number of boxes at the last failed initialization.
    boxes_at_last_attempt: usize,
}

/// An object in the map.
#[derive(Debug, Clone)]
pub(super) struct MappedState {
    /// Initial value.
    pub start: DualQuadric,
    /// Factors of its boxes, each with its frame.
    pub boxes: Vec<(usize, FactorId)>,
    /// Class at the last application of the semantic rules.
    pub class: Option<String>,
}

/// After a failed initialization, the number of boxes has to grow by this factor before the next attempt.
const RETRY_BOX_GROWTH: f64 = 1.2;

impl Default for ObjectState {
    fn default() -> Self {
        Self::Tentative(ViewingDirections::new())
    }
}

impl ObjectState {
    /// Returns the state of an object of the prior map.
    pub(super) fn of_prior_object(measured: &ObjectMeasurements) -> Option<Self> {
        let start = measured.prior.as_ref()?.quadric;
        let class = measured.class_name().map(str::to_owned);
        Some(Self::Mapped(MappedState { start, boxes: vec![], class }))
    }

    pub(super) fn is_mapped(&self) -> bool {
        matches!(self, Self::Mapped(_))
    }

    pub(super) fn initial_value(&self) -> Option<DualQuadric> {
        match self {
            Self::Mapped(mapped) => Some(mapped.start),
            _ => None,
        }
    }
}

impl ViewingDirections {
    /// Returns a set without views.
    pub(super) fn new() -> Self {
        Self { lines: vec![], cosine: 1.0, boxes_at_last_attempt: 0 }
    }

    /// Adds the line of sight of a box, from the pose of its frame.
    pub(super) fn add(&mut self, view: &ObjectBox, pose: &Se3) {
        let ray = view.camera.model.ray(view.bounding_box.centre()).normalize();
        let line = view.camera_pose(pose).rotation.act(&ray);
        self.cosine = self.lines.iter().map(|other| other.dot(&line)).fold(self.cosine, f64::min);
        self.lines.push(line);
    }

    /// Returns whether an initialization is worth an attempt: the parallax is large enough, and there are
    /// enough new boxes since the last attempt.
    pub(super) fn suffice_for_initialization(&self, measured: &ObjectMeasurements, degrees: f64) -> bool {
        let angle = self.cosine.clamp(-1.0, 1.0).acos().to_degrees();
        angle >= degrees
            && measured.views.len() as f64 >= RETRY_BOX_GROWTH * self.boxes_at_last_attempt as f64
    }

    /// Records a failed initialization with this number of boxes.
    pub(super) fn record_failed_attempt(&mut self, boxes: usize) {
        self.boxes_at_last_attempt = boxes;
    }
}
