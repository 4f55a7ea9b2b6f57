//! Factors of one concrete type, side by side: the loop that runs.
use crate::column::{Columns, FIXED};
use crate::dimension::{Block, Dimension, Matrix};
use crate::kernel::Kernel;
use crate::loss::{Loss, LossColumn};
use crate::noise::{Whitener, Whiteners};
use crate::normal_equations::{NormalEquations, Places, Slot};
use nalgebra::U1;
use rayon::prelude::*;
use std::any::Any;

/// Factors in a chunk: one virtual call of a loss, and one task of a thread, serves this many.
const CHUNK: usize = 16;
/// Batches smaller than this are not worth a thread.
const PARALLEL: usize = 8 * CHUNK;

/// A factor on its way into a batch.
pub struct Member<'a> {
    /// Its place in the graph.
    pub entry: usize,
    /// The residual.
    pub factor: &'a dyn Any,
    /// Its variables' places in their columns.
    pub index: &'a [u32],
    /// Where its variables begin in the linear system; [`FIXED`] for those that are held.
    pub starts: &'a [u32],
    /// By variable, a bit for each tangent direction that is held.
    pub held: &'a [u32],
    /// Where its blocks of H go.
    pub slots: &'a [Slot],
    /// Its noise.
    pub whitener: &'a Whitener,
    /// Its loss.
    pub loss: Option<&'a dyn Loss>,
}

/// What came out of a pass over factors.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Evaluation {
    /// ½ Σ ρ(‖r‖²) over the active factors.
    pub cost: f64,
    /// Factors that were not defined at the last linearization, and take no part.
    pub inactive: usize,
    /// Active factors that are not defined here.
    pub left: usize,
    /// Place in the graph of a factor whose cost is not finite.
    pub not_finite: Option<usize>,
}

impl Evaluation {
    /// Both together; `self` comes first.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            cost: self.cost + other.cost,
            inactive: self.inactive + other.inactive,
            left: self.left + other.left,
            not_finite: self.not_finite.or(other.not_finite),
        }
    }
}

/// One factor, for people to look at.
#[derive(Debug, Clone, PartialEq)]
pub struct FactorState {
    /// Its place in the graph.
    pub entry: usize,
    /// Whether it is defined at these values.
    pub defined: bool,
    /// The residual, not whitened.
    pub residual: Vec<f64>,
    /// The residual in standard deviations.
    pub whitened: Vec<f64>,
    /// The weight that the loss gives it, 1 without a loss.
    pub weight: f64,
    /// ½ρ(‖whitened‖²); zero where it is not defined.
    pub cost: f64,
}

/// One factor's whitened Jacobian, each row scaled by the root of the robust weight.
#[derive(Debug)]
pub struct FactorRows<'a> {
    /// Its place in the graph.
    pub entry: usize,
    /// Whitened and weighted residual.
    pub residual: &'a [f64],
    /// By free variable: where it begins in the linear system, and its block, column-major.
    pub blocks: Vec<(usize, Vec<f64>)>,
}

/// All factors of one concrete type, one kind of noise and one type of loss.
pub trait Batch: Send + Sync {
    /// Whether a factor of the same type belongs here, by its noise and loss.
    fn fits(&self, noise: &Whitener, loss: Option<&dyn Loss>) -> bool;
    /// Adds a factor of this batch's type; others are left out.
    fn push(&mut self, member: &Member<'_>);
    /// Decides which factors are active, and adds their parts of H and g.
    fn linearize(&mut self, columns: &Columns, to: &mut NormalEquations<'_>) -> Evaluation;
    /// The cost of the factors that were active at the last linearization.
    fn cost(&self, columns: &Columns) -> Evaluation;
    /// ½ρ of each factor, to its place in the graph, whatever its weight; zero where it is not defined.
    fn costs(&self, columns: &Columns, to: &mut [f64]);
    /// Makes each factor count as often as the entry at its place in the graph says, on top of its loss.
    fn set_weights(&mut self, weights: &[f64]);
    /// Each factor as it stands, in order of the batch.
    fn inspect(&self, columns: &Columns) -> Vec<FactorState>;
    /// Each defined factor's rows of the Jacobian.
    fn rows(&self, columns: &Columns, visit: &mut dyn FnMut(FactorRows<'_>));
}

/// The batch of a residual type.
pub(crate) struct BatchOf<F: Kernel> {
    factors: Vec<F>,
    entries: Vec<u32>,
    /// Factor i's variables are `ends[i-1]..ends[i]` of `index`, `starts`, `free` and `held`.
    ends: Vec<u32>,
    index: Vec<u32>,
    starts: Vec<u32>,
    free: Vec<bool>,
    /// Empty where no direction of any variable is held.
    held: Vec<u32>,
    slot_ends: Vec<u32>,
    slots: Vec<Slot>,
    whiteners: Whiteners<F::Dim>,
    losses: Option<Box<dyn LossColumn>>,
    /// What each factor's cost is multiplied by; empty, where nobody weighs them.
    weights: Vec<f64>,
    active: Vec<bool>,
    /// One for each chunk, for threads; empty until they are used.
    work: Vec<Work<F>>,
}

/// Room for one chunk.
#[derive(Clone)]
struct Work<F: Kernel> {
    r: [Matrix<F::Dim, U1>; CHUNK],
    j: [F::Blocks; CHUNK],
    w: [f64; CHUNK],
    evaluation: Evaluation,
}

impl<F: Kernel> Work<F> {
    fn new() -> Self {
        Self {
            r: [Block::zeros(); CHUNK],
            j: std::array::from_fn(|_| F::blocks()),
            w: [0.0; CHUNK],
            evaluation: Evaluation::default(),
        }
    }
}

impl<F: Kernel> BatchOf<F> {
    /// An empty batch, for factors with such a noise and loss.
    pub(crate) fn new(noise: &Whitener, loss: Option<&dyn Loss>) -> Self {
        Self {
            factors: vec![],
            entries: vec![],
            ends: vec![],
            index: vec![],
            starts: vec![],
            free: vec![],
            held: vec![],
            slot_ends: vec![],
            slots: vec![],
            whiteners: Whiteners::like(noise),
            losses: loss.map(|l| l.erased().column()),
            weights: vec![],
            active: vec![],
            work: vec![],
        }
    }

    #[inline(always)]
    fn range(ends: &[u32], i: usize) -> std::ops::Range<usize> {
        let first = if i == 0 { 0 } else { ends[i - 1] as usize };
        first..ends[i] as usize
    }

    /// Whitened residuals, Jacobians and robust weights of the chunk that begins at `first`.
    #[inline(always)]
    fn evaluate(&self, columns: F::Columns<'_>, first: usize, active: &mut [bool], work: &mut Work<F>) {
        let mut inactive = 0;
        for (k, active) in active.iter_mut().enumerate() {
            let i = first + k;
            let range = Self::range(&self.ends, i);
            let x = self.factors[i].load(columns, &self.index[range.clone()]);
            *active = self.factors[i].is_defined(x.clone());
            if !*active {
                inactive += 1;
                work.w[k] = 0.0;
                continue;
            }
            let j = &mut work.j[k];
            let value = self.factors[i].linearize(x, &self.free[range.clone()], j);
            let r = work.r[k].as_mut_slice();
            r.copy_from_slice(value.as_ref());
            self.whiteners.whiten(i, r);
            work.w[k] = r.iter().map(|x| x * x).sum();
            let held = if self.held.is_empty() { &[][..] } else { &self.held[range] };
            F::each(j, |a, block| {
                self.whiteners.whiten(i, block);
                if let Some(held) = held.get(a) {
                    hold::<F::Dim>(*held, block);
                }
            });
        }
        let cost = self.weigh(first, &mut work.w[..active.len()], active);
        let not_finite = if cost.is_finite() { None } else { self.find_not_finite(first, active, work) };
        work.evaluation = Evaluation { cost, inactive, left: 0, not_finite };
    }

    fn find_not_finite(&self, first: usize, active: &[bool], work: &Work<F>) -> Option<usize> {
        let bad = |k: &usize| active[*k] && work.r[*k].as_slice().iter().any(|x| !x.is_finite());
        let k = (0..active.len()).find(bad).unwrap_or(0);
        Some(self.entries[first + k] as usize)
    }

    /// Squared norms into weights, and ½ Σ ρ: one virtual call. Inactive factors have norm 0.
    #[inline(always)]
    fn weigh(&self, first: usize, squared: &mut [f64], active: &[bool]) -> f64 {
        let cost = match self.weights.get(first..first + squared.len()) {
            None => self.robust(first, squared),
            Some(weights) => self.reweigh(first, squared, weights),
        };
        for (w, active) in squared.iter_mut().zip(active) {
            if !active {
                *w = 0.0;
            }
        }
        cost
    }

    /// Squared norms into the loss's weights, and ½ Σ ρ.
    #[inline(always)]
    fn robust(&self, first: usize, squared: &mut [f64]) -> f64 {
        match &self.losses {
            Some(losses) => losses.weigh(first, squared),
            None => squared.iter_mut().map(|s| 0.5 * std::mem::replace(s, 1.0)).sum(),
        }
    }

    /// As `robust`, each factor `weights` times. A loss sums up what it is shown: show it one at a time.
    fn reweigh(&self, first: usize, squared: &mut [f64], weights: &[f64]) -> f64 {
        let one = |(k, (s, weight)): (usize, (&mut f64, &f64))| {
            let cost = self.robust(first + k, std::slice::from_mut(s));
            *s *= weight;
            // a factor that does not count may be as far off as it likes
            if *weight == 0.0 { 0.0 } else { weight * cost }
        };
        squared.iter_mut().zip(weights).enumerate().map(one).sum()
    }

    /// ‖whitened residual‖²; `None` where the factor is not defined.
    #[inline(always)]
    fn squared(&self, columns: F::Columns<'_>, i: usize) -> Option<f64> {
        let x = self.factors[i].load(columns, &self.index[Self::range(&self.ends, i)]);
        if !self.factors[i].is_defined(x.clone()) {
            return None;
        }
        let value = self.factors[i].value(&x);
        let mut r = <Matrix<F::Dim, U1> as Block>::zeros();
        let r = r.as_mut_slice();
        r.copy_from_slice(value.as_ref());
        self.whiteners.whiten(i, r);
        Some(r.iter().map(|x| x * x).sum())
    }

    #[inline(always)]
    fn scatter(&self, first: usize, active: &[bool], work: &Work<F>, to: &mut NormalEquations<'_>) {
        for (k, _) in active.iter().enumerate().filter(|(_, active)| **active) {
            let i = first + k;
            let places = Places {
                starts: &self.starts[Self::range(&self.ends, i)],
                slots: &self.slots[Self::range(&self.slot_ends, i)],
            };
            F::scatter(&work.j[k], work.r[k].as_slice(), work.w[k], places, to);
        }
    }

    #[inline(always)]
    fn chunk_cost(&self, columns: F::Columns<'_>, first: usize) -> Evaluation {
        let len = CHUNK.min(self.factors.len() - first);
        let active = &self.active[first..first + len];
        let mut out = Evaluation::default();
        let mut squared = [0.0; CHUNK];
        for k in 0..len {
            let i = first + k;
            if !active[k] {
                out.inactive += 1;
                continue;
            }
            let Some(s) = self.squared(columns, i) else {
                out.left += 1;
                continue;
            };
            squared[k] = s;
            if !squared[k].is_finite() && out.not_finite.is_none() {
                out.not_finite = Some(self.entries[i] as usize);
            }
        }
        out.cost = self.weigh(first, &mut squared[..len], active);
        out
    }

    fn in_parallel(&self) -> bool {
        self.factors.len() >= PARALLEL && rayon::current_num_threads() > 1
    }
}

/// Zeroes the columns of directions that are held.
fn hold<R: Dimension>(held: u32, block: &mut [f64]) {
    for (c, column) in block.chunks_exact_mut(R::N).enumerate() {
        if held >> c & 1 == 1 {
            column.fill(0.0);
        }
    }
}

impl<F: Kernel> Batch for BatchOf<F> {
    fn fits(&self, noise: &Whitener, loss: Option<&dyn Loss>) -> bool {
        self.whiteners.fits(noise)
            && self.losses.as_ref().map(|l| l.loss_type()) == loss.map(|l| l.erased().as_any().type_id())
    }

    fn push(&mut self, member: &Member<'_>) {
        let Some(factor) = F::of(member.factor) else { return };
        if !member.held.iter().all(|h| *h == 0) {
            self.held.resize(self.index.len(), 0);
            self.held.extend_from_slice(member.held);
        } else if !self.held.is_empty() {
            self.held.extend(member.index.iter().map(|_| 0));
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
        self.active.push(true);
    }

    fn linearize(&mut self, columns: &Columns, to: &mut NormalEquations<'_>) -> Evaluation {
        let columns = F::columns(columns);
        let mut active = std::mem::take(&mut self.active);
        let mut total = Evaluation::default();
        if self.in_parallel() {
            // evaluated by threads, scattered by one in order: the same sums as without threads
            let mut work = std::mem::take(&mut self.work);
            work.resize_with(active.len().div_ceil(CHUNK), Work::new);
            work.par_iter_mut().zip(active.par_chunks_mut(CHUNK)).enumerate().for_each(
                |(n, (work, active))| {
                    self.evaluate(columns, n * CHUNK, active, work);
                },
            );
            for (n, (work, active)) in work.iter().zip(active.chunks(CHUNK)).enumerate() {
                total = total.and(work.evaluation);
                self.scatter(n * CHUNK, active, work, to);
            }
            self.work = work;
        } else {
            let mut work = Work::new();
            for (n, active) in active.chunks_mut(CHUNK).enumerate() {
                self.evaluate(columns, n * CHUNK, active, &mut work);
                total = total.and(work.evaluation);
                self.scatter(n * CHUNK, active, &work, to);
            }
        }
        self.active = active;
        total
    }

    fn cost(&self, columns: &Columns) -> Evaluation {
        let columns = F::columns(columns);
        let chunks = self.factors.len().div_ceil(CHUNK);
        if self.in_parallel() {
            let costs: Vec<_> =
                (0..chunks).into_par_iter().map(|n| self.chunk_cost(columns, n * CHUNK)).collect();
            costs.into_iter().fold(Evaluation::default(), Evaluation::and)
        } else {
            (0..chunks)
                .map(|n| self.chunk_cost(columns, n * CHUNK))
                .fold(Evaluation::default(), Evaluation::and)
        }
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

    fn inspect(&self, columns: &Columns) -> Vec<FactorState> {
        let columns = F::columns(columns);
        let one = |i: usize| {
            let x = self.factors[i].load(columns, &self.index[Self::range(&self.ends, i)]);
            let defined = self.factors[i].is_defined(x.clone());
            let value = self.factors[i].value(&x);
            let residual = value.as_ref().to_vec();
            let mut whitened = residual.clone();
            self.whiteners.whiten(i, &mut whitened);
            let mut weight = [if defined { whitened.iter().map(|x| x * x).sum() } else { 0.0 }];
            let cost = self.weigh(i, &mut weight, &[defined]);
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
                work.r[k].as_mut_slice().iter_mut().for_each(|x| *x *= root);
                let mut blocks = vec![];
                F::each(&mut work.j[k], |a, block| {
                    if starts[a] != FIXED {
                        blocks.push((starts[a] as usize, block.iter().map(|x| x * root).collect()));
                    }
                });
                let residual = work.r[k].as_slice();
                visit(FactorRows { entry: self.entries[i] as usize, residual, blocks });
            }
        }
    }
}
