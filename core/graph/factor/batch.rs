//! Batches: factors of one concrete type, stored contiguously.
mod augmentation;
mod batches;
mod change;
mod pass;
mod threads;

use crate::algebra::{Block, Dimension};
use crate::factor::kernel::Kernel;
use crate::loss::{Loss, LossColumn};
use crate::noise::{Whitener, Whiteners};
use crate::residual::normal_equations::{NormalEquations, Slot};
use crate::variable::column::{Columns, FIXED};
use augmentation::Augmentation;
use pass::{CHUNK, COST_SHARE, Work};
use pulp::Arch;
use std::any::Any;
use std::time::Instant;

pub use batches::Batches;

/// A factor to be added to a batch.
pub struct Member<'a> {
    /// Index in the graph.
    pub entry: usize,
    /// The residual.
    pub factor: &'a dyn Any,
    /// Index of each variable in its column.
    pub index: &'a [u32],
    /// Start of each variable in the linear system; [`FIXED`] for fixed variables.
    pub starts: &'a [u32],
    /// For each variable, one bit per tangent direction: set if the direction is fixed.
    pub fixed: &'a [u32],
    /// Slots of its blocks in H.
    pub slots: &'a [Slot],
    /// Its noise.
    pub whitener: &'a Whitener,
    /// Its loss.
    pub loss: Option<&'a dyn Loss>,
}

/// Result of a pass over factors.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Evaluation {
    /// ½ Σ ρ(‖r‖²) over the active factors.
    pub cost: f64,
    /// Number of factors that were undefined at the last linearization, and so are excluded.
    pub inactive: usize,
    /// Number of active factors that are undefined at these values.
    pub became_undefined: usize,
    /// Index in the graph of a factor whose cost is not finite.
    pub not_finite: Option<usize>,
}

impl Evaluation {
    /// Returns the sum of both evaluations. `not_finite` comes from `self` if both have one.
    #[must_use]
    pub fn merge(self, other: Self) -> Self {
        Self {
            cost: self.cost + other.cost,
            inactive: self.inactive + other.inactive,
            became_undefined: self.became_undefined + other.became_undefined,
            not_finite: self.not_finite.or(other.not_finite),
        }
    }
}

/// State of one factor, for reports.
#[derive(Debug, Clone, PartialEq)]
pub struct FactorState {
    /// Index in the graph.
    pub entry: usize,
    /// Whether it is defined at these values.
    pub defined: bool,
    /// The unwhitened residual.
    pub residual: Vec<f64>,
    /// The residual in standard deviations.
    pub whitened: Vec<f64>,
    /// Weight given by the loss; 1 without a loss.
    pub weight: f64,
    /// ½ρ(‖whitened‖²); zero if the factor is undefined.
    pub cost: f64,
}

/// The whitened Jacobian of one factor, each row scaled by the square root of the robust weight.
#[derive(Debug)]
pub struct FactorRows<'a> {
    /// Index in the graph.
    pub entry: usize,
    /// Whitened and weighted residual.
    pub residual: &'a [f64],
    /// One entry per free variable: its start in the linear system, and its block, column-major.
    pub blocks: Vec<(usize, Vec<f64>)>,
}

/// All factors with the same residual type, kind of noise and type of loss.
pub trait Batch: Send + Sync {
    /// Returns the number of factors.
    fn len(&self) -> usize;
    /// Returns whether the batch is empty.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Returns whether noise and loss of a factor fit this batch. The factor must have the batch's residual
    /// type.
    fn fits(&self, noise: &Whitener, loss: Option<&dyn Loss>) -> bool;
    /// Returns whether the parameters of a factor fit this batch. True by default; a batch that is
    /// evaluated in one call requires equal parameters.
    fn accepts_parameters(&self, _factor: &dyn Any) -> bool {
        true
    }
    /// Reserves room for `factors` more factors, with `variables` variables in total.
    fn reserve(&mut self, factors: usize, variables: usize);
    /// Adds a factor of this batch's type. A factor of a different type is ignored.
    fn push(&mut self, member: &Member<'_>);
    /// Returns the residual of factor `index` of the batch; `None` if its type leaves the number of rows
    /// open.
    fn residual_mut(&mut self, index: usize) -> Option<&mut dyn Any>;
    /// Sets the noise of factor `index` of the batch. Returns `false` if the noise is of a different kind.
    fn set_noise(&mut self, index: usize, noise: &Whitener) -> bool;
    /// Decides which factors are active, and adds their contributions to H and g.
    fn linearize(&mut self, columns: &Columns, to: &mut NormalEquations<'_>) -> Evaluation;
    /// Evaluates the cost of the factors that were active at the last linearization.
    fn cost(&self, columns: &Columns) -> Evaluation;
    /// Visits the factors that were undefined at the last linearization, by index in the graph.
    fn inactive(&self, visit: &mut dyn FnMut(usize));
    /// Writes ½ρ of each factor to `to`, by index in the graph, without the factor's weight; zero if it is
    /// undefined.
    fn costs(&self, columns: &Columns, to: &mut [f64]);
    /// Sets the weight of each factor, by index in the graph. It multiplies the weight of the loss.
    fn set_weights(&mut self, weights: &[f64]);
    /// Replaces the whitened residual r of factor `index` of the batch by `scale * r + shift`. The state of the
    /// factor and its residual in reports stay.
    fn augment(&mut self, index: usize, scale: f64, shift: &[f64]);
    /// Returns the state of each factor, in the order of the batch.
    fn inspect(&self, columns: &Columns) -> Vec<FactorState>;
    /// Visits the Jacobian rows of each defined factor.
    fn rows(&self, columns: &Columns, visit: &mut dyn FnMut(FactorRows<'_>));

    /// Removes factor `index` of the batch; the last factor takes its place. Returns the graph index of the
    /// moved factor, or `None` if the removed factor was the last. O(1) if all factors have the same number
    /// of variables.
    fn remove(&mut self, index: usize) -> Option<usize>;
    /// Like [`linearize`](Self::linearize), for the factors at these indices in the batch, ascending.
    fn linearize_at(
        &mut self,
        indices: &[u32],
        columns: &Columns,
        to: &mut NormalEquations<'_>,
    ) -> Evaluation;
    /// Like [`cost`](Self::cost), for the factors at these indices in the batch, ascending.
    fn cost_at(&self, indices: &[u32], columns: &Columns) -> Evaluation;
    /// Appends the robust weights of the factors at these indices in the batch, ascending: 1 without a
    /// loss, 0 if the factor is undefined.
    fn robust_weights_at(&self, indices: &[u32], columns: &Columns, to: &mut Vec<f64>);
    /// Sets the weight of factor `index` of the batch.
    fn set_weight(&mut self, index: usize, weight: f64);
    /// Sets the fixed variables and directions of factor `index` of the batch: see [`Member::starts`] and
    /// [`Member::fixed`].
    fn set_fixed(&mut self, index: usize, starts: &[u32], fixed: &[u32]);
    /// Returns whether factor `index` was defined at its last linearization.
    fn is_active(&self, index: usize) -> bool;
}

/// The batch of a residual type.
pub(crate) struct BatchOf<F: Kernel> {
    factors: Vec<F>,
    entries: Vec<u32>,
    /// The variables of factor i are `ends[i-1]..ends[i]` of `index`, `starts`, `free` and `fixed`.
    ends: Vec<u32>,
    index: Vec<u32>,
    starts: Vec<u32>,
    free: Vec<bool>,
    /// Empty if no direction of any variable is fixed.
    fixed: Vec<u32>,
    slot_ends: Vec<u32>,
    slots: Vec<Slot>,
    whiteners: Whiteners<F::Dim>,
    losses: Option<Box<dyn LossColumn>>,
    /// Weight of each factor, which multiplies its cost; empty if no weights were set.
    weights: Vec<f64>,
    /// Scale and shift of each residual; empty if none was set.
    augmentations: Vec<Augmentation<F::Dim>>,
    active: Vec<bool>,
    /// One entry per chunk of the current window and of the next one, for threads. Empty until first used.
    work: [Vec<Work<F>>; 2],
    /// Duration of the last single-threaded linearization, in seconds.
    alone: f64,
    /// SIMD level of the CPU: loops over block entries are compiled for each register width.
    arch: Arch,
}

impl<F: Kernel> BatchOf<F> {
    /// Makes an empty batch for factors with this noise and loss.
    pub(crate) fn new(noise: &Whitener, loss: Option<&dyn Loss>) -> Self {
        Self {
            factors: vec![],
            entries: vec![],
            ends: vec![],
            index: vec![],
            starts: vec![],
            free: vec![],
            fixed: vec![],
            slot_ends: vec![],
            slots: vec![],
            whiteners: Whiteners::like(noise),
            losses: loss.map(|l| l.erased().column()),
            weights: vec![],
            augmentations: vec![],
            active: vec![],
            work: [vec![], vec![]],
            alone: 0.0,
            arch: Arch::new(),
        }
    }

    #[inline(always)]
    fn range(ends: &[u32], i: usize) -> std::ops::Range<usize> {
        let first = if i == 0 { 0 } else { ends[i - 1] as usize };
        first..ends[i] as usize
    }
}

impl<F: Kernel> Batch for BatchOf<F> {
    fn len(&self) -> usize {
        self.factors.len()
    }

    fn fits(&self, noise: &Whitener, loss: Option<&dyn Loss>) -> bool {
        self.whiteners.fits(noise)
            && self.losses.as_ref().map(|l| l.loss_type()) == loss.map(|l| l.erased().as_any().type_id())
    }

    fn reserve(&mut self, factors: usize, variables: usize) {
        self.factors.reserve_exact(factors);
        self.entries.reserve_exact(factors);
        self.ends.reserve_exact(factors);
        self.index.reserve_exact(variables);
        self.starts.reserve_exact(variables);
        self.free.reserve_exact(variables);
        self.slot_ends.reserve_exact(factors);
        // exact if all factors have the same number of variables
        let each = variables / factors.max(1);
        self.slots.reserve_exact(factors * each * (each + 1) / 2);
        self.whiteners.reserve(factors);
        self.active.reserve_exact(factors);
    }

    fn push(&mut self, member: &Member<'_>) {
        let Some(factor) = F::of(member.factor) else { return };
        if !member.fixed.iter().all(|h| *h == 0) {
            self.fixed.resize(self.index.len(), 0);
            self.fixed.extend_from_slice(member.fixed);
        } else if !self.fixed.is_empty() {
            self.fixed.extend(member.index.iter().map(|_| 0));
        }
        self.factors.push(factor);
        self.entries.push(member.entry as u32);
        self.index.extend_from_slice(member.index);
        self.starts.extend_from_slice(member.starts);
        self.free.extend(member.starts.iter().map(|s| *s != FIXED));
        self.ends.push(self.index.len() as u32);
        self.slots.extend_from_slice(member.slots);
        self.slot_ends.push(self.slots.len() as u32);
        self.whiteners.push(member.whitener);
        if let (Some(losses), Some(loss)) = (&mut self.losses, member.loss) {
            losses.push(loss);
        }
        if !self.weights.is_empty() {
            self.weights.push(1.0);
        }
        if !self.augmentations.is_empty() {
            self.augmentations.push(Augmentation::none());
        }
        self.active.push(true);
    }

    fn residual_mut(&mut self, index: usize) -> Option<&mut dyn Any> {
        self.factors.get_mut(index).and_then(Kernel::residual_mut)
    }

    fn set_noise(&mut self, index: usize, noise: &Whitener) -> bool {
        self.whiteners.set(index, noise)
    }

    fn linearize(&mut self, columns: &Columns, to: &mut NormalEquations<'_>) -> Evaluation {
        let columns = F::columns(columns);
        let mut active = std::mem::take(&mut self.active);
        let total = if self.in_parallel(1.0) {
            let mut work = std::mem::take(&mut self.work);
            let mut total = Evaluation::default();
            threads::run_in_pool(&mut || {
                total = self.linearize_together(columns, &mut active, &mut work, to);
            });
            self.work = work;
            total
        } else {
            let clock = Instant::now();
            let total = self.linearize_alone(columns, &mut active, to);
            self.alone = clock.elapsed().as_secs_f64();
            total
        };
        self.active = active;
        total
    }

    fn cost(&self, columns: &Columns) -> Evaluation {
        let columns = F::columns(columns);
        let chunks = self.factors.len().div_ceil(CHUNK);
        if self.in_parallel(COST_SHARE) {
            let mut costs = vec![Evaluation::default(); chunks];
            threads::run_in_pool(&mut || self.chunk_costs(columns, 0, &mut costs));
            costs.into_iter().fold(Evaluation::default(), Evaluation::merge)
        } else {
            (0..chunks)
                .map(|n| self.chunk_cost(columns, n * CHUNK, self.chunk(n)))
                .fold(Evaluation::default(), Evaluation::merge)
        }
    }

    fn inactive(&self, visit: &mut dyn FnMut(usize)) {
        let entries = self.entries.iter().zip(&self.active);
        entries.filter(|(_, active)| !**active).for_each(|(entry, _)| visit(*entry as usize));
    }

    fn costs(&self, columns: &Columns, to: &mut [f64]) {
        let columns = F::columns(columns);
        for (i, entry) in self.entries.iter().enumerate() {
            let squared = self.squared(columns, i);
            to[*entry as usize] = squared.map_or(0.0, |s| self.robust(i, &mut [s]));
        }
    }

    fn set_weights(&mut self, weights: &[f64]) {
        self.weights.clear();
        self.weights.extend(self.entries.iter().map(|entry| weights[*entry as usize]));
    }

    fn augment(&mut self, index: usize, scale: f64, shift: &[f64]) {
        self.augmentations.resize_with(self.factors.len(), Augmentation::none);
        self.augmentations[index] = Augmentation::new(scale, shift);
    }

    fn inspect(&self, columns: &Columns) -> Vec<FactorState> {
        let columns = F::columns(columns);
        let one = |i: usize| {
            let x = self.factors[i].load(columns, &self.index[Self::range(&self.ends, i)]);
            let defined = self.factors[i].is_defined(x.clone());
            let value = self.factors[i].value(&x);
            let mut residual = value.as_ref().to_vec();
            let mut whitened = residual.clone();
            self.whiteners.whiten(i, &mut whitened);
            residual.truncate(self.factors[i].rows());
            whitened.truncate(residual.len());
            let mut weight = [if defined { whitened.iter().map(|x| x * x).sum() } else { 0.0 }];
            let cost = self.weights_from_norms(i, &mut weight, &[defined]);
            let cost = if defined { cost } else { 0.0 };
            FactorState {
                entry: self.entries[i] as usize,
                defined,
                residual,
                whitened,
                weight: weight[0],
                cost,
            }
        };
        (0..self.factors.len()).map(one).collect()
    }

    fn rows(&self, columns: &Columns, visit: &mut dyn FnMut(FactorRows<'_>)) {
        let columns = F::columns(columns);
        let mut work = Work::<F>::new();
        let mut active = self.active.clone();
        for (n, active) in active.chunks_mut(CHUNK).enumerate() {
            self.evaluate(columns, n * CHUNK, active, &mut work);
            for (k, _) in active.iter().enumerate().filter(|(_, active)| **active) {
                let i = n * CHUNK + k;
                let (starts, root) = (&self.starts[Self::range(&self.ends, i)], work.w[k].sqrt());
                let rows = self.factors[i].rows();
                work.r[k].as_mut_slice().iter_mut().for_each(|x| *x *= root);
                let mut blocks = vec![];
                F::each(&mut work.j[k], |a, block| {
                    if starts[a] != FIXED {
                        let columns = block.chunks_exact(F::Dim::N).flat_map(|column| &column[..rows]);
                        blocks.push((starts[a] as usize, columns.map(|x| x * root).collect()));
                    }
                });
                let residual = &work.r[k].as_slice()[..rows];
                visit(FactorRows { entry: self.entries[i] as usize, residual, blocks });
            }
        }
    }

    fn remove(&mut self, index: usize) -> Option<usize> {
        self.swap_remove(index)
    }

    fn linearize_at(
        &mut self,
        indices: &[u32],
        columns: &Columns,
        to: &mut NormalEquations<'_>,
    ) -> Evaluation {
        self.linearize_listed(indices, columns, to)
    }

    fn cost_at(&self, indices: &[u32], columns: &Columns) -> Evaluation {
        let columns = F::columns(columns);
        pass::runs(indices)
            .map(|(first, len)| self.chunk_cost(columns, first, len))
            .fold(Evaluation::default(), Evaluation::merge)
    }

    fn robust_weights_at(&self, indices: &[u32], columns: &Columns, to: &mut Vec<f64>) {
        let columns = F::columns(columns);
        to.extend(indices.iter().map(|i| {
            let i = *i as usize;
            let mut weight = [0.0];
            if let Some(squared) = self.squared(columns, i) {
                weight = [squared];
                self.robust(i, &mut weight);
            }
            weight[0]
        }));
    }

    fn set_weight(&mut self, index: usize, weight: f64) {
        self.weights.resize(self.factors.len(), 1.0);
        self.weights[index] = weight;
    }

    fn set_fixed(&mut self, index: usize, starts: &[u32], fixed: &[u32]) {
        self.set_fixed_directions(index, starts, fixed);
    }

    fn is_active(&self, index: usize) -> bool {
        self.active.get(index).is_some_and(|active| *active)
    }
}
