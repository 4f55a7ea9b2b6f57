//! The cost at the estimate, and shorter steps if it has risen.
use super::Steps;
use crate::model::Model;
use manifactor_graph::batch::Evaluation;
use smallvec::SmallVec;
use std::collections::BTreeMap;

/// Largest number of halvings of a step.
const MAX_HALVINGS: usize = 6;
/// Smallest damping of a variable, as a share of the largest entry of its diagonal of H, and the factor by
/// which it grows.
const MIN_DAMPING: f64 = 1e-3;
const DAMPING_GROWTH: f64 = 10.0;
/// Factor by which each relinearization of the variable reduces the damping.
const DAMPING_DECAY: f64 = 0.1;
/// Damping that has almost no effect, as a share of that entry. It stays if a direction has less of H than
/// this. An axis that has almost vanished has nearly no derivative, and its steps would be long again without
/// damping.
const NEGLIGIBLE_DAMPING: f64 = 1e-5;
/// A smaller rise, as a share of the cost, is rounding error or the effect of changes that were not
/// propagated.
const COST_TOLERANCE: f64 = 1e-3;

impl Steps {
    /// Returns the steps before the last pass, for the variables that it has moved.
    pub(in crate::smoother) fn before(&self, model: &Model) -> impl Iterator<Item = (u32, &[f64])> {
        self.moved.iter().map(|(v, first)| (*v, &self.before[*first..*first + model.blocks.dim(*v)]))
    }

    /// Returns whether the factors around some variables cost more now than with these steps.
    pub(in crate::smoother) fn has_risen(
        &mut self,
        model: &mut Model,
        before: &BTreeMap<u32, SmallVec<[f64; 9]>>,
    ) -> bool {
        let moved: Vec<u32> = before.keys().copied().collect();
        let mut factors = model.factors_of(&moved);
        factors.retain(|f| model.is_whole(*f));
        let after = self.cost_of(model, &factors);
        let mut now = before.clone();
        self.exchange(model, &mut now);
        let cost = self.cost_of(model, &factors);
        self.exchange(model, &mut now);
        rises(&cost, &after)
    }

    fn exchange(&mut self, model: &Model, steps: &mut BTreeMap<u32, SmallVec<[f64; 9]>>) {
        for (v, step) in steps {
            self.delta[model.blocks.range(*v)].swap_with_slice(step);
        }
    }

    /// Halves the last step until it no longer raises the cost of the surrounding factors. Returns the number
    /// of halvings.
    pub(in crate::smoother) fn shorten(&mut self, model: &mut Model) -> usize {
        let (factors, before, after) = self.last_step(model);
        if !rises(&before, &after) {
            return 0;
        }
        for halvings in 1..=MAX_HALVINGS {
            for (v, first) in &self.moved {
                let range = model.blocks.range(*v);
                let old = &self.before[*first..*first + range.len()];
                self.delta[range].iter_mut().zip(old).for_each(|(new, old)| *new = 0.5 * (*new + old));
            }
            let after = self.cost_of(model, &factors);
            if !rises(&before, &after) {
                return halvings;
            }
        }
        MAX_HALVINGS
    }

    /// Returns the factors around the variables that the last pass has moved, and their cost before and after
    /// it.
    pub(in crate::smoother) fn last_step(&mut self, model: &mut Model) -> (Vec<u32>, Evaluation, Evaluation) {
        let moved: Vec<u32> = self.moved().collect();
        let mut factors = model.factors_of(&moved);
        factors.retain(|f| model.is_whole(*f));
        let after = self.cost_of(model, &factors);
        self.exchange_steps(model);
        let before = self.cost_of(model, &factors);
        self.exchange_steps(model);
        (factors, before, after)
    }

    /// Exchanges the steps of the last pass with the ones before it.
    fn exchange_steps(&mut self, model: &Model) {
        for (v, first) in &self.moved {
            let range = model.blocks.range(*v);
            let old = &mut self.before[*first..*first + range.len()];
            self.delta[range].swap_with_slice(old);
        }
    }

    /// Returns the cost of factors at the estimate.
    pub(in crate::smoother) fn cost_of(&self, model: &mut Model, factors: &[u32]) -> Evaluation {
        self.at_estimate(model, factors, |model, delta| model.cost(factors, Some(delta)))
    }

    /// Evaluates the model while the trial points of the factors' variables are at the estimate.
    pub(in crate::smoother) fn at_estimate<T>(
        &self,
        model: &mut Model,
        factors: &[u32],
        evaluate: impl FnOnce(&Model, &[f64]) -> T,
    ) -> T {
        let mut variables: Vec<u32> =
            factors.iter().filter_map(|f| model.factor(*f)).flat_map(|f| f.variables()).collect();
        variables.sort_unstable();
        variables.dedup();
        for v in &variables {
            model.try_step(*v, &self.delta[model.blocks.range(*v)]);
        }
        let result = evaluate(model, &self.delta);
        variables.iter().for_each(|v| model.reset_trial(*v));
        result
    }

    /// Increases the damping of some variables.
    pub(in crate::smoother) fn damp(&mut self, model: &mut Model, variables: &[u32]) {
        for v in variables {
            let least = MIN_DAMPING * largest(model, *v);
            model.blocks.damp(*v, (DAMPING_GROWTH * model.blocks.damping(*v)).max(least));
            self.damped.insert(*v);
        }
    }

    /// Decreases the damping of relinearized variables. Returns their previous damping.
    pub(in crate::smoother) fn relax(&mut self, model: &mut Model, variables: &[u32]) -> Vec<(u32, f64)> {
        let damped = variables.iter().filter(|v| self.damped.contains(v));
        let before: Vec<(u32, f64)> = damped.map(|v| (*v, model.blocks.damping(*v))).collect();
        for (v, damping) in &before {
            let (weak, weaker) = (NEGLIGIBLE_DAMPING * largest(model, *v), DAMPING_DECAY * damping);
            if weaker > weak {
                model.blocks.damp(*v, weaker);
            } else {
                self.damped.remove(v);
                model.blocks.damp(*v, if smallest(model, *v) < weak { weak } else { 0.0 });
            }
        }
        before
    }
}

fn rises(before: &Evaluation, after: &Evaluation) -> bool {
    let is_lower = after.cost <= before.cost * (1.0 + COST_TOLERANCE);
    // also true if the cost is NaN
    after.became_undefined > before.became_undefined || !is_lower
}

/// Returns the largest diagonal entry of H of a variable.
fn largest(model: &Model, variable: u32) -> f64 {
    let precision = model.blocks.precision(variable).iter().copied().fold(0.0, f64::max);
    precision * precision
}

/// Returns the smallest diagonal entry of H of the directions that are not held.
fn smallest(model: &Model, variable: u32) -> f64 {
    let held = model.record(variable).held;
    let precision = model.blocks.precision(variable).iter().enumerate();
    let free = precision.filter(|(d, _)| held >> d & 1 == 0).map(|(_, precision)| *precision);
    let least = free.fold(f64::INFINITY, f64::min);
    least * least
}
