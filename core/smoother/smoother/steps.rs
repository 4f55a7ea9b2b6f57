//! The steps δ from the linearization points to the estimate.
mod control;

use super::factorization::Factorization;
use crate::elimination_tree::RebuiltFronts;
use crate::model::Model;
use std::collections::BTreeSet;

/// The steps of all variables, as last propagated.
#[derive(Debug, Default)]
pub(super) struct Steps {
    /// By scalar of all variables.
    delta: Vec<f64>,
    /// By variable: the pass in which its step last changed.
    changed: Vec<u64>,
    pass: u64,
    /// Variables whose steps the last pass has changed, and the position of each old step in `before`.
    moved: Vec<(u32, usize)>,
    before: Vec<f64>,
    /// Variables whose steps are damped.
    damped: BTreeSet<u32>,
}

impl Steps {
    /// Makes room for all variables of the model.
    pub(super) fn resize(&mut self, model: &Model, variables: usize) {
        self.delta.resize(model.blocks.scalars(), 0.0);
        self.changed.resize(variables, 0);
    }

    /// Returns the steps of all variables, by scalar.
    pub(super) fn all(&self) -> &[f64] {
        &self.delta
    }

    /// Restores the steps of all variables.
    pub(super) fn restore(&mut self, delta: Vec<f64>) {
        self.delta = delta;
    }

    /// Returns the step of a variable.
    pub(super) fn of(&self, model: &Model, variable: u32) -> &[f64] {
        &self.delta[model.blocks.range(variable)]
    }

    /// Sets the step of a variable.
    pub(super) fn set(&mut self, model: &Model, variable: u32, step: &[f64]) {
        self.delta[model.blocks.range(variable)].copy_from_slice(step);
    }

    /// Sets the step of a variable to zero.
    pub(super) fn clear(&mut self, model: &Model, variable: u32) {
        self.delta[model.blocks.range(variable)].fill(0.0);
    }

    /// Returns whether a variable has a step other than zero.
    pub(super) fn has_step(&self, model: &Model, variable: u32) -> bool {
        model.record(variable).is_present && self.of(model, variable).iter().any(|step| *step != 0.0)
    }

    /// Returns the linearization error of a variable due to the length of its step, as a share of
    /// `threshold`.
    pub(super) fn excess(&self, model: &Model, variable: u32, threshold: f64) -> f64 {
        let steps = self.of(model, variable).iter().zip(model.blocks.precision(variable));
        steps.map(|(step, precision)| step * step * precision / threshold).fold(0.0, f64::max)
    }

    /// Returns the variables whose steps the last pass has changed.
    pub(super) fn moved(&self) -> impl Iterator<Item = u32> {
        self.moved.iter().map(|(v, _)| *v)
    }

    /// Back-substitutes from the root downwards while steps change by more than `wildfire_threshold`. It
    /// visits the new fronts and the fronts below them whose rows have changed, or all fronts if `rebuilt` is
    /// `None`. Returns the number of solved variables.
    pub(super) fn solve(
        &mut self,
        model: &Model,
        factorization: &mut Factorization,
        rebuilt: Option<&RebuiltFronts>,
        wildfire_threshold: f64,
    ) -> usize {
        self.pass += 1;
        self.moved.clear();
        self.before.clear();
        let mut solved = 0;
        let mut open: Vec<u32> = vec![];
        match rebuilt {
            None => open.extend(factorization.roots()),
            Some(rebuilt) => {
                let new = rebuilt.new.iter().rev();
                solved += new
                    .map(|f| self.solve_front(model, factorization, *f, wildfire_threshold))
                    .sum::<usize>();
                open.extend(rebuilt.kept.iter().map(|(kept, _)| *kept));
            }
        }
        while let Some(f) = open.pop() {
            let (rows, children) = factorization.below(f);
            if rebuilt.is_none() || rows.iter().any(|row| self.changed[*row as usize] == self.pass) {
                open.extend_from_slice(children);
                solved += self.solve_front(model, factorization, f, wildfire_threshold);
            }
        }
        solved
    }

    fn solve_front(
        &mut self,
        model: &Model,
        factorization: &mut Factorization,
        front: u32,
        wildfire_threshold: f64,
    ) -> usize {
        let Self { delta, changed, moved, before, .. } = self;
        let (variables, mut x) = factorization.solve(model, front, delta);
        for v in variables {
            let range = model.blocks.range(*v);
            let (step, rest) = x.split_at(range.len());
            x = rest;
            // compared with the last propagated step, so that small changes add up
            let old = &mut delta[range];
            let precision = model.blocks.precision(*v);
            let mut changes = step.iter().zip(&*old).zip(precision);
            if changes.any(|((new, old), precision)| (new - old).abs() * precision > wildfire_threshold) {
                moved.push((*v, before.len()));
                before.extend_from_slice(old);
                old.copy_from_slice(step);
                changed[*v as usize] = self.pass;
            }
        }
        variables.len()
    }

    /// Returns the variables whose steps are damped.
    pub(super) fn damped(&self) -> impl Iterator<Item = u32> {
        self.damped.iter().copied()
    }

    /// Returns whether a variable's steps are damped.
    pub(super) fn is_damped(&self, variable: u32) -> bool {
        self.damped.contains(&variable)
    }

    /// Marks the steps of a variable as damped.
    pub(super) fn mark_damped(&mut self, variable: u32) {
        self.damped.insert(variable);
    }

    /// Forgets a variable.
    pub(super) fn forget(&mut self, model: &Model, variable: u32) {
        self.clear(model, variable);
        self.damped.remove(&variable);
    }
}
