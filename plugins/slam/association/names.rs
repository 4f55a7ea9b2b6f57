use manifactor_recording::sequence::{Detection, ObjectId};
use serde::Serialize;
use std::collections::BTreeMap;

/// Two objects that become one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Merge {
    /// The id that is given up.
    pub from: ObjectId,
    /// The id that stays.
    pub into: ObjectId,
}

/// A detection that moves to a different object.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Move {
    /// Index of the frame among the frames in the map.
    pub frame: usize,
    /// Index among the detections of its frame.
    #[serde(rename = "box")]
    pub place: usize,
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
pub struct Names {
    /// Remaining id, by the id that was given up.
    merged: BTreeMap<ObjectId, ObjectId>,
    /// Object of a moved detection, by frame and index in the frame.
    moved: BTreeMap<(usize, usize), ObjectId>,
}

impl Names {
    /// Records a merge.
    pub fn merge(&mut self, Merge { from, into }: Merge) {
        let into = self.now(into);
        // a merge of an id with itself changes nothing
        if from != into {
            self.merged.insert(from, into);
            let names = self.merged.values_mut().chain(self.moved.values_mut());
            names.filter(|name| **name == from).for_each(|name| *name = into);
        }
    }

    /// Records a detection that moves to a different object.
    pub fn put(&mut self, Move { frame, place, into, .. }: &Move) {
        self.moved.insert((*frame, *place), self.now(*into));
    }

    /// Returns the current id of an object that had this id once.
    pub fn now(&self, id: ObjectId) -> ObjectId {
        self.merged.get(&id).copied().unwrap_or(id)
    }

    /// Returns the current object of a detection that was first assigned to `id`, by its frame and its index
    /// there.
    pub fn of(&self, id: ObjectId, frame: usize, place: usize) -> ObjectId {
        self.moved.get(&(frame, place)).copied().unwrap_or_else(|| self.now(id))
    }

    /// Returns the number of ids that were given up.
    pub fn given_up(&self) -> usize {
        self.merged.len()
    }

    /// Returns the number of detections that moved to a different object.
    pub fn moved(&self) -> usize {
        self.moved.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_quadric::BoundingBox;
    use manifactor_recording::sequence::ClassScores;

    fn merge(from: u32, into: u32) -> Merge {
        Merge { from: ObjectId(from), into: ObjectId(into) }
    }

    #[test]
    fn the_name_that_counts_is_the_last() {
        let mut names = Names::default();
        for merge in [merge(1, 2), merge(2, 3), merge(3, 1), merge(4, 1)] {
            names.merge(merge);
        }
        assert!([1, 2, 3, 4].iter().all(|id| names.now(ObjectId(*id)) == ObjectId(3)));
        assert_eq!((names.now(ObjectId(5)), names.given_up()), (ObjectId(5), 3));
    }

    #[test]
    fn a_box_that_was_moved_goes_with_its_new_object() {
        let bounding_box = BoundingBox { xmin: 0.0, ymin: 0.0, xmax: 1.0, ymax: 1.0 };
        let scores = ClassScores::default();
        let detection = Detection {
            frame: 4,
            object: None,
            scores,
            bounding_box,
            quantities: manifactor_recording::measurement::Quantities::NONE,
        };
        let put = |from, into| {
            let (from, into) = (ObjectId(from), ObjectId(into));
            Move { frame: 4, place: 1, from, into, detection: detection.clone() }
        };
        let mut names = Names::default();
        names.merge(merge(1, 2));
        names.put(&put(2, 3));
        let of = |names: &Names, place| names.of(ObjectId(1), 4, place).0;
        assert_eq!((of(&names, 0), of(&names, 1), names.moved()), (2, 3, 1));
        // merged with its old object, the detection is back there, and may move again
        names.merge(merge(3, 2));
        assert_eq!(of(&names, 1), 2);
        names.put(&put(2, 5));
        assert_eq!((of(&names, 0), of(&names, 1)), (2, 5));
    }
}
