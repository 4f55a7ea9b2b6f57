//! Factors at the trial points, and variables on their way to these: a few of each.
use super::Model;
use manifactor_graph::batch::Evaluation;
use smallvec::SmallVec;

impl Model {
    /// Evaluates factors at the trial points, batch by batch, and sums the account up.
    fn evaluate(
        &mut self,
        factors: &[u32],
        mut of_batch: impl FnMut(&mut Self, usize, &[u32]) -> Evaluation,
    ) -> Evaluation {
        let mut listed = std::mem::take(&mut self.listed);
        listed.resize_with(self.batches.as_slice().len(), Vec::new);
        for f in factors {
            if let Some(factor) = &self.factors[*f as usize] {
                listed[factor.batch as usize].push(factor.index);
            }
        }
        let mut total = Evaluation::default();
        for (b, indices) in listed.iter_mut().enumerate().filter(|(_, indices)| !indices.is_empty()) {
            indices.sort_unstable();
            total = total.and(of_batch(self, b, indices));
            indices.clear();
        }
        self.listed = listed;
        total
    }

    /// Linearizes factors at the trial points. What they had is gone: see [`save`](Self::save).
    pub(crate) fn linearize(&mut self, factors: &[u32]) -> Evaluation {
        for f in factors {
            let Some(factor) = &self.factors[*f as usize] else { continue };
            self.numbers.clear(self.regions[*f as usize]);
            self.blocks.mark_factor(&factor.members);
        }
        let mut total = self.evaluate(factors, |model, batch, indices| {
            let to = &mut model.numbers.normal_equations();
            model.batches.as_mut_slice()[batch].linearize_at(indices, &model.trial, to)
        });
        if total.not_finite.is_none() {
            let is_bad = |f: &&u32| !self.numbers.is_finite(self.regions[**f as usize]);
            total.not_finite = factors.iter().find(is_bad).map(|f| *f as usize);
        }
        total
    }

    /// The cost of factors at the trial points, over those that took part in their last linearization.
    pub(crate) fn cost(&mut self, factors: &[u32]) -> Evaluation {
        self.evaluate(factors, |model, batch, indices| {
            model.batches.as_slice()[batch].cost_at(indices, &model.trial)
        })
    }

    /// What factors add to H and g, for [`restore`](Self::restore).
    pub(crate) fn save(&self, factors: &[u32]) -> Vec<f64> {
        let mut saved = vec![];
        factors.iter().for_each(|f| self.numbers.save(self.regions[*f as usize], &mut saved));
        saved
    }

    /// Puts back what factors added to H and g.
    pub(crate) fn restore(&mut self, factors: &[u32], saved: &[f64]) {
        let mut rest = saved;
        for f in factors {
            rest = self.numbers.restore(self.regions[*f as usize], rest);
            if let Some(factor) = &self.factors[*f as usize] {
                self.blocks.mark_factor(&factor.members);
            }
        }
    }

    /// Makes the sums anew that a changed factor is part of.
    pub(crate) fn sum_up(&mut self) {
        self.blocks.sum_up(&self.regions, &self.numbers);
    }

    /// A variable's own block of H over the factors that `counts` names; see [`Blocks::own_block`].
    pub(crate) fn own_block(&self, variable: u32, counts: impl Fn(u32) -> bool) -> SmallVec<[f64; 36]> {
        self.blocks.own_block(variable, &self.regions, &self.numbers, counts)
    }

    /// Moves the trial point of a variable by a step from its linearization point.
    pub(crate) fn try_step(&mut self, variable: u32, step: &[f64]) {
        let (column, index) = self.keys[variable as usize].in_columns();
        self.trial.column_mut(column).retract_at(self.points.column(column), index, step);
    }

    /// Puts the trial point of a variable back to its linearization point.
    pub(crate) fn reset_trial(&mut self, variable: u32) {
        let (column, index) = self.keys[variable as usize].in_columns();
        self.trial.column_mut(column).copy_at(self.points.column(column), index);
    }

    /// Makes the trial point of a variable its linearization point.
    pub(crate) fn accept(&mut self, variable: u32) {
        let (column, index) = self.keys[variable as usize].in_columns();
        self.points.column_mut(column).copy_at(self.trial.column(column), index);
    }
}
