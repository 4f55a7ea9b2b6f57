//! Parked variables: undetermined variables, which are excluded from the tree until factors determine them.
use std::collections::BTreeSet;

/// The numbers of parked variables.
#[derive(Debug, Default)]
pub(super) struct Parked {
    numbers: BTreeSet<u32>,
    /// Variables that were parked or unparked since the last `has_changed`.
    changed: BTreeSet<u32>,
}

impl Parked {
    pub(super) fn contains(&self, variable: u32) -> bool {
        self.numbers.contains(&variable)
    }

    /// Returns all parked variables, ascending.
    pub(super) fn iter(&self) -> impl Iterator<Item = u32> {
        self.numbers.iter().copied()
    }

    /// Parks or unparks a variable. Returns whether it was parked.
    pub(super) fn set(&mut self, variable: u32, is_parked: bool) -> bool {
        let has_changed = match is_parked {
            true => self.numbers.insert(variable),
            false => self.numbers.remove(&variable),
        };
        // a change and its reversal cancel
        if has_changed && !self.changed.remove(&variable) {
            self.changed.insert(variable);
        }
        is_parked != has_changed
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
        let mut parked = Parked::default();
        assert!(!parked.set(3, true) && parked.has_changed() && !parked.has_changed());
        assert!(parked.set(3, false) && !parked.contains(3) && !parked.set(3, true));
        assert!(parked.set(3, true) && !parked.set(4, false));
        assert!(!parked.has_changed() && parked.iter().eq([3]));
    }
}
