//! Candidates for outliers, and their limits. The model stores which of them are rejected.
use crate::model::Model;
use crate::saved::Suspect;
use std::collections::{BTreeMap, BTreeSet};

/// The limits of a factor that may be an outlier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::session) struct Candidate {
    /// Upper limit of ‖r‖² for an inlier: the χ² quantile for its rows.
    pub(in crate::session) bound: f64,
    /// Largest information gain of this factor without confirmation by a second one. Unit: nats.
    pub(in crate::session) gain: f64,
    /// The update that rejected it last.
    pub(in crate::session) since: usize,
}

/// All factors that may be outliers.
#[derive(Debug, Default)]
pub(in crate::session) struct OutlierCandidates {
    candidates: BTreeMap<u32, Candidate>,
    /// Variables that have moved since the last test.
    shaken: BTreeSet<u32>,
}

impl OutlierCandidates {
    pub(in crate::session) fn is_empty(&self) -> bool {
        self.candidates.is_empty()
    }

    pub(in crate::session) fn len(&self) -> usize {
        self.candidates.len()
    }

    pub(in crate::session) fn get(&self, factor: u32) -> Option<Candidate> {
        self.candidates.get(&factor).copied()
    }

    pub(in crate::session) fn contains(&self, factor: u32) -> bool {
        self.candidates.contains_key(&factor)
    }

    /// Returns all candidates, ascending.
    pub(in crate::session) fn iter(&self) -> impl Iterator<Item = (u32, Candidate)> {
        self.candidates.iter().map(|(f, candidate)| (*f, *candidate))
    }

    /// Returns whether a factor is a candidate that counts.
    pub(in crate::session) fn counts(&self, model: &Model, factor: u32) -> bool {
        self.contains(factor) && !model.is_rejected(factor)
    }

    /// Returns the bound of a candidate; infinite for other factors.
    pub(in crate::session) fn bound(&self, factor: u32) -> f64 {
        self.candidates.get(&factor).map_or(f64::INFINITY, |candidate| candidate.bound)
    }

    pub(in crate::session) fn insert(&mut self, factor: u32, candidate: Candidate) {
        self.candidates.insert(factor, candidate);
    }

    /// Forgets a factor that was removed.
    pub(in crate::session) fn forget(&mut self, factor: u32) {
        self.candidates.remove(&factor);
    }

    /// Records the update that rejects a candidate.
    pub(in crate::session) fn note_rejection(&mut self, factor: u32, update: usize) {
        if let Some(candidate) = self.candidates.get_mut(&factor) {
            candidate.since = update;
        }
    }

    /// Returns the variables that have moved since the last test.
    pub(in crate::session) fn shaken(&self) -> &BTreeSet<u32> {
        &self.shaken
    }

    /// Records variables that have moved, if there are candidates.
    pub(in crate::session) fn shake(&mut self, variables: impl IntoIterator<Item = u32>) {
        if !self.is_empty() {
            self.shaken.extend(variables);
        }
    }

    /// Returns the variables that have moved, and forgets them.
    pub(in crate::session) fn drain_shaken(&mut self) -> BTreeSet<u32> {
        std::mem::take(&mut self.shaken)
    }

    /// Restores the variables that have moved.
    pub(in crate::session) fn restore_shaken(&mut self, shaken: BTreeSet<u32>) {
        self.shaken.extend(shaken);
    }

    /// Forgets a variable that was removed.
    pub(in crate::session) fn forget_variable(&mut self, variable: u32) {
        self.shaken.remove(&variable);
    }

    /// Returns a candidate in its saved form.
    pub(in crate::session) fn saved(&self, model: &Model, factor: u32) -> Option<Suspect> {
        let Candidate { bound, gain, since } = self.get(factor)?;
        Some(Suspect { bound, gain, since: model.is_rejected(factor).then_some(since) })
    }

    /// Restores a saved candidate.
    pub(in crate::session) fn restore(&mut self, factor: u32, Suspect { bound, gain, since }: Suspect) {
        self.insert(factor, Candidate { bound, gain, since: since.unwrap_or_default() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variables_are_noted_only_while_there_are_candidates() {
        let mut candidates = OutlierCandidates::default();
        candidates.shake([1, 2]);
        assert!(candidates.shaken().is_empty());
        candidates.restore(7, Suspect { bound: 9.0, gain: 1.5, since: None });
        candidates.shake([1, 2]);
        candidates.forget_variable(1);
        assert_eq!(candidates.drain_shaken(), BTreeSet::from([2]));
        assert!(candidates.shaken().is_empty());
    }

    #[test]
    fn a_candidate_keeps_its_limits_until_it_is_removed() {
        let mut candidates = OutlierCandidates::default();
        candidates.insert(7, Candidate { bound: 9.0, gain: 1.5, since: 1 });
        candidates.note_rejection(7, 4);
        candidates.note_rejection(8, 4);
        assert_eq!(candidates.get(7), Some(Candidate { bound: 9.0, gain: 1.5, since: 4 }));
        assert!(candidates.bound(8).is_infinite() && candidates.len() == 1);
        assert!(candidates.saved(&Model::default(), 7).is_some_and(|saved| saved.since.is_none()));
        candidates.forget(7);
        assert!(candidates.is_empty());
    }
}
