//! Insertion and removal of variables. The number of a removed variable is reused by the next one of its
//! type, so that memory depends only on the present variables.
use super::{Model, VariableRecord, evaluation::plain};
use manifactor_graph::{Key, Variable};
use std::any::TypeId;

/// A number for a new variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NewNumber {
    pub number: u32,
    /// True if a removed variable had this number.
    pub is_reused: bool,
}

/// Numbers that are reserved for variables that are not in the model yet.
#[derive(Debug, Clone, Default)]
pub(crate) struct Reserved {
    new: u32,
    /// Number of reserved numbers of removed variables, by type.
    reused: Vec<(TypeId, usize)>,
}

impl Model {
    /// Reserves the next number for a variable of this type.
    pub(crate) fn reserve(&self, id: TypeId, reserved: &mut Reserved) -> NewNumber {
        let place = reserved.reused.iter().position(|(other, _)| *other == id).unwrap_or_else(|| {
            reserved.reused.push((id, 0));
            reserved.reused.len() - 1
        });
        let unused = self.points.position(id).and_then(|column| self.unused.get(column));
        let taken = &mut reserved.reused[place].1;
        match unused.and_then(|unused| unused.iter().rev().nth(*taken)) {
            Some(number) => {
                *taken += 1;
                NewNumber { number: *number, is_reused: true }
            }
            None => {
                reserved.new += 1;
                NewNumber { number: self.records.len() as u32 + reserved.new - 1, is_reused: false }
            }
        }
    }

    /// Inserts a variable under its reserved number. It is undetermined until its factors are checked.
    pub(crate) fn push_variable(&mut self, key: Key, value: &dyn Variable, held: u32, at: NewNumber) {
        let (id, tangent) = (value.erased().type_id(), value.erased().tangent());
        let column = self.points.position(id).unwrap_or_else(|| {
            self.trial.add(id, value.erased().new_column());
            self.unused.push(vec![]);
            self.ordinals.push(0);
            self.points.add(id, value.erased().new_column())
        });
        let plain = plain(value);
        let value = plain.as_deref().unwrap_or(value);
        self.numbers.insert(key.clone(), at.number);
        self.added += 1;
        self.ordinals[column] += 1;
        self.undetermined.set(at.number, true);
        let mut place = VariableRecord {
            key,
            rank: self.added,
            ordinal: self.ordinals[column],
            is_present: true,
            column: column as u32,
            index: self.points.column(column).len() as u32,
            tangent,
            held,
            prior_count: 0,
        };
        if at.is_reused {
            self.unused[column].pop();
            place.index = self.records[at.number as usize].index;
            self.points.column_mut(column).set(place.index as usize, value);
            self.trial.column_mut(column).set(place.index as usize, value);
            self.records[at.number as usize] = place;
            self.blocks.set_held(at.number, held);
        } else {
            self.points.column_mut(column).push(value);
            self.trial.column_mut(column).push(value);
            self.records.push(place);
            self.blocks.push(tangent.len(), held);
        }
    }

    /// Undoes the insertion of a variable. The last insertion is undone first.
    pub(crate) fn undo_push(&mut self, at: NewNumber) {
        self.added -= 1;
        self.ordinals[self.records[at.number as usize].column as usize] -= 1;
        if at.is_reused {
            self.forget(at.number);
            return;
        }
        let Some(place) = self.records.pop() else { return };
        self.numbers.remove(&place.key);
        self.undetermined.set(at.number, false);
        for columns in [&mut self.points, &mut self.trial] {
            columns.column_mut(place.column as usize).truncate(place.index as usize);
        }
        self.blocks.truncate(self.records.len());
    }

    /// Removes a variable that has no factors.
    pub(crate) fn forget(&mut self, variable: u32) {
        let place = &mut self.records[variable as usize];
        place.is_present = false;
        self.numbers.remove(&place.key);
        self.unused[place.column as usize].push(variable);
        self.undetermined.set(variable, false);
    }

    /// Returns the present variables in the order of their insertion.
    pub(crate) fn by_age(&self) -> Vec<u32> {
        let is_present = |v: &u32| self.records[*v as usize].is_present;
        let mut all: Vec<u32> = (0..self.records.len() as u32).filter(is_present).collect();
        all.sort_unstable_by_key(|v| self.records[*v as usize].rank);
        all
    }

    /// Returns the number of variables ever added.
    pub(crate) fn added(&self) -> u64 {
        self.added
    }

    /// Returns the number of variables ever added by type, in the order in which the types first appear. A
    /// type without any variable is left out: it comes from a failed update, and a loaded smoother does not
    /// have it.
    pub(crate) fn ordinals(&self) -> Vec<u64> {
        let mut columns: Vec<u32> = vec![];
        for place in &self.records {
            if !columns.contains(&place.column) {
                columns.push(place.column);
            }
        }
        columns.into_iter().map(|column| self.ordinals[column as usize]).collect()
    }

    /// Returns the numbers of removed variables. Within a type, they are in the order in which they became
    /// free.
    pub(crate) fn unused(&self) -> Vec<u32> {
        self.unused.iter().flatten().copied().collect()
    }

    /// Restores the counts and the removed variables of a saved model. Returns whether they are consistent.
    pub(crate) fn restore(&mut self, added: u64, ordinals: &[u64], unused: &[u32]) -> bool {
        if ordinals.len() != self.ordinals.len() {
            return false;
        }
        self.added = added;
        self.ordinals.copy_from_slice(ordinals);
        self.numbers.clear();
        for (v, place) in self.records.iter().enumerate().filter(|(_, place)| place.is_present) {
            self.numbers.insert(place.key.clone(), v as u32);
        }
        let mut seen = std::collections::BTreeSet::new();
        let is_gone = |v: &u32| self.records.get(*v as usize).is_some_and(|place| !place.is_present);
        if !unused.iter().all(|v| is_gone(v) && seen.insert(*v)) {
            return false;
        }
        for v in unused {
            let column = self.records[*v as usize].column as usize;
            self.unused[column].push(*v);
        }
        true
    }
}
