use crate::input::sequence::ObjectId;
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

/// Names that were given up for others.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Names(BTreeMap<ObjectId, ObjectId>);

impl Names {
    /// Takes note of a merge.
    pub fn merge(&mut self, Merge { from, into }: Merge) {
        let into = self.now(into);
        // a name cannot be given up for itself
        if from != into {
            self.0.insert(from, into);
        }
    }

    /// The name of what was called so once.
    pub fn now(&self, mut id: ObjectId) -> ObjectId {
        while let Some(into) = self.0.get(&id) {
            id = *into;
        }
        id
    }

    /// How many names were given up.
    pub fn given_up(&self) -> usize {
        self.0.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_that_counts_is_the_last() {
        let mut names = Names::default();
        let merge = |from, into| Merge { from: ObjectId(from), into: ObjectId(into) };
        for merge in [merge(1, 2), merge(2, 3), merge(3, 1), merge(4, 1)] {
            names.merge(merge);
        }
        assert!([1, 2, 3, 4].iter().all(|id| names.now(ObjectId(*id)) == ObjectId(3)));
        assert_eq!((names.now(ObjectId(5)), names.given_up()), (ObjectId(5), 3));
    }
}
