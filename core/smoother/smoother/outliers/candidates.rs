//! Candidates for outliers, and their limits. The model stores which of them are rejected.
use crate::model::Model;
use crate::saved::SavedCandidate;
use std::collections::{BTreeMap, BTreeSet};

/// The limits of a factor that may be an outlier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::smoother) struct Candidate {
    /// Upper limit of ‖r‖² for an inlier: the χ² quantile for its rows.
    pub(in crate::smoother) bound: f64,
    /// Largest information gain of this factor without confirmation by a second one. Unit: nats.
    pub(in crate::smoother) gain: f64,
    /// The update that rejected it last.
    pub(in crate::smoother) since: usize,
}

/// All factors that may be outliers.
#[derive(Debug, Default)]
pub(in crate::smoother) struct OutlierCandidates {
    candidates: BTreeMap<u32, Candidate>,
    /// Variables that have moved since the last test.
    moved: BTreeSet<u32>,
}

impl OutlierCandidates {
    pub(in crate::smoother) fn is_empty(&self) -> bool {
        self.candidates.is_empty()
    }

    pub(in crate::smoother) fn len(&self) -> usize {
        self.candidates.len()
    }

    pub(in crate::smoother) fn get(&self, factor: u32) -> Option<Candidate> {
        self.candidates.get(&factor).copied()
    }

    pub(in crate::smoother) fn contains(&self, factor: u32) -> bool {
        self.candidates.contains_key(&factor)
    }

    /// Returns all candidates, ascending.
    pub(in crate::smoother) fn iter(&self) -> impl Iterator<Item = (u32, Candidate)> {
        self.candidates.iter().map(|(f, candidate)| (*f, *candidate))
    }

    /// Returns whether a factor is a candidate that counts.
    pub(in crate::smoother) fn counts(&self, model: &Model, factor: u32) -> bool {
        self.contains(factor) && !model.is_rejected(factor)
    }

    /// Returns the bound of a candidate; infinite for other factors.
    pub(in crate::smoother) fn bound(&self, factor: u32) -> f64 {
        self.candidates.get(&factor).map_or(f64::INFINITY, |candidate| candidate.bound)
    }

    pub(in crate::smoother) fn insert(&mut self, factor: u32, candidate: Candidate) {
        self.candidates.insert(factor, candidate);
    }

    /// Forgets a factor that was removed.
    pub(in crate::smoother) fn forget(&mut self, factor: u32) {
        self.candidates.remove(&factor);
    }

    /// Records the update that rejects a candidate.
    pub(in crate::smoother) fn record_rejection(&mut self, factor: u32, update: usize) {
        if let Some(candidate) = self.candidates.get_mut(&factor) {
            candidate.since = update;
        }
    }

    /// Returns the variables that have moved since the last test.
    pub(in crate::smoother) fn moved(&self) -> &BTreeSet<u32> {
        &self.moved
    }

    /// Records variables that have moved, if there are candidates.
    pub(in crate::smoother) fn record_moved(&mut self, variables: impl IntoIterator<Item = u32>) {
        if !self.is_empty() {
            self.moved.extend(variables);
        }
    }

    /// Returns the variables that have moved, and forgets them.
    pub(in crate::smoother) fn drain_moved(&mut self) -> BTreeSet<u32> {
        std::mem::take(&mut self.moved)
    }

    /// Restores the variables that have moved.
    pub(in crate::smoother) fn restore_moved(&mut self, moved: BTreeSet<u32>) {
        self.moved.extend(moved);
    }

    /// Forgets a variable that was removed.
    pub(in crate::smoother) fn forget_variable(&mut self, variable: u32) {
        self.moved.remove(&variable);
    }

    /// Returns a candidate in its saved form.
    pub(in crate::smoother) fn saved(&self, model: &Model, factor: u32) -> Option<SavedCandidate> {
        let Candidate { bound, gain, since } = self.get(factor)?;
        Some(SavedCandidate { bound, gain, since: model.is_rejected(factor).then_some(since) })
    }

    /// Restores a saved candidate.
    pub(in crate::smoother) fn restore(
        &mut self,
        factor: u32,
        SavedCandidate { bound, gain, since }: SavedCandidate,
    ) {
        self.insert(factor, Candidate { bound, gain, since: since.unwrap_or_default() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variables_are_noted_only_while_there_are_candidates() {
        let mut candidates = OutlierCandidates::default();
        candidates.record_moved([1, 2]);
        assert!(candidates.moved().is_empty());
        candidates.restore(7, SavedCandidate { bound: 9.0, gain: 1.5, since: None });
        candidates.record_moved([1, 2]);
        candidates.forget_variable(1);
        assert_eq!(candidates.drain_moved(), BTreeSet::from([2]));
        assert!(candidates.moved().is_empty());
    }

    #[test]
    fn a_candidate_keeps_its_limits_until_it_is_removed() {
        let mut candidates = OutlierCandidates::default();
        candidates.insert(7, Candidate { bound: 9.0, gain: 1.5, since: 1 });
        candidates.record_rejection(7, 4);
        candidates.record_rejection(8, 4);
        assert_eq!(candidates.get(7), Some(Candidate { bound: 9.0, gain: 1.5, since: 4 }));
        assert!(candidates.bound(8).is_infinite() && candidates.len() == 1);
        assert!(candidates.saved(&Model::default(), 7).is_some_and(|saved| saved.since.is_none()));
        candidates.forget(7);
        assert!(candidates.is_empty());
    }
}
