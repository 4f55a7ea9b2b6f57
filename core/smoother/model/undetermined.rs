//! The set of undetermined variables, which are excluded from the tree until factors determine them.
use std::collections::BTreeSet;

/// The numbers of undetermined variables.
#[derive(Debug, Default)]
pub(super) struct UndeterminedVariables {
    numbers: BTreeSet<u32>,
    /// Variables whose mark has changed since the last `has_changed`.
    changed: BTreeSet<u32>,
}

impl UndeterminedVariables {
    pub(super) fn contains(&self, variable: u32) -> bool {
        self.numbers.contains(&variable)
    }

    /// Returns all undetermined variables, ascending.
    pub(super) fn iter(&self) -> impl Iterator<Item = u32> {
        self.numbers.iter().copied()
    }

    /// Marks a variable as undetermined or determined. Returns whether it was undetermined.
    pub(super) fn set(&mut self, variable: u32, is_undetermined: bool) -> bool {
        let has_changed = match is_undetermined {
            true => self.numbers.insert(variable),
            false => self.numbers.remove(&variable),
        };
        // a change and its reversal cancel
        if has_changed && !self.changed.remove(&variable) {
            self.changed.insert(variable);
        }
        is_undetermined != has_changed
    }

    /// Returns whether the set has changed since the last call.
    pub(super) fn has_changed(&mut self) -> bool {
        !std::mem::take(&mut self.changed).is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_back_is_no_change() {
        let mut undetermined = UndeterminedVariables::default();
        assert!(!undetermined.set(3, true) && undetermined.has_changed() && !undetermined.has_changed());
        assert!(undetermined.set(3, false) && !undetermined.contains(3) && !undetermined.set(3, true));
        assert!(undetermined.set(3, true) && !undetermined.set(4, false));
        assert!(!undetermined.has_changed() && undetermined.iter().eq([3]));
    }
}
