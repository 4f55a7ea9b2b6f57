use manifactor_recording::sequence::{Detection, ObjectId};
use serde::Serialize;
use std::collections::BTreeMap;

/// Two objects that turn out to be one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Merge {
    /// The name that is given up.
    pub from: ObjectId,
    /// The one that stays.
    pub into: ObjectId,
}

/// A box that turns out to show another object than was thought.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Move {
    /// Counts the frames that are in the map.
    pub frame: usize,
    /// Its place among the boxes of its frame.
    #[serde(rename = "box")]
    pub place: usize,
    /// What it was thought to show.
    pub from: ObjectId,
    /// What it shows.
    pub into: ObjectId,
    /// The box.
    #[serde(skip)]
    pub detection: Detection,
}

/// What boxes are called that were called otherwise when they came.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Names {
    /// By a name that was given up, the one that stays.
    merged: BTreeMap<ObjectId, ObjectId>,
    /// By frame and place in it, the name of a box that was moved.
    moved: BTreeMap<(usize, usize), ObjectId>,
}

impl Names {
    /// Takes note of a merge.
    pub fn merge(&mut self, Merge { from, into }: Merge) {
        let into = self.now(into);
        // a name cannot be given up for itself
        if from != into {
            self.merged.insert(from, into);
            let names = self.merged.values_mut().chain(self.moved.values_mut());
            names.filter(|name| **name == from).for_each(|name| *name = into);
        }
    }

    /// Takes note of a box that shows another object.
    pub fn put(&mut self, Move { frame, place, into, .. }: &Move) {
        self.moved.insert((*frame, *place), self.now(*into));
    }

    /// The name of what was called so once.
    pub fn now(&self, id: ObjectId) -> ObjectId {
        self.merged.get(&id).copied().unwrap_or(id)
    }

    /// The name of a box that was called so when it came, by its frame and its place in that.
    pub fn of(&self, id: ObjectId, frame: usize, place: usize) -> ObjectId {
        self.moved.get(&(frame, place)).copied().unwrap_or_else(|| self.now(id))
    }

    /// How many names were given up.
    pub fn given_up(&self) -> usize {
        self.merged.len()
    }

    /// How many boxes show another object than was thought at first.
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
        // what is united with the old one again is where it was, and may be moved again
        names.merge(merge(3, 2));
        assert_eq!(of(&names, 1), 2);
        names.put(&put(2, 5));
        assert_eq!((of(&names, 0), of(&names, 1)), (2, 5));
    }
}
