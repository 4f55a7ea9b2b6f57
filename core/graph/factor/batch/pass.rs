//! Passes over a batch, chunk by chunk. Results are bitwise identical for any number of threads.
use super::threads::join;
use super::{BatchOf, Evaluation};
use crate::algebra::{Block, Dimension, Matrix};
use crate::factor::kernel::Kernel;
use crate::residual::normal_equations::{NormalEquations, Places};
use crate::variable::column::Columns;
use nalgebra::U1;
use pulp::{Simd, WithSimd};

/// Factors per chunk: the unit of one virtual call of a loss, and of one thread task.
pub(super) const CHUNK: usize = 16;
/// Factors that threads evaluate in parallel, while one thread adds those of the previous window.
const WINDOW: usize = 64 * CHUNK;
/// Duration in seconds above which a pass runs on several threads. Waking them has a cost. Zero in debug
/// builds, so that tests cover the threads.
const PARALLEL_SECONDS: f64 = if cfg!(debug_assertions) { 0.0 } else { 2e-3 };
/// Duration of a cost evaluation, as an approximate share of a linearization.
pub(super) const COST_SHARE: f64 = 0.2;

/// Buffers for one chunk.
#[derive(Clone)]
pub(super) struct Work<F: Kernel> {
    pub(super) r: [Matrix<F::Dim, U1>; CHUNK],
    pub(super) j: [F::Blocks; CHUNK],
    pub(super) w: [f64; CHUNK],
    pub(super) evaluation: Evaluation,
}

impl<F: Kernel> Work<F> {
    pub(super) fn new() -> Self {
        Self {
            r: [Block::zeros(); CHUNK],
            j: std::array::from_fn(|_| F::blocks()),
            w: [0.0; CHUNK],
            evaluation: Evaluation::default(),
        }
    }
}

impl<F: Kernel> BatchOf<F> {
    /// Computes whitened residuals, Jacobians and robust weights of the chunk that begins at `first`.
    #[inline(always)]
    pub(super) fn evaluate(
        &self,
        columns: F::Columns<'_>,
        first: usize,
        active: &mut [bool],
        work: &mut Work<F>,
    ) {
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
            let value = self.factors[i].linearize(x, &self.free[range], &mut work.j[k]);
            work.r[k].as_mut_slice().copy_from_slice(value.as_ref());
        }
        self.arch.dispatch(Whiten { batch: self, first, active, work });
        let cost = self.weights_from_norms(first, &mut work.w[..active.len()], active);
        let not_finite = if cost.is_finite() { None } else { self.find_not_finite(first, active, work) };
        work.evaluation = Evaluation { cost, inactive, became_undefined: 0, not_finite };
    }

    /// Returns the factor that makes the cost of a chunk infinite or NaN. If only the sum overflows,
    /// returns the factor with the largest cost.
    fn find_not_finite(&self, first: usize, active: &[bool], work: &Work<F>) -> Option<usize> {
        let cost = |k: usize| {
            let squared = work.r[k].as_slice().iter().map(|x| x * x).sum();
            self.weights_from_norms(first + k, &mut [squared], &[true])
        };
        let active = (0..active.len()).filter(|k| active[*k]);
        let bad = active.clone().find(|k| !cost(*k).is_finite());
        let k = bad.or_else(|| active.max_by(|a, b| cost(*a).total_cmp(&cost(*b))))?;
        Some(self.entries[first + k] as usize)
    }

    /// Replaces squared norms by weights and returns ½ Σ ρ, in one virtual call. Inactive factors have norm
    /// 0.
    #[inline(always)]
    pub(super) fn weights_from_norms(&self, first: usize, squared: &mut [f64], active: &[bool]) -> f64 {
        let cost = match self.weights.get(first..first + squared.len()) {
            None => self.robust(first, squared),
            Some(weights) => self.scaled_weights(first, squared, weights),
        };
        for (w, active) in squared.iter_mut().zip(active) {
            if !active {
                *w = 0.0;
            }
        }
        cost
    }

    /// Replaces squared norms by the weights of the loss. Returns ½ Σ ρ.
    #[inline(always)]
    pub(super) fn robust(&self, first: usize, squared: &mut [f64]) -> f64 {
        match &self.losses {
            Some(losses) => losses.weights_from_norms(first, squared),
            None => squared.iter_mut().map(|s| 0.5 * std::mem::replace(s, 1.0)).sum(),
        }
    }

    /// Like `robust`, with each factor multiplied by its weight. One call per factor, since a loss returns
    /// the sum of its costs.
    fn scaled_weights(&self, first: usize, squared: &mut [f64], weights: &[f64]) -> f64 {
        let one = |(k, (s, weight)): (usize, (&mut f64, &f64))| {
            let cost = self.robust(first + k, std::slice::from_mut(s));
            *s *= weight;
            // with weight zero, an infinite cost must not turn into NaN
            if *weight == 0.0 { 0.0 } else { weight * cost }
        };
        squared.iter_mut().zip(weights).enumerate().map(one).sum()
    }

    /// Returns ‖whitened residual‖²; `None` if the factor is undefined.
    #[inline(always)]
    pub(super) fn squared(&self, columns: F::Columns<'_>, i: usize) -> Option<f64> {
        let x = self.factors[i].load(columns, &self.index[Self::range(&self.ends, i)]);
        if !self.factors[i].is_defined(x.clone()) {
            return None;
        }
        let value = self.factors[i].value(&x);
        let mut r = <Matrix<F::Dim, U1> as Block>::zeros();
        let r = r.as_mut_slice();
        r.copy_from_slice(value.as_ref());
        self.whiteners.whiten(i, r);
        if let Some(augmentation) = self.augmentations.get(i) {
            augmentation.apply(r);
        }
        Some(r.iter().map(|x| x * x).sum())
    }

    fn scatter(&self, first: usize, active: &[bool], work: &Work<F>, to: &mut NormalEquations<'_>) {
        self.arch.dispatch(Add { batch: self, first, active, work, to });
    }

    #[inline(always)]
    pub(super) fn chunk_cost(&self, columns: F::Columns<'_>, first: usize, len: usize) -> Evaluation {
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
                out.became_undefined += 1;
                continue;
            };
            squared[k] = s;
            if !squared[k].is_finite() && out.not_finite.is_none() {
                out.not_finite = Some(self.entries[i] as usize);
            }
        }
        out.cost = self.weights_from_norms(first, &mut squared[..len], active);
        out
    }

    /// Returns the number of factors in the n-th chunk.
    pub(super) fn chunk(&self, n: usize) -> usize {
        CHUNK.min(self.factors.len() - n * CHUNK)
    }

    /// Computes the costs of the chunks from `first` on, by threads.
    pub(super) fn chunk_costs(&self, columns: F::Columns<'_>, first: usize, costs: &mut [Evaluation]) {
        if costs.len() <= 1 {
            costs
                .iter_mut()
                .for_each(|cost| *cost = self.chunk_cost(columns, first * CHUNK, self.chunk(first)));
            return;
        }
        let middle = costs.len() / 2;
        let (left, right) = costs.split_at_mut(middle);
        join(&mut || self.chunk_costs(columns, first, left), &mut || {
            self.chunk_costs(columns, first + middle, right);
        });
    }

    /// Evaluates the chunks of `active`, which begin at factor `first`, by threads.
    fn evaluate_chunks(
        &self,
        columns: F::Columns<'_>,
        first: usize,
        active: &mut [bool],
        work: &mut [Work<F>],
    ) {
        if active.len() <= CHUNK {
            self.evaluate(columns, first, active, &mut work[0]);
            return;
        }
        let middle = active.len().div_ceil(CHUNK) / 2;
        let (active, active_right) = active.split_at_mut(middle * CHUNK);
        let (work, work_right) = work.split_at_mut(middle);
        join(&mut || self.evaluate_chunks(columns, first, active, work), &mut || {
            self.evaluate_chunks(columns, first + middle * CHUNK, active_right, work_right);
        });
    }

    /// Returns whether threads pay off for this share of a linearization's work.
    pub(super) fn in_parallel(&self, share: f64) -> bool {
        share * self.alone > PARALLEL_SECONDS && rayon::current_num_threads() > 1
    }

    pub(super) fn linearize_alone(
        &self,
        columns: F::Columns<'_>,
        active: &mut [bool],
        to: &mut NormalEquations<'_>,
    ) -> Evaluation {
        let mut work = Work::new();
        let mut total = Evaluation::default();
        for (n, active) in active.chunks_mut(CHUNK).enumerate() {
            self.evaluate(columns, n * CHUNK, active, &mut work);
            total = total.merge(work.evaluation);
            self.scatter(n * CHUNK, active, &work, to);
        }
        total
    }

    /// Linearizes the listed factors on one thread; neighbours share a chunk.
    pub(super) fn linearize_listed(
        &mut self,
        indices: &[u32],
        columns: &Columns,
        to: &mut NormalEquations<'_>,
    ) -> Evaluation {
        let columns = F::columns(columns);
        let mut active = std::mem::take(&mut self.active);
        let mut work = Work::new();
        let mut total = Evaluation::default();
        for (first, len) in runs(indices) {
            let active = &mut active[first..first + len];
            self.evaluate(columns, first, active, &mut work);
            total = total.merge(work.evaluation);
            self.scatter(first, active, &work, to);
        }
        self.active = active;
        total
    }

    /// Threads evaluate the factors, and one thread adds them in order. The sums are the same as on a
    /// single thread.
    pub(super) fn linearize_together(
        &self,
        columns: F::Columns<'_>,
        active: &mut [bool],
        work: &mut [Vec<Work<F>>; 2],
        to: &mut NormalEquations<'_>,
    ) -> Evaluation {
        let evaluate = |n: usize, active: &mut [bool], work: &mut [Work<F>]| {
            self.evaluate_chunks(columns, n * WINDOW, active, work);
        };
        let mut add = |mut total: Evaluation, n: usize, active: &[bool], work: &[Work<F>]| {
            for (k, (work, active)) in work.iter().zip(active.chunks(CHUNK)).enumerate() {
                total = total.merge(work.evaluation);
                self.scatter(n * WINDOW + k * CHUNK, active, work, to);
            }
            total
        };
        let [mut here, mut ahead] = work.each_mut().map(|work| {
            work.resize_with(WINDOW / CHUNK, Work::new);
            &mut work[..]
        });
        let mut total = Evaluation::default();
        let mut windows = active.chunks_mut(WINDOW).enumerate();
        let mut evaluated = windows.next().map(|(n, active)| {
            evaluate(n, active, here);
            (n, &*active)
        });
        while let Some((n, active)) = evaluated {
            let mut next = windows.next();
            join(&mut || total = add(total, n, active, here), &mut || {
                if let Some((n, active)) = &mut next {
                    evaluate(*n, active, ahead);
                }
            });
            evaluated = next.map(|(n, active)| (n, &*active));
            std::mem::swap(&mut here, &mut ahead);
        }
        total
    }
}

/// Splits ascending indices into runs of consecutive ones that fit into a chunk. Yields the first index and
/// the length of each run.
pub(super) fn runs(indices: &[u32]) -> impl Iterator<Item = (usize, usize)> {
    let mut rest = indices;
    std::iter::from_fn(move || {
        let first = *rest.first()?;
        let follow = rest.iter().take(CHUNK).zip(first..).take_while(|(index, expected)| *index == expected);
        let len = follow.count();
        rest = &rest[len..];
        Some((first as usize, len))
    })
}

/// Whitens residuals and Jacobians of a chunk, and replaces its weights by squared norms. A type rather
/// than a closure, like [`Add`], so that it is compiled for wide registers.
struct Whiten<'a, F: Kernel> {
    batch: &'a BatchOf<F>,
    first: usize,
    active: &'a [bool],
    work: &'a mut Work<F>,
}

impl<F: Kernel> WithSimd for Whiten<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { batch, work, .. } = self;
        for (k, _) in self.active.iter().enumerate().filter(|(_, active)| **active) {
            let i = self.first + k;
            let r = work.r[k].as_mut_slice();
            batch.whiteners.whiten(i, r);
            let augmentation = batch.augmentations.get(i);
            if let Some(augmentation) = augmentation {
                augmentation.apply(r);
            }
            work.w[k] = r.iter().map(|x| x * x).sum();
            let range = BatchOf::<F>::range(&batch.ends, i);
            let fixed = if batch.fixed.is_empty() { &[][..] } else { &batch.fixed[range] };
            F::each(
                &mut work.j[k],
                #[inline(always)]
                |a, block| {
                    batch.whiteners.whiten(i, block);
                    if let Some(augmentation) = augmentation {
                        augmentation.scale(block);
                    }
                    if let Some(fixed) = fixed.get(a) {
                        clear_fixed_columns::<F::Dim>(*fixed, block);
                    }
                },
            );
        }
    }
}

/// Adds the contributions of a chunk to H and g.
struct Add<'a, 'b, F: Kernel> {
    batch: &'a BatchOf<F>,
    first: usize,
    active: &'a [bool],
    work: &'a Work<F>,
    to: &'a mut NormalEquations<'b>,
}

impl<F: Kernel> WithSimd for Add<'_, '_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { batch, work, .. } = self;
        for (k, _) in self.active.iter().enumerate().filter(|(_, active)| **active) {
            let i = self.first + k;
            let places = Places {
                starts: &batch.starts[BatchOf::<F>::range(&batch.ends, i)],
                slots: &batch.slots[BatchOf::<F>::range(&batch.slot_ends, i)],
            };
            F::scatter(&work.j[k], work.r[k].as_slice(), work.w[k], places, self.to);
        }
    }
}

/// Sets the columns of fixed directions to zero.
#[inline(always)]
fn clear_fixed_columns<R: Dimension>(fixed: u32, block: &mut [f64]) {
    for (c, column) in block.chunks_exact_mut(R::N).enumerate() {
        if fixed >> c & 1 == 1 {
            column.fill(0.0);
        }
    }
}
