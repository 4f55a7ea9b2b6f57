//! How boxes were put to objects.
use crate::association::{Association, Names};
use crate::input::sequence::{Detection, ObjectId};
use crate::metrics::{IdentityScores, identity};
use serde::Serialize;

/// An association of boxes with objects, scored by the names that the source gives where it gives any.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AssociationReport {
    /// What it was done by: a type of `association`.
    pub by: &'static str,
    /// Objects that turned out to be others.
    pub merged: usize,
    /// With the names that boxes had when they came.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_the_time: Option<IdentityScores>,
    /// With those that they had in the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub in_the_end: Option<IdentityScores>,
}

/// The names of all boxes, in order of time: of the source, and given.
#[derive(Debug, Default)]
pub(crate) struct Naming(Vec<[Option<ObjectId>; 2]>);

impl Naming {
    /// Takes note of a frame's boxes, and of the names that they were given; none, where the frame was left out.
    pub(crate) fn note(&mut self, detections: &[Detection], given: &[Option<ObjectId>]) {
        let given = given.iter().copied().chain(std::iter::repeat(None));
        self.0.extend(detections.iter().zip(given).map(|(detection, given)| [detection.object, given]));
    }

    /// The names that were given, as they are now.
    pub(crate) fn now<'a>(&'a self, names: &'a Names) -> impl Iterator<Item = Option<ObjectId>> + 'a {
        self.0.iter().map(|[_, given]| given.map(|given| names.now(given)))
    }

    /// The report; none, where the names are those of the source.
    pub(crate) fn report(&self, by: &dyn Association, names: &Names) -> Option<AssociationReport> {
        let known = || self.0.iter().filter_map(|[truth, given]| Some(((*truth)?, *given)));
        let score = |put: &dyn Fn(ObjectId) -> ObjectId| {
            let scored = known().map(|(truth, given)| (truth, given.map(put)));
            (known().next().is_some()).then(|| identity(scored))
        };
        (!by.uses_names()).then(|| AssociationReport {
            by: by.typetag_name(),
            merged: names.given_up(),
            at_the_time: score(&|given| given),
            in_the_end: score(&|given| names.now(given)),
        })
    }
}
