//! Steps without damping, for solvers that take none: with next to none where something is open.
use super::{Descent, Step};
use crate::inspect::null_space::undetermined;
use crate::linear::system::dot;
use crate::outcome::Undetermined;

/// What is added to the diagonal of H where it cannot be factorized, as shares of it: the least that will do.
const SHARES: [f64; 4] = [1e-10, 1e-8, 1e-6, 1e-3];
/// Entries of the diagonal below this share of the largest count as this share.
const FLOOR: f64 = 1e-9;

impl Descent<'_> {
    /// Factorizes H; whether that was possible. Where nothing constrains a direction, as in a graph without a prior,
    /// just enough is added to its diagonal: the step then leaves that direction alone, and the outcome names it. See
    /// `docs/decisions/undetermined.md`.
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
        let floor = if largest > 0.0 { FLOOR * largest } else { 1.0 };
        SHARES.into_iter().any(|share| {
            let added: Vec<f64> = diagonal.iter().map(|d| share * d.max(floor)).collect();
            self.factorize(Some(&added))
        })
    }

    /// Returns whether a step without damping promises next to nothing: then it is not the damping that makes steps small.
    /// Leaves that step in `step`.
    pub(crate) fn is_at_rest(&mut self, step: &mut Step) -> bool {
        self.at.not_finite.is_none()
            && !self.is_steep()
            && self.undamped(step)
            && self.is_small(step.predicted)
    }

    /// Returns whether a step without any damping promises more than this share of the cost. Leaves that step in `step`.
    pub(crate) fn promises(&mut self, step: &mut Step, share: f64) -> bool {
        let can_step =
            self.at.not_finite.is_none() && self.factorize(None) && self.newton_step(&mut step.delta);
        step.predicted = -0.5 * dot(&step.delta, &self.problem.system.g);
        can_step && step.predicted > share * self.at.cost
    }

    /// At the end of a solve by such steps: what is open at the estimate, where something was on the way.
    pub(crate) fn open_direction(&mut self) -> Option<Undetermined> {
        let looks = self.is_open && !self.interrupted && self.at.not_finite.is_none();
        looks.then(|| undetermined(self.problem, true, 0.0)).flatten()
    }
}
