//! Report of data association.
use manifactor_association::{Association, ObjectIdChanges};
use manifactor_metrics::{IdentityScores, identity, matched_objects};
use manifactor_online::FrameReport;
use manifactor_recording::sequence::{Detection, ObjectId, Sequence, UnusedInput};
use serde::Serialize;
use std::collections::BTreeSet;
use std::ops::Range;

/// A data association, scored with the objects of the source if it has them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AssociationReport {
    /// Type of the `association`.
    pub by: &'static str,
    /// Number of objects that were merged into others.
    pub merged: usize,
    /// Number of boxes that were later moved to a different object while frames arrived.
    pub moved: usize,
    /// Scores of the objects that boxes had when they arrived.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_the_time: Option<IdentityScores>,
    /// Scores of the objects that boxes have at the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub in_the_end: Option<IdentityScores>,
}

/// Objects of all boxes in order of time: from the source, and from data association.
#[derive(Debug, Default)]
pub(crate) struct AssociationHistory {
    boxes: Vec<BoxAssociation>,
    /// Dropped object candidates, whose boxes have no object.
    forgotten: BTreeSet<ObjectId>,
}

#[derive(Debug)]
struct BoxAssociation {
    /// Object of the source.
    truth: Option<ObjectId>,
    /// Object when the box arrived.
    then: Option<ObjectId>,
    /// Frame in the map, and index in the frame.
    place: (usize, usize),
    /// Object after a final association of all frames, if there was one.
    again: Option<Option<ObjectId>>,
}

impl BoxAssociation {
    /// Returns the object at the end.
    fn current_object(&self, names: &ObjectIdChanges) -> Option<ObjectId> {
        let (frame, place) = self.place;
        self.again.unwrap_or_else(|| self.then.map(|name| names.object_of_detection(name, frame, place)))
    }
}

impl AssociationHistory {
    /// Records a frame's boxes and their objects; the boxes of a skipped frame have no object.
    pub(crate) fn record_frame(&mut self, detections: &[Detection], taken: Option<&FrameReport>) {
        let given = |place: usize| taken.and_then(|report| report.box_objects.get(place).copied().flatten());
        let frame = taken.map_or(0, |report| report.frame);
        let named = |(place, detection): (usize, &Detection)| BoxAssociation {
            truth: detection.object,
            then: given(place),
            place: (frame, place),
            again: None,
        };
        self.boxes.extend(detections.iter().enumerate().map(named));
        // boxes of dropped candidates have no object in the end
        self.forgotten.extend(taken.map_or(&[][..], |report| &report.forgotten));
    }

    /// Returns the history of all frames: the boxes of skipped ones have no object. Each frame has its boxes, and
    /// whether it was recorded.
    pub(crate) fn with_skipped(self, frames: impl Iterator<Item = (Vec<Detection>, bool)>) -> Self {
        let mut all = Self { boxes: vec![], forgotten: self.forgotten };
        let mut recorded = self.boxes.into_iter();
        for (detections, is_recorded) in frames {
            match is_recorded {
                true => all.boxes.extend(recorded.by_ref().take(detections.len())),
                false => all.record_frame(&detections, None),
            }
        }
        all
    }

    /// Assigns new objects to some boxes, computed from their current objects.
    pub(crate) fn replace_objects(
        &mut self,
        boxes: Range<usize>,
        names: &ObjectIdChanges,
        by: impl FnOnce(&[Option<ObjectId>]) -> Vec<Option<ObjectId>>,
    ) {
        let boxes = self.boxes.get_mut(boxes).unwrap_or_default();
        let now: Vec<_> = boxes.iter().map(|named| named.current_object(names)).collect();
        for (named, name) in boxes.iter_mut().zip(by(&now)) {
            named.again = Some(name);
        }
    }

    /// Returns the current objects of all boxes.
    pub(crate) fn current_objects<'a>(
        &'a self,
        names: &'a ObjectIdChanges,
    ) -> impl Iterator<Item = Option<ObjectId>> + 'a {
        self.boxes
            .iter()
            .map(|named| named.current_object(names).filter(|name| !self.forgotten.contains(name)))
    }

    /// Gives each true object of the sequence the id of the estimated object with its boxes. Association and source number
    /// objects independently, so true and estimated objects are matched one to one, with as many shared boxes as possible.
    /// A true object without a partner gets an unused id. If the source names no objects, the sequence gets a note.
    pub(crate) fn match_true_objects(&self, sequence: &mut Sequence, names: &ObjectIdChanges) {
        let Some(truth) = &mut sequence.ground_truth else { return };
        if truth.objects.is_empty() {
            return;
        }
        let pairs = self.boxes.iter().zip(self.current_objects(names));
        let partners = matched_objects(pairs.filter_map(|(named, now)| Some((named.truth?, now?))));
        let is_known = self.boxes.iter().any(|named| named.truth.is_some());
        if !is_known && !self.boxes.is_empty() {
            sequence.unused.push(UnusedInput::Recording(format!(
                "{} true objects are not compared with the map, because the boxes do not name them; give the boxes the \
                 ids of the true objects as object_key, which data association does not read",
                truth.objects.len()
            )));
        }
        // the ids of a map or of a source are numbered from below
        let mut free = (0..=u32::MAX).rev().map(ObjectId);
        for object in &mut truth.objects {
            let partner = partners.get(&object.id).copied().or_else(|| free.next());
            object.id = partner.unwrap_or(object.id);
        }
    }

    /// Returns the report; `None` if the objects of the source are used.
    pub(crate) fn report(&self, by: &dyn Association, names: &ObjectIdChanges) -> Option<AssociationReport> {
        let is_known = self.boxes.iter().any(|named| named.truth.is_some());
        let score = |put: &mut dyn Iterator<Item = Option<ObjectId>>| {
            let truth = self.boxes.iter().map(|named| named.truth);
            is_known.then(|| identity(truth.zip(put).filter_map(|(truth, put)| Some((truth?, put)))))
        };
        (!by.uses_source_ids()).then(|| AssociationReport {
            by: by.typetag_name(),
            merged: names.given_up_ids(),
            moved: names.moved_detections(),
            at_the_time: score(&mut self.boxes.iter().map(|named| named.then)),
            in_the_end: score(&mut self.current_objects(names)),
        })
    }
}
