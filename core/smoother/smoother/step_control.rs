//! Control of steps that are so long that they raise the true cost.
//!
//! If a few variables step far, they are poorly determined. They are damped one by one, as Levenberg and
//! Marquardt damp all variables. If many step far, a loop moves as a whole: the step is halved, repeatedly.
//! The last resort is a batch solve.
//!
//! A variable is damped by λ on the diagonal of its block of H. This is a prior at its linearization point.
//! It does not move the minimum, because each update relinearizes the variable with less damping.
use super::Smoother;
use super::changes::Touched;
use super::undetermined::Moves;
use crate::report::UpdateReport;
use manifactor_solve::{DiagonalLimits, LevenbergMarquardt, Silent};
use smallvec::SmallVec;
use std::collections::BTreeMap;

/// Largest number of variables that are damped. More variables belong to a loop.
const MAX_DAMPED_VARIABLES: usize = 16;
/// Rounds of halving before a batch solve, and rounds of damping.
const HALVING_ROUNDS: usize = 3;
const DAMPING_ROUNDS: usize = 6;
/// A smaller rise, as a share of the cost, is rounding error.
const ROUNDING_SHARE: f64 = 1e-12;

impl Smoother {
    /// Shortens steps that have raised the cost of the surrounding factors.
    ///
    /// It examines only steps far outside of the region of their linearization, because a single short step
    /// does little harm. Many short steps can: Gauss-Newton may circle around a minimum forever. An idle
    /// update therefore examines all steps, and solves a batch if the cost has risen.
    pub(super) fn control_step(&mut self, report: &mut UpdateReport) {
        if self.schedule.is_idle() {
            let (_, before, after) = self.steps.last_step(&mut self.model);
            if after.became_undefined > before.became_undefined
                || after.cost > before.cost * (1.0 + ROUNDING_SHARE)
            {
                report.solved_batch |= self.solve_batch(report);
            }
        } else if !self.shorten_long_steps(report) {
            report.solved_batch = self.solve_batch(report);
        }
    }

    /// Shortens long steps that have raised the cost. Returns whether the cost no longer rises.
    pub(super) fn shorten_long_steps(&mut self, report: &mut UpdateReport) -> bool {
        !self.is_urgent()
            || if self.queue.urgent().len() > MAX_DAMPED_VARIABLES {
                self.halve_steps(report)
            } else {
                self.damp_variables(report)
            }
    }

    /// Halves the last step and linearizes there. Returns whether the cost no longer rises.
    fn halve_steps(&mut self, report: &mut UpdateReport) -> bool {
        for _ in 0..HALVING_ROUNDS {
            if !self.is_urgent() || !self.shorten_steps(report) {
                return true;
            }
            // continue from the shorter step, with factors linearized there
            let held = Touched { held: self.steps.moved().collect(), ..Touched::default() };
            if self.run_pass(&held, &Moves::default(), false, report).is_err() {
                return true;
            }
        }
        !(self.is_urgent() && self.shorten_steps(report))
    }

    fn shorten_steps(&mut self, report: &mut UpdateReport) -> bool {
        let halvings = self.steps.shorten(&mut self.model);
        report.halved += halvings;
        halvings > 0
    }

    /// Damps variables whose steps are far too long, while the cost of the surrounding factors is above its
    /// value before the steps. Returns whether the cost no longer rises.
    fn damp_variables(&mut self, report: &mut UpdateReport) -> bool {
        let mut before: BTreeMap<u32, SmallVec<[f64; 9]>> = BTreeMap::new();
        for _ in 0..DAMPING_ROUNDS {
            for (v, old) in self.steps.before(&self.model) {
                before.entry(v).or_insert_with(|| SmallVec::from_slice(old));
            }
            if !self.is_urgent() || !self.steps.has_risen(&mut self.model, &before) {
                return true;
            }
            let urgent = self.queue.urgent().to_vec();
            self.steps.damp(&mut self.model, &urgent);
            report.damped += urgent.len();
            let touched = Touched { variables: urgent, ..Touched::default() };
            if self.run_pass(&touched, &Moves::default(), false, report).is_err() {
                return true;
            }
        }
        !(self.is_urgent() && self.steps.has_risen(&mut self.model, &before))
    }

    /// Solves the whole graph as one batch from the estimate and continues from the result. Returns whether
    /// the cost has fallen.
    pub(super) fn solve_batch(&mut self, report: &mut UpdateReport) -> bool {
        let Ok(finished) = self.finish(&batch_solver(), &mut Silent) else { return false };
        finished.outcome.final_cost < finished.outcome.initial_cost
            && self.adopt(&finished.values, report).is_ok()
    }
}

/// Returns the batch solver. It damps all directions by one size. Damping in proportion to the diagonal of H
/// would let a direction whose derivative has almost vanished run away.
fn batch_solver() -> LevenbergMarquardt {
    LevenbergMarquardt { diagonal: DiagonalLimits::EVEN, ..LevenbergMarquardt::default() }
}
