//! How boxes were put to objects.
use manifactor_association::{Association, Names};
use manifactor_metrics::{IdentityScores, identity};
use manifactor_online::FrameReport;
use manifactor_recording::sequence::{Detection, ObjectId};
use serde::Serialize;
use std::collections::BTreeSet;
use std::ops::Range;

/// An association of boxes with objects, scored by the names that the source gives where it gives any.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AssociationReport {
    /// What it was done by: a type of `association`.
    pub by: &'static str,
    /// Objects that turned out to be others.
    pub merged: usize,
    /// Boxes that were given to another object later, while frames came.
    pub moved: usize,
    /// With the names that boxes had when they came.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_the_time: Option<IdentityScores>,
    /// With those that they had in the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub in_the_end: Option<IdentityScores>,
}

/// The names of all boxes, in order of time: of the source, and given.
#[derive(Debug, Default)]
pub(crate) struct Naming {
    boxes: Vec<Named>,
    /// Names that are of nothing.
    forgotten: BTreeSet<ObjectId>,
}

#[derive(Debug)]
struct Named {
    /// Of the source.
    truth: Option<ObjectId>,
    /// When it came.
    then: Option<ObjectId>,
    /// Its frame, as the map counts them, and its place in that.
    place: (usize, usize),
    /// When all was looked at once more in the end, if it was.
    again: Option<Option<ObjectId>>,
}

impl Named {
    /// In the end.
    fn now(&self, names: &Names) -> Option<ObjectId> {
        let (frame, place) = self.place;
        self.again.unwrap_or_else(|| self.then.map(|name| names.of(name, frame, place)))
    }
}

impl Naming {
    /// Takes note of a frame's boxes, and of what was made of them; nothing, where the frame was left out.
    pub(crate) fn note(&mut self, detections: &[Detection], taken: Option<&FrameReport>) {
        let given = |place: usize| taken.and_then(|report| report.names.get(place).copied().flatten());
        let frame = taken.map_or(0, |report| report.frame);
        let named = |(place, detection): (usize, &Detection)| Named {
            truth: detection.object,
            then: given(place),
            place: (frame, place),
            again: None,
        };
        self.boxes.extend(detections.iter().enumerate().map(named));
        // objects that are none: their boxes have no name in the end
        self.forgotten.extend(taken.map_or(&[][..], |report| &report.forgotten));
    }

    /// Gives some boxes other names for those that they have.
    pub(crate) fn replace(
        &mut self,
        boxes: Range<usize>,
        names: &Names,
        by: impl FnOnce(&[Option<ObjectId>]) -> Vec<Option<ObjectId>>,
    ) {
        let boxes = self.boxes.get_mut(boxes).unwrap_or_default();
        let now: Vec<_> = boxes.iter().map(|named| named.now(names)).collect();
        for (named, name) in boxes.iter_mut().zip(by(&now)) {
            named.again = Some(name);
        }
    }

    /// The names of all boxes as they are now.
    pub(crate) fn now<'a>(&'a self, names: &'a Names) -> impl Iterator<Item = Option<ObjectId>> + 'a {
        self.boxes.iter().map(|named| named.now(names).filter(|name| !self.forgotten.contains(name)))
    }

    /// The report; none, where the names are those of the source.
    pub(crate) fn report(&self, by: &dyn Association, names: &Names) -> Option<AssociationReport> {
        let is_known = self.boxes.iter().any(|named| named.truth.is_some());
        let score = |put: &mut dyn Iterator<Item = Option<ObjectId>>| {
            let truth = self.boxes.iter().map(|named| named.truth);
            is_known.then(|| identity(truth.zip(put).filter_map(|(truth, put)| Some((truth?, put)))))
        };
        (!by.uses_names()).then(|| AssociationReport {
            by: by.typetag_name(),
            merged: names.given_up(),
            moved: names.moved(),
            at_the_time: score(&mut self.boxes.iter().map(|named| named.then)),
            in_the_end: score(&mut self.now(names)),
        })
    }
}
