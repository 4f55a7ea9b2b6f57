//! Steps that are too long, so that the true cost rises. Where a few variables step far, what is known of them is little: they are
//! damped one by one, as Levenberg and Marquardt damp all. Where many do, a loop moves as a whole: half the way is tried, and half
//! of that. At last, a batch solve.
//!
//! A variable is damped by λ on the diagonal of its block of H, a prior at its linearization point. That moves no minimum: each update
//! linearizes the variable anew, with less damping.
use super::Session;
use super::changes::Touched;
use super::undetermined::Moves;
use crate::report::Report;
use manifactor_solve::{DiagonalLimits, LevenbergMarquardt, Silent};
use smallvec::SmallVec;
use std::collections::BTreeMap;

/// Variables that are damped at most; more are a loop.
const FEW: usize = 16;
/// Rounds of such halvings before a batch solve, and rounds of damping.
const ROUNDS: usize = 3;
const DAMPINGS: usize = 6;
/// A rise by less than this share is rounding.
const ROUNDING: f64 = 1e-12;

impl Session {
    /// Shortens steps that have raised the cost of the factors around. It examines only steps far outside of the region of their
    /// linearization, as one shorter step does little harm. Many of them can: Gauss-Newton may circle around a minimum for ever.
    /// An idle update therefore examines all steps, and solves a batch if the cost has risen.
    pub(super) fn control_step(&mut self, report: &mut Report) {
        if self.schedule.is_idle() {
            let (_, before, after) = self.steps.last_step(&mut self.model);
            if after.left > before.left || after.cost > before.cost * (1.0 + ROUNDING) {
                report.solved_batch |= self.settle(report);
            }
        } else if !self.steady(report) {
            report.solved_batch = self.settle(report);
        }
    }

    /// Shortens long steps that have raised the cost; whether it has ceased to rise.
    pub(super) fn steady(&mut self, report: &mut Report) -> bool {
        !self.is_urgent()
            || if self.queue.urgent().len() > FEW { self.halve(report) } else { self.damp(report) }
    }

    /// Halves the last step, and linearizes there.
    fn halve(&mut self, report: &mut Report) -> bool {
        for _ in 0..ROUNDS {
            if !self.is_urgent() || !self.shorten(report) {
                return true;
            }
            // from the shorter step, linearized there
            let held = Touched { held: self.steps.moved().collect(), ..Touched::default() };
            if self.pass(&held, &Moves::default(), false, report).is_err() {
                return true;
            }
        }
        !(self.is_urgent() && self.shorten(report))
    }

    fn shorten(&mut self, report: &mut Report) -> bool {
        let halvings = self.steps.shorten(&mut self.model);
        report.halved += halvings;
        halvings > 0
    }

    /// Damps variables whose steps are far too long, as long as the cost of the factors around has risen since before; whether
    /// it has ceased to.
    fn damp(&mut self, report: &mut Report) -> bool {
        let mut before: BTreeMap<u32, SmallVec<[f64; 9]>> = BTreeMap::new();
        for _ in 0..DAMPINGS {
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
            if self.pass(&touched, &Moves::default(), false, report).is_err() {
                return true;
            }
        }
        !(self.is_urgent() && self.steps.has_risen(&mut self.model, &before))
    }

    /// Solves all of it as one batch from the estimate, and goes on from there; whether the cost has fallen.
    pub(super) fn settle(&mut self, report: &mut Report) -> bool {
        let Ok(finished) = self.finish(&batch_solver(), &mut Silent) else { return false };
        finished.outcome.final_cost < finished.outcome.initial_cost
            && self.adopt(&finished.values, report).is_ok()
    }
}

/// Damping of one size for all directions, as above: in proportion to the diagonal of H, a direction that has all but lost its
/// derivative would go for good.
fn batch_solver() -> LevenbergMarquardt {
    LevenbergMarquardt { diagonal: DiagonalLimits::EVEN, ..LevenbergMarquardt::default() }
}
