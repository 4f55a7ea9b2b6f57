//! Evaluation of a few factors at the trial points, and moves of a few trial points.
use super::{Factor, Model};
use manifactor_graph::Variable;
use manifactor_graph::batch::Evaluation;
use smallvec::SmallVec;
use std::collections::BTreeMap;

impl Model {
    /// Linearizes factors at the trial points, batch by batch, and overwrites their previous terms. Equal
    /// points give equal bits.
    pub(crate) fn linearize(&mut self, factors: &[u32]) -> Evaluation {
        let mut listed = std::mem::take(&mut self.listed);
        listed.resize_with(self.batches.as_slice().len(), Vec::new);
        for f in factors {
            let Some(factor) = self.factors.get(*f).filter(|factor| factor.entry.is_some()) else { continue };
            self.regions.clear(factor.region);
            self.blocks.mark_factor(&factor.members);
            listed[factor.batch as usize].push(factor.index);
        }
        let mut total = Evaluation::default();
        for (b, indices) in listed.iter_mut().enumerate().filter(|(_, indices)| !indices.is_empty()) {
            indices.sort_unstable();
            let to = &mut self.regions.normal_equations();
            total = total.merge(self.batches.as_mut_slice()[b].linearize_at(indices, &self.trial, to));
            indices.clear();
        }
        self.listed = listed;
        if total.not_finite.is_none() {
            total.not_finite = factors.iter().find(|f| !self.is_finite(**f)).map(|f| *f as usize);
        }
        total
    }

    /// Returns whether a factor's terms of H and g are finite.
    pub(crate) fn is_finite(&self, factor: u32) -> bool {
        self.factor(factor).is_none_or(|factor| self.regions.is_finite(factor.region))
    }

    /// Returns the factors of some variables, ascending.
    pub(crate) fn factors_of(&self, variables: &[u32]) -> Vec<u32> {
        let mut factors: Vec<u32> = variables.iter().flat_map(|v| self.blocks.factors(*v)).collect();
        factors.sort_unstable();
        factors.dedup();
        factors
    }

    /// Returns the cost of factors at the trial points, without factors that took no part in their last
    /// linearization.
    ///
    /// Terms are added in the order of `factors`, because positions in the batches depend on history. `delta`
    /// holds the steps to the trial points, by scalar of all variables. `None` means that the trial points
    /// are the linearization points.
    pub(crate) fn cost(&self, factors: &[u32], delta: Option<&[f64]>) -> Evaluation {
        let factors = factors.iter().filter_map(|f| self.factor(*f));
        let one = |factor: &Factor| match factor.entry.is_some() {
            true => self.batches.as_slice()[factor.batch as usize].cost_at(&[factor.index], &self.trial),
            false => self.prior_cost(factor, delta),
        };
        factors.map(one).fold(Evaluation::default(), Evaluation::merge)
    }

    /// Returns whether any factor has a robust loss.
    pub(crate) fn has_losses(&self) -> bool {
        self.robust > 0
    }

    /// Returns the change of each variable's gradient if robust weights are taken at the trial points instead
    /// of the linearization points. It is infinite if a weight rises from zero. `variables` ascend, and the
    /// results have their order.
    pub(crate) fn reweighed(&self, variables: &[u32], delta: &[f64]) -> Vec<SmallVec<[f64; 9]>> {
        let mut changes: Vec<SmallVec<[f64; 9]>> =
            variables.iter().map(|v| SmallVec::from_elem(0.0, self.blocks.dim(*v))).collect();
        let mut by_batch: BTreeMap<u32, Vec<(u32, u32)>> = BTreeMap::new();
        for f in self.factors_of(variables) {
            let Some(factor) = self.factor(f).filter(|factor| factor.is_robust()) else { continue };
            if self.is_whole(f) && self.takes_part(f) {
                by_batch.entry(factor.batch).or_default().push((factor.index, f));
            }
        }
        let mut by_factor = vec![];
        for (batch, mut members) in by_batch {
            members.sort_unstable();
            let indices: Vec<u32> = members.iter().map(|(index, _)| *index).collect();
            let (mut before, mut now) = (vec![], vec![]);
            let batch = &self.batches.as_slice()[batch as usize];
            batch.robust_weights_at(&indices, &self.points, &mut before);
            batch.robust_weights_at(&indices, &self.trial, &mut now);
            let weights = before.into_iter().zip(now);
            by_factor.extend(members.into_iter().zip(weights).map(|((_, f), weights)| (f, weights)));
        }
        by_factor.sort_unstable_by_key(|(f, _)| *f);
        for (f, (before, now)) in by_factor.into_iter().filter(|(_, (before, now))| before != now) {
            let Some(factor) = self.factor(f) else { continue };
            for (scalar, gradient) in self.gradient_of(factor, delta).into_iter().enumerate() {
                let member = factor.members.iter().rev().find(|(_, at)| *at as usize <= scalar);
                let Some((v, at)) = member else { continue };
                let Ok(place) = variables.binary_search(v) else { continue };
                let change = if before == 0.0 { f64::INFINITY } else { gradient * (now / before - 1.0) };
                changes[place][scalar - *at as usize] += change;
            }
        }
        changes
    }

    /// Returns g + Hδ of a factor alone, over its scalars.
    fn gradient_of(&self, factor: &Factor, delta: &[f64]) -> SmallVec<[f64; 18]> {
        let region = self.regions[factor.region];
        let n = region.scalars as usize;
        let of_variables = factor.members.iter().flat_map(|(v, _)| &delta[self.blocks.range(*v)]);
        let step: SmallVec<[f64; 18]> = of_variables.copied().collect();
        let mut g: SmallVec<[f64; 18]> = SmallVec::from_slice(&self.regions.g[region.g..region.g + n]);
        for c in 0..n {
            let column = &self.regions.h[region.column(c)..][..n - c];
            g[c] += column[0] * step[c];
            for r in c + 1..n {
                g[r] += column[r - c] * step[c];
                g[c] += column[r - c] * step[r];
            }
        }
        g
    }

    /// Recomputes the outdated sums.
    pub(crate) fn sum_up(&mut self) {
        self.blocks.sum_up(&self.regions);
    }

    /// Returns a variable's block of H over the factors that `counts` selects; see [`Blocks::own_block`].
    pub(crate) fn own_block(&self, variable: u32, counts: impl Fn(u32) -> bool) -> SmallVec<[f64; 36]> {
        self.blocks.own_block(variable, &self.regions, counts)
    }

    /// Moves the trial point of a variable by a step from its linearization point.
    pub(crate) fn try_step(&mut self, variable: u32, step: &[f64]) {
        let (column, index) = self.records[variable as usize].in_columns();
        self.trial.column_mut(column).retract_at(self.points.column(column), index, step);
    }

    /// Moves the trial point of a variable to a point where factors are linearized.
    ///
    /// The point is normalized to the value that its saved text gives. After a plain step it may hold more,
    /// for example a cosine that was not computed from its angle, and would have different bits after saving
    /// and loading.
    pub(crate) fn try_point(&mut self, variable: u32, step: &[f64]) {
        self.try_step(variable, step);
        let (column, index) = self.records[variable as usize].in_columns();
        let trial = self.trial.column_mut(column);
        let point = trial.get(index).and_then(|point| plain(&*point));
        if let Some(point) = point {
            trial.set(index, &*point);
        }
    }

    /// Resets the trial point of a variable to its linearization point.
    pub(crate) fn reset_trial(&mut self, variable: u32) {
        let (column, index) = self.records[variable as usize].in_columns();
        self.trial.column_mut(column).copy_at(self.points.column(column), index);
    }

    /// Sets the linearization point of a variable to its trial point.
    pub(crate) fn accept(&mut self, variable: u32) {
        let (column, index) = self.records[variable as usize].in_columns();
        self.points.column_mut(column).copy_at(self.trial.column(column), index);
    }
}

/// Normalizes a point by a step of zero.
pub(super) fn plain(point: &dyn Variable) -> Option<Box<dyn Variable>> {
    let zeros: SmallVec<[f64; 9]> = SmallVec::from_elem(0.0, point.erased().dim());
    point.erased().retract(&zeros)
}
