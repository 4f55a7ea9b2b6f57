//! Undamped steps, with minimal damping if a direction is undetermined.
use super::{Descent, TrialStep};
use crate::inspect::null_space::undetermined;
use crate::linear::system::dot;
use crate::outcome::Undetermined;

/// Damping for an H that cannot be factorized, as shares of its diagonal; the first that suffices is used.
const DAMPING_SHARES: [f64; 4] = [1e-10, 1e-8, 1e-6, 1e-3];
/// Lower bound of diagonal entries, as a share of the largest one.
const DIAGONAL_FLOOR: f64 = 1e-9;

impl Descent<'_> {
    /// Factorizes H. Returns whether it succeeded. With an undetermined direction, as in a graph without a
    /// prior, minimal damping is added to the diagonal. The step then does not move along that direction,
    /// and the outcome reports it. See `docs/decisions/undetermined.md`.
    pub(super) fn factorize_undamped(&mut self) -> bool {
        if !self.is_open {
            let done = self.factorize(None);
            self.is_open = undetermined(self.problem, !done, 0.0).is_some();
            if done && !self.is_open {
                return true;
            }
        }
        let diagonal = self.diagonal();
        let largest = diagonal.iter().fold(0.0, |most, d| f64::max(most, *d));
        let floor = if largest > 0.0 { DIAGONAL_FLOOR * largest } else { 1.0 };
        DAMPING_SHARES.into_iter().any(|share| {
            let added: Vec<f64> = diagonal.iter().map(|d| share * d.max(floor)).collect();
            self.factorize(Some(&added))
        })
    }

    /// Returns whether an undamped step predicts almost no decrease, so that damping is not the reason for
    /// small steps. Leaves that step in `step`.
    pub(crate) fn is_at_rest(&mut self, step: &mut TrialStep) -> bool {
        self.at.not_finite.is_none()
            && !self.is_steep()
            && self.undamped(step)
            && self.is_small(step.predicted)
    }

    /// Returns whether an undamped step predicts a decrease of more than this share of the cost. Leaves
    /// that step in `step`.
    pub(crate) fn predicts_decrease(&mut self, step: &mut TrialStep, share: f64) -> bool {
        if self.at.not_finite.is_some()
            || !self.step_within_bounds(&mut step.delta, |descent| descent.factorize(None))
        {
            return false;
        }
        let predicted = -0.5 * dot(&step.delta, &self.problem.system.g);
        self.clip(step, predicted);
        step.predicted > share * self.changing_cost()
    }

    /// Returns the undetermined direction at the end of a solve with undamped steps, if there was one on
    /// the way.
    pub(crate) fn undetermined_direction(&mut self) -> Option<Undetermined> {
        let looks = self.is_open && !self.interrupted && self.at.not_finite.is_none();
        looks.then(|| undetermined(self.problem, true, 0.0)).flatten()
    }
}
