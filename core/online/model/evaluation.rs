//! Factors at the trial points, and variables on their way to these: a few of each.
use super::{Factor, Model};
use manifactor_graph::Variable;
use manifactor_graph::batch::Evaluation;
use smallvec::SmallVec;

impl Model {
    /// Linearizes factors at the trial points, batch by batch. What they had is gone; at the same points, they have the same
    /// bits again.
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
            total = total.and(self.batches.as_mut_slice()[b].linearize_at(indices, &self.trial, to));
            indices.clear();
        }
        self.listed = listed;
        if total.not_finite.is_none() {
            total.not_finite = factors.iter().find(|f| !self.is_finite(**f)).map(|f| *f as usize);
        }
        total
    }

    /// Whether a factor's part of H and g is finite.
    pub(crate) fn is_finite(&self, factor: u32) -> bool {
        self.factor(factor).is_none_or(|factor| self.regions.is_finite(factor.region))
    }

    /// The factors of some variables, ascending.
    pub(crate) fn factors_of(&self, variables: &[u32]) -> Vec<u32> {
        let mut factors: Vec<u32> = variables.iter().flat_map(|v| self.blocks.factors(*v)).collect();
        factors.sort_unstable();
        factors.dedup();
        factors
    }

    /// The cost of factors at the trial points, over those that took part in their last linearization. It is summed in the
    /// order of `factors`, one by one: where they are in their batches depends on history.
    /// `delta` are the steps to the trial points, by scalar of all variables; `None` where these are the linearization points.
    pub(crate) fn cost(&self, factors: &[u32], delta: Option<&[f64]>) -> Evaluation {
        let factors = factors.iter().filter_map(|f| self.factor(*f));
        let one = |factor: &Factor| match factor.entry.is_some() {
            true => self.batches.as_slice()[factor.batch as usize].cost_at(&[factor.index], &self.trial),
            false => self.prior_cost(factor, delta),
        };
        factors.map(one).fold(Evaluation::default(), Evaluation::and)
    }

    /// Makes the sums anew that a changed factor is part of.
    pub(crate) fn sum_up(&mut self) {
        self.blocks.sum_up(&self.regions);
    }

    /// A variable's own block of H over the factors that `counts` names; see [`Blocks::own_block`].
    pub(crate) fn own_block(&self, variable: u32, counts: impl Fn(u32) -> bool) -> SmallVec<[f64; 36]> {
        self.blocks.own_block(variable, &self.regions, counts)
    }

    /// Moves the trial point of a variable by a step from its linearization point.
    pub(crate) fn try_step(&mut self, variable: u32, step: &[f64]) {
        let (column, index) = self.places[variable as usize].in_columns();
        self.trial.column_mut(column).retract_at(self.points.column(column), index, step);
    }

    /// The same, to linearize there: the point is as its text says. One that comes of a step may know more, a cosine that was
    /// not taken of its angle, say, and would have other bits after it was saved and loaded.
    pub(crate) fn try_point(&mut self, variable: u32, step: &[f64]) {
        self.try_step(variable, step);
        let (column, index) = self.places[variable as usize].in_columns();
        let trial = self.trial.column_mut(column);
        let point = trial.get(index).and_then(|point| plain(&*point));
        if let Some(point) = point {
            trial.set(index, &*point);
        }
    }

    /// Puts the trial point of a variable back to its linearization point.
    pub(crate) fn reset_trial(&mut self, variable: u32) {
        let (column, index) = self.places[variable as usize].in_columns();
        self.trial.column_mut(column).copy_at(self.points.column(column), index);
    }

    /// Makes the trial point of a variable its linearization point.
    pub(crate) fn accept(&mut self, variable: u32) {
        let (column, index) = self.places[variable as usize].in_columns();
        self.points.column_mut(column).copy_at(self.trial.column(column), index);
    }
}

/// The same point, by a step of zero.
pub(super) fn plain(point: &dyn Variable) -> Option<Box<dyn Variable>> {
    let zeros: SmallVec<[f64; 9]> = SmallVec::from_elem(0.0, point.erased().dim());
    point.erased().retract(&zeros)
}
