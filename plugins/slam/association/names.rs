use manifactor_recording::sequence::{Detection, ObjectId};
use serde::Serialize;
use std::collections::BTreeMap;

/// Two objects that become one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct ObjectMerge {
    /// The id that is given up.
    pub from: ObjectId,
    /// The id that stays.
    pub into: ObjectId,
}

/// A detection that moves to a different object.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DetectionMove {
    /// Index of the frame among the frames in the map.
    pub frame: usize,
    /// Index among the detections of its frame.
    #[serde(rename = "box")]
    pub index: usize,
    /// The object before.
    pub from: ObjectId,
    /// The object now.
    pub into: ObjectId,
    /// The detection itself.
    #[serde(skip)]
    pub detection: Detection,
}

/// Current ids of detections whose object changed after the first assignment.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ObjectIdChanges {
    /// Remaining id, by the id that was given up.
    merged: BTreeMap<ObjectId, ObjectId>,
    /// Object of a moved detection, by frame and index in the frame.
    moved: BTreeMap<(usize, usize), ObjectId>,
}

impl ObjectIdChanges {
    /// Records a merge.
    pub fn record_merge(&mut self, ObjectMerge { from, into }: ObjectMerge) {
        let into = self.current_id(into);
        // a merge of an id with itself changes nothing
        if from != into {
            self.merged.insert(from, into);
            let names = self.merged.values_mut().chain(self.moved.values_mut());
            names.filter(|name| **name == from).for_each(|name| *name = into);
        }
    }

    /// Records a detection that moves to a different object.
    pub fn record_move(&mut self, DetectionMove { frame, index: place, into, .. }: &DetectionMove) {
        self.moved.insert((*frame, *place), self.current_id(*into));
    }

    /// Returns the current id of an object that had this id once.
    pub fn current_id(&self, id: ObjectId) -> ObjectId {
        self.merged.get(&id).copied().unwrap_or(id)
    }

    /// Returns the current object of a detection that was first assigned to `id`, by its frame and its index
    /// there.
    pub fn object_of_detection(&self, id: ObjectId, frame: usize, place: usize) -> ObjectId {
        self.moved.get(&(frame, place)).copied().unwrap_or_else(|| self.current_id(id))
    }

    /// Returns the number of ids that were given up.
    pub fn given_up_ids(&self) -> usize {
        self.merged.len()
    }

    /// Returns the number of detections that moved to a different object.
    pub fn moved_detections(&self) -> usize {
        self.moved.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_quadric::{BoundingBox, Camera};
    use manifactor_recording::camera::Cameras;
    use manifactor_recording::sequence::ClassScores;

    fn merge(from: u32, into: u32) -> ObjectMerge {
        ObjectMerge { from: ObjectId(from), into: ObjectId(into) }
    }

    #[test]
    fn the_name_that_counts_is_the_last() {
        let mut names = ObjectIdChanges::default();
        for merge in [merge(1, 2), merge(2, 3), merge(3, 1), merge(4, 1)] {
            names.record_merge(merge);
        }
        assert!([1, 2, 3, 4].iter().all(|id| names.current_id(ObjectId(*id)) == ObjectId(3)));
        assert_eq!((names.current_id(ObjectId(5)), names.given_up_ids()), (ObjectId(5), 3));
    }

    #[test]
    fn a_box_that_was_moved_goes_with_its_new_object() {
        let bounding_box = BoundingBox { xmin: 0.0, ymin: 0.0, xmax: 1.0, ymax: 1.0 };
        let scores = ClassScores::default();
        let model = Camera::new([500.0, 500.0, 320.0, 240.0], 640, 480).unwrap();
        let camera = Cameras::new(model).first().clone();
        let detection = Detection { frame: 4, ..Detection::new(camera, bounding_box, scores) };
        let put = |from, into| {
            let (from, into) = (ObjectId(from), ObjectId(into));
            DetectionMove { frame: 4, index: 1, from, into, detection: detection.clone() }
        };
        let mut names = ObjectIdChanges::default();
        names.record_merge(merge(1, 2));
        names.record_move(&put(2, 3));
        let of = |names: &ObjectIdChanges, place| names.object_of_detection(ObjectId(1), 4, place).0;
        assert_eq!((of(&names, 0), of(&names, 1), names.moved_detections()), (2, 3, 1));
        // merged with its old object, the detection is back there, and may move again
        names.record_merge(merge(3, 2));
        assert_eq!(of(&names, 1), 2);
        names.record_move(&put(2, 5));
        assert_eq!((of(&names, 0), of(&names, 1)), (2, 5));
    }
}
