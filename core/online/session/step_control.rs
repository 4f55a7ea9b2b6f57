//! Steps that are too long, so that the true cost rises. Where a few variables step far, what is known of them is little: they are
//! damped one by one, as Levenberg and Marquardt damp all. Where many do, a loop moves as a whole: half the way is tried, and half
//! of that. At last, a batch solve.
//!
//! A variable is damped by λ on the diagonal of its block of H, a prior at its linearization point. That moves no minimum: each update
//! linearizes the variable anew, with less damping.
use super::Session;
use super::changes::Touched;
use super::parking::Moves;
use crate::model::Model;
use crate::report::Report;
use manifactor_graph::batch::Evaluation;
use manifactor_solve::{DiagonalLimits, LevenbergMarquardt, Silent};
use smallvec::SmallVec;
use std::collections::BTreeMap;

/// Variables that are damped at most; more are a loop.
const FEW: usize = 16;
/// Halvings of a step.
const HALVINGS: usize = 6;
/// Rounds of such halvings before a batch solve, and rounds of damping.
const ROUNDS: usize = 3;
const DAMPINGS: usize = 6;
/// The least damping of a variable, as a share of the largest entry of its diagonal of H; and by how much it grows.
const LEAST_DAMPING: f64 = 1e-3;
const STRONGER: f64 = 10.0;
/// What becomes of it each time that the variable is linearized anew.
const WEAKER: f64 = 0.1;
/// Damping that is as good as none, as a share of that entry. It stays where a direction has less of H than that: an axis that has all
/// but vanished has next to no derivative, and without damping its steps would be as long as ever.
const WEAK: f64 = 1e-5;
/// A rise of the cost by less than this share of it is rounding, or what was not passed on.
const RISE: f64 = 1e-3;
/// A rise by less than this share is rounding.
const ROUNDING: f64 = 1e-12;

impl Session {
    /// Shortens steps that have raised the cost of the factors around. It examines only steps far outside of the region of their
    /// linearization, as one shorter step does little harm. Many of them can: Gauss-Newton may circle around a minimum for ever.
    /// An idle update therefore examines all steps, and solves a batch if the cost has risen.
    pub(super) fn control_step(&mut self, report: &mut Report) {
        if self.is_idle {
            let (_, before, after) = self.last_step();
            if after.left > before.left || after.cost > before.cost * (1.0 + ROUNDING) {
                report.solved_batch |= self.settle(report);
            }
        } else if !self.steady(report) {
            report.solved_batch = self.settle(report);
        }
    }

    /// Shortens long steps that have raised the cost; whether it has ceased to rise.
    pub(super) fn steady(&mut self, report: &mut Report) -> bool {
        !self.is_urgent() || if self.urgent.len() > FEW { self.halve(report) } else { self.damp(report) }
    }

    /// Halves the last step, and linearizes there.
    fn halve(&mut self, report: &mut Report) -> bool {
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

    /// Damps variables whose steps are far too long, as long as the cost of the factors around has risen since before; whether
    /// it has ceased to.
    fn damp(&mut self, report: &mut Report) -> bool {
        let mut before: BTreeMap<u32, SmallVec<[f64; 9]>> = BTreeMap::new();
        for _ in 0..DAMPINGS {
            for (v, first) in &self.moved {
                let old = &self.before[*first..*first + self.model.blocks.dim(*v)];
                before.entry(*v).or_insert_with(|| SmallVec::from_slice(old));
            }
            if !self.is_urgent() || !self.has_risen(&before) {
                return true;
            }
            let urgent = self.urgent.clone();
            for v in &urgent {
                let least = LEAST_DAMPING * self.largest(*v);
                self.model.blocks.damp(*v, (STRONGER * self.model.blocks.damping(*v)).max(least));
                self.damped.insert(*v);
            }
            report.damped += urgent.len();
            let touched = Touched { variables: urgent, ..Touched::default() };
            if self.pass(&touched, &Moves::default(), false, report).is_err() {
                return true;
            }
        }
        !(self.is_urgent() && self.has_risen(&before))
    }

    /// The largest entry of a variable's diagonal of H.
    fn largest(&self, variable: u32) -> f64 {
        let precision = self.model.blocks.precision(variable).iter().copied().fold(0.0, f64::max);
        precision * precision
    }

    /// The smallest entry of those directions that are not held.
    fn smallest(&self, variable: u32) -> f64 {
        let held = self.model.place(variable).held;
        let precision = self.model.blocks.precision(variable).iter().enumerate();
        let free = precision.filter(|(d, _)| held >> d & 1 == 0).map(|(_, precision)| *precision);
        let least = free.fold(f64::INFINITY, f64::min);
        least * least
    }

    /// Whether the factors around some variables cost more than with these steps.
    fn has_risen(&mut self, before: &BTreeMap<u32, SmallVec<[f64; 9]>>) -> bool {
        let moved: Vec<u32> = before.keys().copied().collect();
        let mut factors = self.model.factors_of(&moved);
        factors.retain(|f| self.model.is_whole(*f));
        let after = self.cost_of(&factors);
        let mut now = before.clone();
        for (v, step) in &mut now {
            self.delta[self.model.blocks.range(*v)].swap_with_slice(step);
        }
        let cost = self.cost_of(&factors);
        for (v, step) in &mut now {
            self.delta[self.model.blocks.range(*v)].swap_with_slice(step);
        }
        rises(&cost, &after)
    }

    /// Halves the last step until it lowers the cost of the factors around; whether it had to be.
    fn shorten(&mut self, report: &mut Report) -> bool {
        let (factors, before, after) = self.last_step();
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

    /// The factors around the variables that the last pass has moved, and their cost before and after it.
    fn last_step(&mut self) -> (Vec<u32>, Evaluation, Evaluation) {
        let moved: Vec<u32> = self.moved.iter().map(|(v, _)| *v).collect();
        let mut factors = self.model.factors_of(&moved);
        factors.retain(|f| self.model.is_whole(*f));
        let after = self.cost_of(&factors);
        self.exchange_steps();
        let before = self.cost_of(&factors);
        self.exchange_steps();
        (factors, before, after)
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
        self.at_estimate(factors, |model, delta| model.cost(factors, Some(delta)))
    }

    /// Evaluates the model while the trial points of these factors' variables are at the estimate.
    pub(super) fn at_estimate<T>(
        &mut self,
        factors: &[u32],
        evaluate: impl FnOnce(&Model, &[f64]) -> T,
    ) -> T {
        let mut variables: Vec<u32> =
            factors.iter().filter_map(|f| self.model.factor(*f)).flat_map(|f| f.variables()).collect();
        variables.sort_unstable();
        variables.dedup();
        for v in &variables {
            self.model.try_step(*v, &self.delta[self.model.blocks.range(*v)]);
        }
        let result = evaluate(&self.model, &self.delta);
        variables.iter().for_each(|v| self.model.reset_trial(*v));
        result
    }

    /// Damps less those variables that are linearized anew; what they were damped by.
    pub(super) fn relax(&mut self, variables: &[u32]) -> Vec<(u32, f64)> {
        let damped = variables.iter().filter(|v| self.damped.contains(v));
        let before: Vec<(u32, f64)> = damped.map(|v| (*v, self.model.blocks.damping(*v))).collect();
        for (v, damping) in &before {
            let (weak, weaker) = (WEAK * self.largest(*v), WEAKER * damping);
            if weaker > weak {
                self.model.blocks.damp(*v, weaker);
            } else {
                self.damped.remove(v);
                self.model.blocks.damp(*v, if self.smallest(*v) < weak { weak } else { 0.0 });
            }
        }
        before
    }

    /// Solves all of it as one batch from the estimate, and goes on from there; whether the cost has fallen.
    pub(super) fn settle(&mut self, report: &mut Report) -> bool {
        let Ok(finished) = self.finish(&batch_solver(), &mut Silent) else { return false };
        finished.outcome.final_cost < finished.outcome.initial_cost
            && self.adopt(&finished.values, report).is_ok()
    }
}

fn rises(before: &Evaluation, after: &Evaluation) -> bool {
    let is_lower = after.cost <= before.cost * (1.0 + RISE);
    // not a number is not lower either
    after.left > before.left || !is_lower
}

/// Damping of one size for all directions, as above: in proportion to the diagonal of H, a direction that has all but lost its
/// derivative would go for good.
fn batch_solver() -> LevenbergMarquardt {
    LevenbergMarquardt { diagonal: DiagonalLimits::EVEN, ..LevenbergMarquardt::default() }
}
