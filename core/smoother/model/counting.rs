//! Weights of factors, and rejection.
use super::{Factor, Model};
use std::collections::BTreeSet;

impl Model {
    /// Sets the weight of a factor. Returns the previous weight.
    pub(crate) fn set_weight(&mut self, number: u32, weight: f64) -> Option<f64> {
        let factor = self.factors.get_mut(number)?;
        self.batches.as_mut_slice()[factor.batch as usize].set_weight(factor.index as usize, weight);
        Some(std::mem::replace(&mut factor.weight, weight))
    }

    /// Reduces the weight of a factor to a share of it.
    pub(crate) fn attenuate(&mut self, number: u32, share: f64) {
        let Some(factor) = self.factors.get_mut(number) else { return };
        factor.share = share;
        let batch = &mut self.batches.as_mut_slice()[factor.batch as usize];
        batch.set_weight(factor.index as usize, share * factor.weight);
    }

    /// Rejects a factor as an outlier: it no longer couples its variables. Returns whether it counted before.
    pub(crate) fn reject(&mut self, number: u32) -> bool {
        let Some(factor) = self.factors.get(number) else { return false };
        let is_in = self.rejected.insert(number);
        if is_in {
            self.blocks.disconnect(number, &factor.members);
        }
        is_in
    }

    /// Readmits a rejected factor. Returns whether it was rejected. The caller linearizes it afterwards.
    pub(crate) fn readmit(&mut self, number: u32) -> bool {
        let Some(factor) = self.factors.get(number).filter(|_| self.rejected.remove(&number)) else {
            return false;
        };
        self.blocks.connect(number, factor.region, &factor.members);
        // the held directions may have changed since
        self.pass_held_directions(number);
        true
    }

    /// Returns the factors that are rejected as outliers.
    pub(crate) fn rejected(&self) -> &BTreeSet<u32> {
        &self.rejected
    }

    /// Returns whether a factor is rejected as an outlier.
    pub(crate) fn is_rejected(&self, number: u32) -> bool {
        self.rejected.contains(&number)
    }

    /// Returns the rejected factors of a variable.
    pub(crate) fn rejected_of(&self, variable: u32) -> Vec<u32> {
        let is_of = |f: &u32| self.factor(*f).is_some_and(|f| f.variables().any(|v| v == variable));
        self.rejected.iter().copied().filter(is_of).collect()
    }

    /// Passes the held directions of a factor's variables to its batch.
    pub(crate) fn pass_held_directions(&mut self, number: u32) {
        let Some(factor) = self.factors.get(number).filter(|factor| factor.entry.is_some()) else { return };
        let (starts, held) = self.starts(factor, self.regions[factor.region]);
        self.batches.as_mut_slice()[factor.batch as usize].set_fixed(factor.index as usize, &starts, &held);
    }

    /// Sets the held directions of a variable. Returns the previous ones. The caller linearizes its factors
    /// afterwards.
    pub(crate) fn set_held(&mut self, variable: u32, held: u32) -> u32 {
        let before = std::mem::replace(&mut self.records[variable as usize].held, held);
        self.blocks.set_held(variable, held);
        for f in self.blocks.factors(variable).collect::<Vec<_>>() {
            self.pass_held_directions(f);
        }
        before
    }

    /// Returns whether a factor was defined at its last linearization.
    pub(crate) fn is_defined(&self, number: u32) -> bool {
        self.factor(number).is_some_and(|factor| {
            let batch = || &self.batches.as_slice()[factor.batch as usize];
            factor.entry.is_none() || batch().is_active(factor.index as usize)
        })
    }

    /// Returns whether a factor takes part: it was defined at its last linearization, and its weight is not
    /// zero.
    pub(crate) fn takes_part(&self, number: u32) -> bool {
        self.is_defined(number) && self.factor(number).is_some_and(|factor| factor.weight != 0.0)
    }

    /// Returns whether a factor is not rejected and has no undetermined variable.
    pub(crate) fn is_whole(&self, number: u32) -> bool {
        let is_in = |factor: &Factor| factor.variables().all(|v| !self.is_undetermined(v));
        self.factor(number).is_some_and(|factor| !self.is_rejected(number) && is_in(factor))
    }

    /// Sets whether the terms of a factor are included in the sums.
    pub(crate) fn count(&mut self, number: u32, counts: bool) {
        let Some(factor) = self.factors.get(number) else { return };
        if self.regions.count(factor.region, counts) != counts {
            self.blocks.mark_factor(&factor.members);
        }
    }
}
