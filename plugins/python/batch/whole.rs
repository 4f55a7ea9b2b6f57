//! A batch of factors that are evaluated in one call.
use super::Batched;
use super::cached::{Cached, Results};
use super::evaluate::{Function, Linearized, Point};
use super::memory::Memory;
use crate::raised::has_raised;
use manifactor::graph::batch::{Batch, Evaluation, FactorRows, FactorState, Member};
use manifactor::graph::column::Columns;
use manifactor::graph::loss::Loss;
use manifactor::graph::noise::Whitener;
use manifactor::graph::normal_equations::NormalEquations;
use manifactor::graph::{Dynamic, ErasedResidual, as_variable};
use std::any::Any;
use std::sync::Arc;

/// Calls the function for everything that a pass needs, and leaves the pass to the core's batch.
pub(super) struct Whole {
    function: Arc<Function>,
    /// A batch of [`Cached`] factors, in the order of `members`.
    inner: Box<dyn Batch>,
    members: Vec<One>,
    /// Number of indices assigned to factors so far.
    numbers: usize,
    results: Results,
}

/// A factor: its index in the results, its constants, and the positions of its variables in their columns.
struct One {
    number: usize,
    constants: Arc<[f64]>,
    index: Vec<u32>,
    /// Index in the graph.
    entry: usize,
    memory: Memory,
}

impl Whole {
    /// Creates a batch of factors like this one.
    pub(super) fn new(like: &Dynamic<Cached>, noise: &Whitener, loss: Option<&dyn Loss>) -> Self {
        let (inner, function) = (like.new_batch(noise, loss), like.get().function.clone());
        Self { function, inner, members: vec![], numbers: 0, results: Results::default() }
    }

    fn point(&self, one: &One, columns: &Columns) -> Point {
        let value = |(id, index): (&std::any::TypeId, &u32)| {
            let x = columns.value(*id, *index as usize)?;
            Some((as_variable(*id)?.cast)(x)?.erased().clone_box())
        };
        let variables = self.function.types.iter().zip(&one.index).filter_map(value).collect();
        Point { variables, constants: one.constants.clone() }
    }

    /// Computes the results for a pass over the members `at`, or over all members if `at` is `None`.
    fn compute(&self, at: Option<&[u32]>, columns: &Columns, derivatives: bool) {
        let chosen: Vec<&One> = match at {
            Some(at) => at.iter().filter_map(|i| self.members.get(*i as usize)).collect(),
            None => self.members.iter().collect(),
        };
        let points: Vec<Point> = chosen.iter().map(|one| self.point(one, columns)).collect();
        let done = match derivatives {
            true => self.function.linearized(&points),
            false => (self.function.residuals(&points), vec![]),
        };
        let numbers: Vec<usize> = chosen.iter().map(|one| one.number).collect();
        self.publish(&numbers, &done);
    }

    /// Makes results readable for the factors with these indices. Blocks may be missing.
    fn publish(&self, numbers: &[usize], (residuals, blocks): &Linearized) {
        let Ok(mut results) = self.results.write() else { return };
        let (count, rows) = (self.numbers, self.function.rows);
        let put = |to: &mut Vec<f64>, from: &[f64], size: usize| {
            to.resize(count * size, f64::NAN);
            for (number, from) in numbers.iter().zip(from.chunks_exact(size.max(1))) {
                if let Some(to) = to.get_mut(number * size..(number + 1) * size) {
                    to.copy_from_slice(from);
                }
            }
        };
        put(&mut results.0, residuals, rows);
        if !blocks.is_empty() {
            results.1.resize(blocks.len(), vec![]);
            for ((to, from), n) in results.1.iter_mut().zip(blocks).zip(&self.function.dimensions) {
                put(to, from, rows * n);
            }
        }
    }

    /// Linearizes members of a smoother, and remembers the results. After an exception, members at a
    /// remembered point have its results, so that a smoother can return to it. Returns the first member
    /// without results.
    fn compute_remembered(&mut self, indices: &[u32], columns: &Columns) -> Option<usize> {
        let at = |i: &u32| self.members.get(*i as usize).map(|one| (one.number, self.point(one, columns)));
        let (numbers, points): (Vec<usize>, Vec<Point>) = indices.iter().filter_map(at).unzip();
        let mut done = self.function.linearized(&points);
        let mut failed = None;
        for (place, (i, point)) in indices.iter().zip(&points).enumerate() {
            let Some(one) = self.members.get_mut(*i as usize) else { continue };
            let at = self.function.numbers(point);
            if !has_raised() {
                one.memory.store(at, &self.function, place, &done);
            } else if !one.memory.restore(&at, &self.function, place, &mut done) {
                failed = failed.or(Some(one.entry));
            }
        }
        self.publish(&numbers, &done);
        failed
    }
}

impl Batch for Whole {
    fn len(&self) -> usize {
        self.inner.len()
    }
    fn fits(&self, noise: &Whitener, loss: Option<&dyn Loss>) -> bool {
        self.inner.fits(noise, loss)
    }
    fn accepts_parameters(&self, factor: &dyn Any) -> bool {
        factor.downcast_ref::<Batched>().is_some_and(|factor| Arc::ptr_eq(factor.function(), &self.function))
    }
    fn reserve(&mut self, factors: usize, variables: usize) {
        self.inner.reserve(factors, variables);
    }
    fn push(&mut self, member: &Member<'_>) {
        let Some(factor) = member.factor.downcast_ref::<Batched>() else { return };
        let number = self.numbers;
        self.numbers += 1;
        let (constants, index) = (factor.constants.clone(), member.index.to_vec());
        let memory = Memory::default();
        self.members.push(One { number, constants, index, entry: member.entry, memory });
        let (function, results) = (self.function.clone(), self.results.clone());
        self.inner.push(&Member { factor: &Cached { function, number, results }, ..*member });
    }
    fn residual_mut(&mut self, _: usize) -> Option<&mut dyn Any> {
        None
    }
    fn set_noise(&mut self, index: usize, noise: &Whitener) -> bool {
        self.inner.set_noise(index, noise)
    }
    fn linearize(&mut self, columns: &Columns, to: &mut NormalEquations<'_>) -> Evaluation {
        self.compute(None, columns, true);
        self.inner.linearize(columns, to)
    }
    fn cost(&self, columns: &Columns) -> Evaluation {
        self.compute(None, columns, false);
        self.inner.cost(columns)
    }
    fn inactive(&self, visit: &mut dyn FnMut(usize)) {
        self.inner.inactive(visit);
    }
    fn costs(&self, columns: &Columns, to: &mut [f64]) {
        self.compute(None, columns, false);
        self.inner.costs(columns, to);
    }
    fn set_weights(&mut self, weights: &[f64]) {
        self.inner.set_weights(weights);
    }
    fn augment(&mut self, index: usize, scale: f64, shift: &[f64]) {
        self.inner.augment(index, scale, shift);
    }
    fn inspect(&self, columns: &Columns) -> Vec<FactorState> {
        self.compute(None, columns, false);
        self.inner.inspect(columns)
    }
    fn rows(&self, columns: &Columns, visit: &mut dyn FnMut(FactorRows<'_>)) {
        self.compute(None, columns, true);
        self.inner.rows(columns, visit);
    }
    fn remove(&mut self, index: usize) -> Option<usize> {
        self.members.swap_remove(index);
        self.inner.remove(index)
    }
    fn linearize_at(
        &mut self,
        indices: &[u32],
        columns: &Columns,
        to: &mut NormalEquations<'_>,
    ) -> Evaluation {
        let failed = self.compute_remembered(indices, columns);
        let mut evaluation = self.inner.linearize_at(indices, columns, to);
        // a smoother undoes its update if a new factor is not finite
        evaluation.not_finite = evaluation.not_finite.or(failed);
        evaluation
    }
    fn cost_at(&self, indices: &[u32], columns: &Columns) -> Evaluation {
        self.compute(Some(indices), columns, false);
        self.inner.cost_at(indices, columns)
    }
    fn robust_weights_at(&self, indices: &[u32], columns: &Columns, to: &mut Vec<f64>) {
        self.compute(Some(indices), columns, false);
        self.inner.robust_weights_at(indices, columns, to);
    }
    fn set_weight(&mut self, index: usize, weight: f64) {
        self.inner.set_weight(index, weight);
    }
    fn set_fixed(&mut self, index: usize, starts: &[u32], held: &[u32]) {
        self.inner.set_fixed(index, starts, held);
    }
    fn is_active(&self, index: usize) -> bool {
        self.inner.is_active(index)
    }
}
