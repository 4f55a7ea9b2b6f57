//! Undetermined variables. They are excluded from the tree, with all their factors.
//!
//! A variable is undetermined while its diagonal block of H is rank deficient. Examples are a point that was
//! observed once, and a pose whose only factor is not defined. Its factors carry no information on their
//! other variables, so leaving them out is exact. The diagonal block does not show two poses that are only
//! tied to each other. Pivots find these: see [`Fronts`](crate::fronts::Fronts).
use super::changes::Touched;
use super::factorization::Factorization;
use crate::elimination_tree::Couplings;
use crate::model::Model;
use crate::report::SharedList;
use manifactor_graph::Key;
use std::collections::{BTreeSet, VecDeque};

/// Smallest pivot of a block with full rank, after scaling to a unit diagonal.
const MIN_PIVOT: f64 = 1e-8;

/// Variables that enter or leave the tree.
#[derive(Debug, Default)]
pub(super) struct Moves {
    /// Both ascend.
    pub(super) entering: Vec<u32>,
    pub(super) leaving: Vec<u32>,
    /// Checked variables (`judged`), ascending, and the ones whose flag has changed (`flipped`).
    pub(super) judged: Vec<u32>,
    pub(super) flipped: Vec<u32>,
}

impl Moves {
    /// Decides which of the doubtful variables are undetermined, and which factors count.
    pub(super) fn of(model: &mut Model, factorization: &Factorization, touched: &mut Touched) -> Self {
        let candidates: BTreeSet<u32> = touched.doubtful.iter().copied().collect();
        let was_undetermined: Vec<(u32, bool)> =
            candidates.iter().map(|v| (*v, model.is_undetermined(*v))).collect();
        // start with all of them in the tree; remove the undetermined ones, then neighbours that depended on
        // these
        candidates.iter().for_each(|v| _ = model.set_undetermined(*v, false));
        let mut undetermined = BTreeSet::new();
        let mut queue: VecDeque<u32> = candidates.iter().copied().collect();
        while let Some(v) = queue.pop_front() {
            let place = model.record(v);
            // a prior constrains its other variables even if it does not determine this one
            if !model.is_undetermined(v)
                && !place.is_held()
                && place.prior_count == 0
                && !is_determined(model, v)
            {
                model.set_undetermined(v, true);
                undetermined.insert(v);
                queue.extend(model.coupled(v));
            }
        }
        let others = undetermined.iter().filter(|v| !candidates.contains(v)).map(|v| (*v, false));
        let mut before: Vec<(u32, bool)> = was_undetermined.into_iter().chain(others).collect();
        before.sort_unstable();
        let mut moves = Self::default();
        let mut factors = touched.factors.clone();
        for (v, was_undetermined) in before {
            moves.judged.push(v);
            if model.is_undetermined(v) != was_undetermined {
                moves.flipped.push(v);
                factors.extend(model.blocks.factors(v));
            }
        }
        factors.sort_unstable();
        factors.dedup();
        for f in factors {
            let is_whole = model.is_whole(f);
            model.count(f, is_whole);
            touched.variables.extend(model.factor(f).into_iter().flat_map(|f| f.variables()));
        }
        let examined = touched.variables.iter().chain(&candidates).chain(&undetermined);
        for v in examined.copied().collect::<BTreeSet<u32>>() {
            let is_in = factorization.contains(v);
            match (is_in, model.is_in_tree(v)) {
                (false, true) => moves.entering.push(v),
                (true, false) => moves.leaving.push(v),
                _ => {}
            }
        }
        moves
    }

    /// Undoes the decisions.
    pub(super) fn undo(&self, model: &mut Model) {
        for v in &self.flipped {
            let is_undetermined = model.is_undetermined(*v);
            model.set_undetermined(*v, !is_undetermined);
        }
        let factors: BTreeSet<u32> = self.flipped.iter().flat_map(|v| model.blocks.factors(*v)).collect();
        for f in factors {
            let is_whole = model.is_whole(f);
            model.count(f, is_whole);
        }
    }
}

/// Variables and factors that take no part.
#[derive(Debug, Default)]
pub(super) struct Undetermined {
    /// Undetermined variables whose factors were relinearized since the last check.
    doubtful: Vec<u32>,
    /// Factors that were not defined at their last linearization, or have no weight.
    inactive: BTreeSet<u32>,
    /// Keys of undetermined variables, for reports.
    undetermined_keys: SharedList<Key>,
}

impl Undetermined {
    /// Returns the undetermined variables to check again.
    pub(super) fn doubtful(&self) -> &[u32] {
        &self.doubtful
    }

    /// Sets the undetermined variables to check again.
    pub(super) fn doubt(&mut self, variables: Vec<u32>) {
        self.doubtful = variables;
    }

    /// Removes checked variables from this list. `judged` ascends.
    pub(super) fn remove_checked(&mut self, judged: &[u32]) {
        self.doubtful.retain(|v| judged.binary_search(v).is_err());
    }

    /// Returns the number of factors that take no part.
    pub(super) fn inactive(&self) -> usize {
        self.inactive.len()
    }

    /// Returns the keys of undetermined variables.
    pub(super) fn list_undetermined(&mut self, model: &mut Model) -> SharedList<Key> {
        if let Some(keys) = model.changed_undetermined_keys() {
            self.undetermined_keys = keys;
        }
        self.undetermined_keys.clone()
    }

    /// Forgets a variable.
    pub(super) fn forget(&mut self, variable: u32) {
        self.doubtful.retain(|v| *v != variable);
    }

    /// Forgets a factor.
    pub(super) fn forget_factor(&mut self, factor: u32) {
        self.inactive.remove(&factor);
    }

    /// Marks undetermined variables for the next update, because their factors have changed.
    pub(super) fn doubt_undetermined(&mut self, model: &Model, factors: &[u32]) {
        let factors = factors.iter().filter(|f| !model.is_whole(**f)).filter_map(|f| model.factor(*f));
        let undetermined = factors.flat_map(|f| f.variables()).filter(|v| model.is_undetermined(*v));
        self.doubtful.extend(undetermined);
        self.doubtful.sort_unstable();
        self.doubtful.dedup();
    }

    /// Records which factors take no part. Their variables may have become undetermined.
    pub(super) fn doubt_inactive(&mut self, model: &Model, touched: &mut Touched) {
        self.forget_inactive(model, &touched.removed);
        for f in &touched.factors {
            if self.record_activity(model, *f) {
                touched.doubtful.extend(model.factor(*f).into_iter().flat_map(|f| f.variables()));
            }
        }
    }

    /// Forgets removed factors that took no part.
    pub(super) fn forget_inactive(&mut self, model: &Model, removed: &[u32]) {
        for f in removed.iter().filter(|f| model.factor(**f).is_none()) {
            self.inactive.remove(f);
        }
    }

    /// Records whether factors took part in their last linearization.
    pub(super) fn record_activities(&mut self, model: &Model, factors: &[u32]) {
        for f in factors {
            self.record_activity(model, *f);
        }
    }

    /// Records whether a factor took part in its last linearization. Returns whether it has just become
    /// inactive.
    pub(super) fn record_activity(&mut self, model: &Model, factor: u32) -> bool {
        match model.is_rejected(factor) || model.takes_part(factor) {
            true => {
                self.inactive.remove(&factor);
                false
            }
            false => self.inactive.insert(factor),
        }
    }
}

/// Returns whether its factors determine a variable, given its neighbours. Factors with an undetermined
/// neighbour do not count.
fn is_determined(model: &Model, variable: u32) -> bool {
    let others_are_in = |f: u32| {
        let mut others = model.factor(f).into_iter().flat_map(|f| f.variables());
        others.all(|v| v == variable || !model.is_undetermined(v))
    };
    let mut h = model.own_block(variable, others_are_in);
    has_full_rank(&mut h, model.dim(variable))
}

/// Returns whether a symmetric matrix has full rank after scaling to a unit diagonal. Only its lower triangle
/// is used.
fn has_full_rank(h: &mut [f64], d: usize) -> bool {
    let scale: Vec<f64> = (0..d).map(|c| 1.0 / h[c * d + c].sqrt()).collect();
    if !scale.iter().all(|s| s.is_finite()) {
        return false;
    }
    for c in 0..d {
        (c..d).for_each(|r| h[c * d + r] *= scale[c] * scale[r]);
    }
    for c in 0..d {
        let pivot = h[c * d + c];
        if pivot.is_nan() || pivot <= MIN_PIVOT {
            return false;
        }
        for k in c + 1..d {
            let factor = h[c * d + k] / pivot;
            (k..d).for_each(|r| h[k * d + r] -= factor * h[c * d + r]);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::has_full_rank;

    #[test]
    fn units_do_not_matter_for_rank() {
        assert!(has_full_rank(&mut [1e-12, 0.0, 0.0, 1e12], 2));
        assert!(has_full_rank(&mut [1e6, 0.5, 0.0, 1e-6], 2));
        assert!(!has_full_rank(&mut [1e6, 1.0, 0.0, 1e-6], 2));
        assert!(!has_full_rank(&mut [1.0, 0.0, 0.0, 0.0], 2));
        assert!(!has_full_rank(&mut [f64::NAN, 0.0, 0.0, 1.0], 2));
    }
}
