//! Steps that are too long: where the true cost rises, half the way is tried, and then half of that; at last, a batch solve.
use super::Session;
use super::changes::Touched;
use super::parking::Moves;
use crate::report::Report;
use manifactor_graph::batch::Evaluation;
use manifactor_solve::{LevenbergMarquardt, Silent};

/// Halvings of a step.
const HALVINGS: usize = 6;
/// Damped steps before a batch solve.
const ROUNDS: usize = 3;
/// A rise of the cost by less than this share of it is rounding, or what was not passed on.
const RISE: f64 = 1e-3;

impl Session {
    /// Looks whether long steps have raised the cost of the factors around; only where a step is far out of the region of its
    /// linearization, as others cannot do harm.
    pub(super) fn control_step(&mut self, report: &mut Report) {
        if !self.steady(report) {
            report.solved_batch = self.settle(report);
        }
    }

    /// Shortens long steps that have raised the cost; whether it has ceased to rise.
    pub(super) fn steady(&mut self, report: &mut Report) -> bool {
        for _ in 0..ROUNDS {
            if !self.is_urgent() || !self.shorten(report) {
                return true;
            }
            // from the shorter step, linearized there
            let moved: Vec<u32> = self.moved.iter().map(|(v, _)| *v).collect();
            let held = Touched { held: moved, ..Touched::default() };
            if self.pass(&held, &Moves::default(), false, report).is_err() {
                return true;
            }
        }
        !(self.is_urgent() && self.shorten(report))
    }

    /// Halves the last step until it lowers the cost of the factors around; whether it had to be.
    fn shorten(&mut self, report: &mut Report) -> bool {
        let moved: Vec<u32> = self.moved.iter().map(|(v, _)| *v).collect();
        let mut factors = self.model.factors_of(&moved);
        factors.retain(|f| self.model.is_whole(*f));
        let after = self.cost_of(&factors);
        self.exchange_steps();
        let before = self.cost_of(&factors);
        self.exchange_steps();
        if !rises(&before, &after) {
            return false;
        }
        for _ in 0..HALVINGS {
            report.halved += 1;
            for (v, first) in &self.moved {
                let range = self.model.blocks.range(*v);
                let old = &self.before[*first..*first + range.len()];
                self.delta[range].iter_mut().zip(old).for_each(|(new, old)| *new = 0.5 * (*new + old));
            }
            let after = self.cost_of(&factors);
            if !rises(&before, &after) {
                break;
            }
        }
        true
    }

    /// Exchanges the steps of the last pass and those before it.
    fn exchange_steps(&mut self) {
        for (v, first) in &self.moved {
            let range = self.model.blocks.range(*v);
            let old = &mut self.before[*first..*first + range.len()];
            self.delta[range].swap_with_slice(old);
        }
    }

    /// The cost of factors at the estimate.
    pub(super) fn cost_of(&mut self, factors: &[u32]) -> Evaluation {
        let mut variables: Vec<u32> =
            factors.iter().filter_map(|f| self.model.factor(*f)).flat_map(|f| f.variables()).collect();
        variables.sort_unstable();
        variables.dedup();
        for v in &variables {
            self.model.try_step(*v, &self.delta[self.model.blocks.range(*v)]);
        }
        let cost = self.model.cost(factors, Some(&self.delta));
        variables.iter().for_each(|v| self.model.reset_trial(*v));
        cost
    }

    /// Solves all of it as one batch from the estimate, and goes on from there; whether the cost has fallen.
    pub(super) fn settle(&mut self, report: &mut Report) -> bool {
        let Ok(finished) = self.finish(&LevenbergMarquardt::default(), &mut Silent) else { return false };
        finished.outcome.final_cost < finished.outcome.initial_cost
            && self.adopt(&finished.values, report).is_ok()
    }
}

fn rises(before: &Evaluation, after: &Evaluation) -> bool {
    let is_lower = after.cost <= before.cost * (1.0 + RISE);
    // not a number is not lower either
    after.left > before.left || !is_lower
}
