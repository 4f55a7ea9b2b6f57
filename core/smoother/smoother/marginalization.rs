//! Marginalization: the factors of a variable become a linear prior on its neighbours. The neighbours keep
//! their linearization points from then on.
//!
//! Fixed points are necessary for consistency. If a prior were evaluated at one point and factors linearized
//! at a second one, the estimate would gain information on directions that no factor has measured
//! (first-estimates Jacobians; Huang, Mourikis and Roumeliotis, 2008).
use super::Smoother;
use super::changes::{Change, Touched};
use super::undetermined::Moves;
use crate::elimination_tree::Couplings;
use crate::error::ChangeError;
use crate::factor_id::FactorId;
use crate::model::{Overflow, Prior};
use crate::report::UpdateReport;
use manifactor_graph::Key;

/// Changes of the model by a marginalization, so that they can be undone. Removed factors are recorded as
/// such once it succeeds.
#[derive(Default)]
struct Marginalization {
    steps: Vec<UndoStep>,
    removed: Vec<u32>,
    dropped: Vec<u32>,
}

/// A step that undoes one change of the model.
enum UndoStep {
    /// Inserts a factor again, with the share of its weight.
    Factor(Change, u32, f64),
    /// Inserts a linear prior again.
    Prior(u32, Prior),
    /// Removes a new linear prior.
    Remove(u32),
    /// Restores whether a variable was undetermined.
    Undetermined(u32, bool),
}

impl Smoother {
    /// Marginalizes variables at the end of the next [`update`](Self::update).
    ///
    /// Their factors become a linear prior on the neighbours. The neighbours keep their linearization points
    /// until they are marginalized as well. Estimates and covariances of the remaining variables do not
    /// change. Factors that do not count, because they are not defined at the last linearization or have an
    /// undetermined variable, are dropped, and the report names them. If a prior overflows, all of these
    /// variables stay, and the report names them. The key of a variable without factors can be used again.
    ///
    /// # Errors
    /// If a variable does not exist, or is marginalized already. None is marginalized then.
    pub fn marginalize<K: AsRef<str>>(&mut self, keys: &[K]) -> Result<(), ChangeError> {
        for key in keys.iter().map(AsRef::as_ref) {
            if self.find(key).is_none() {
                return Err(self.no_variable(&Key::from(key)));
            }
        }
        self.pending.leaving.extend(keys.iter().map(|key| Key::from(key.as_ref())));
        Ok(())
    }

    /// Returns the error for a key without a variable.
    pub(super) fn no_variable(&self, key: &Key) -> ChangeError {
        match self.model.removed.keys.contains(key.as_str()) {
            true => ChangeError::Marginalized { key: key.clone() },
            false => ChangeError::NoVariable { key: key.clone() },
        }
    }

    /// Returns the error for an id without a factor.
    pub(super) fn no_factor(&self, factor: FactorId) -> ChangeError {
        match self.model.removed.factors.contains(u64::from(factor.0)) {
            true => ChangeError::MarginalizedFactor { factor },
            false => ChangeError::NoFactor { factor },
        }
    }

    /// Marginalizes these variables, one after the other, and solves again. If that fails, all of them stay,
    /// with their factors.
    pub(super) fn marginalize_now(
        &mut self,
        leaving: &[u32],
        report: &mut UpdateReport,
    ) -> Result<(), Overflow> {
        if leaving.is_empty() {
            return Ok(());
        }
        // points that are about to be fixed should be accurate; a failed pass leaves them unchanged
        let is_stale = |v: &u32| self.is_out(*v) || self.model.coupled(*v).any(|u| self.is_out(u));
        if leaving.iter().any(is_stale) {
            let _ = self.run_pass(&Touched::default(), &Moves::default(), true, report);
        }
        let mut touched = Touched::default();
        let is_bare = |v: &u32| self.model.factors_of(&[*v]).is_empty();
        let bare: Vec<u32> = leaving.iter().copied().filter(is_bare).collect();
        let mut marginalization = Marginalization::default();
        for v in leaving {
            if let Err(overflow) = self.replace_by_prior(*v, &mut touched, &mut marginalization) {
                self.undo_marginalization(marginalization);
                return Err(overflow);
            }
        }
        // variables that are marginalized together are neighbours of each other
        let is_present =
            |smoother: &Self, v: u32| !leaving.contains(&v) && smoother.model.record(v).is_present;
        touched.doubtful.retain(|v| is_present(self, *v));
        let moves = Moves::of(&mut self.model, &self.factorization, &mut touched);
        if let Err(overflow) = self.run_pass(&touched, &moves, false, report) {
            moves.undo(&mut self.model);
            self.undo_marginalization(marginalization);
            return Err(overflow);
        }
        for f in marginalization.removed {
            // this includes the numbers of priors: no caller has them, and the ranges stay without gaps
            self.model.removed.factors.insert(u64::from(f));
            self.undetermined.forget_factor(f);
            self.candidates.forget(f);
        }
        report.dropped.extend(marginalization.dropped.into_iter().map(FactorId));
        for v in leaving {
            let key = self.key(*v);
            self.model.removed.keys.insert(key.as_str(), !bare.contains(v));
            report.marginalized.push(key);
            self.forget(*v);
        }
        Ok(())
    }

    /// Undoes a failed marginalization, the last step first.
    fn undo_marginalization(&mut self, marginalization: Marginalization) {
        let (mut touched, mut factors) = (Touched::default(), vec![]);
        for step in marginalization.steps.into_iter().rev() {
            match step {
                UndoStep::Factor(change, number, share) => {
                    change.apply(&mut self.model, &mut touched);
                    if share != 1.0 {
                        self.model.attenuate(number, share);
                    }
                    factors.push(number);
                }
                UndoStep::Prior(number, prior) => {
                    self.model.insert_prior(number, &prior);
                    factors.push(number);
                }
                UndoStep::Remove(number) => {
                    self.model.remove(number);
                    self.model.removed.factors.insert(u64::from(number));
                }
                UndoStep::Undetermined(variable, was_undetermined) => {
                    _ = self.model.set_undetermined(variable, was_undetermined);
                }
            }
        }
        self.sort_factors(&mut factors);
        // equal points give equal bits
        self.model.linearize(&factors);
        for f in factors {
            self.model.count(f, self.model.is_whole(f));
        }
        self.model.sum_up();
    }

    /// Replaces the factors of a variable by a prior. The variable is in the tree until the next pass.
    fn replace_by_prior(
        &mut self,
        variable: u32,
        touched: &mut Touched,
        marginalization: &mut Marginalization,
    ) -> Result<(), Overflow> {
        let mut factors = self.model.factors_of(&[variable]);
        let counts = |f: &u32| self.model.is_whole(*f) && self.model.takes_part(*f);
        let (mut replaced, dropped): (Vec<u32>, Vec<u32>) = factors.iter().partition(|f| counts(f));
        replaced.extend(self.covered(&replaced, variable));
        replaced.sort_unstable();
        let prior = self.model.marginal_prior(variable, &replaced)?;
        factors.extend(&replaced);
        factors.sort_unstable();
        factors.dedup();
        let rejected = self.model.rejected_of(variable);
        for f in factors {
            touched.variables.extend(self.model.factor(f).into_iter().flat_map(|f| f.variables()));
            self.remove_replaced(f, marginalization);
        }
        touched.variables.push(variable);
        for f in &rejected {
            self.remove_replaced(*f, marginalization);
        }
        marginalization.dropped.extend(dropped.into_iter().chain(rejected));
        if let Some(prior) = prior {
            let number = self.model.next_factor();
            self.model.insert_prior(number, &prior);
            marginalization.steps.push(UndoStep::Remove(number));
        }
        touched.doubtful.extend(&touched.variables);
        // out of the tree
        let was_undetermined = self.model.set_undetermined(variable, true);
        marginalization.steps.push(UndoStep::Undetermined(variable, was_undetermined));
        Ok(())
    }

    /// Removes a factor or a linear prior, and records the step that undoes this.
    fn remove_replaced(&mut self, number: u32, marginalization: &mut Marginalization) {
        let Some(factor) = self.model.factor(number) else { return };
        let share = factor.share;
        let step = match self.model.prior(number) {
            Some(prior) => {
                self.model.remove(number);
                Some(UndoStep::Prior(number, prior))
            }
            None => {
                let change = Change::Remove { number }.apply(&mut self.model, &mut Touched::default());
                change.map(|change| UndoStep::Factor(change, number, share))
            }
        };
        marginalization.steps.extend(step);
        marginalization.removed.push(number);
    }

    /// Returns the priors whose variables are all among the neighbours. They become part of the new prior, so
    /// that the number of priors stays small.
    fn covered(&self, factors: &[u32], variable: u32) -> Vec<u32> {
        let variables = factors.iter().filter_map(|f| self.model.factor(*f)).flat_map(|f| f.variables());
        let mut around: Vec<u32> = variables.collect();
        around.sort_unstable();
        around.dedup();
        let with_priors =
            around.iter().copied().filter(|v| *v != variable && self.model.record(*v).prior_count > 0);
        let of_these = self.model.factors_of(&with_priors.collect::<Vec<_>>());
        let is_covered = |f: &u32| {
            let prior = self.model.factor(*f).filter(|factor| factor.entry.is_none());
            prior.is_some_and(|prior| {
                prior.variables().all(|v| v != variable && around.binary_search(&v).is_ok())
            })
        };
        of_these.into_iter().filter(is_covered).collect()
    }

    /// Removes all records of a variable that is out of the tree.
    fn forget(&mut self, variable: u32) {
        self.steps.forget(&self.model, variable);
        self.queue.forget(variable);
        self.undetermined.forget(variable);
        self.candidates.forget_variable(variable);
        self.model.blocks.damp(variable, 0.0);
        self.model.forget(variable);
    }
}
