//! A compiled graph: a model of variables and factors, and the linear system of its steps.
mod change;
mod compile;
mod estimate;
mod kept;
mod method;
mod model;

use crate::linear::NotPositiveDefinite;
use crate::linear::settings::LinearSolver;
use crate::linear::system::LinearSystem;
use crate::outcome::Times;
use manifactor_graph::batch::{Evaluation, FactorRows, FactorState};
use manifactor_graph::{Graph, Values, Version};
use std::time::Instant;

pub use change::ChangeError;
pub use compile::CompileError;
pub use estimate::WeightError;
pub(crate) use kept::Kept;
pub(crate) use model::{FactorPlace, Model};

/// A graph, compiled. The structure lives as long as the problem; solves reuse it.
pub struct Problem {
    pub(crate) model: Model,
    pub(crate) system: LinearSystem,
    pub(crate) times: Times,
    /// Of the graph that was compiled; a new one, once a measurement is changed here.
    version: Version,
    /// Revision of the model that H and g are of.
    linearized: Option<u64>,
    /// Revision of the model at which the factor of H was found to leave nothing open.
    pub(crate) determined: Option<u64>,
}

impl Problem {
    /// Sorts variables into columns and factors into batches, and analyses the linear system.
    ///
    /// # Errors
    /// Everything that is wrong between graph and values, all at once.
    pub fn compile(graph: &Graph, values: &Values) -> Result<Self, CompileError> {
        Self::compile_for(graph, values, &LinearSolver::default())
    }

    /// The same for a linear solver of choice.
    ///
    /// # Errors
    /// Those of [`compile`](Self::compile), and where the solver does not fit the graph, or its factor into memory.
    pub fn compile_for(graph: &Graph, values: &Values, linear: &LinearSolver) -> Result<Self, CompileError> {
        compile::compile(graph, values, linear)
    }

    fn new(model: Model, system: LinearSystem, version: Version, times: Times) -> Self {
        Self { model, system, times, version, linearized: None, determined: None }
    }

    /// The estimate, in the order of the values that the problem was compiled with.
    pub fn values(&self) -> Values {
        self.model.values()
    }

    /// Number of scalar unknowns.
    pub fn dim(&self) -> usize {
        self.system.dim()
    }

    /// Number of factors.
    pub fn factors(&self) -> usize {
        self.model.factors.len()
    }

    /// Scalar unknowns of a variable: `None` where there is no such variable, or it is held.
    pub fn unknowns(&self, key: &str) -> Option<std::ops::Range<usize>> {
        let place = self.model.place(key)?;
        place.start.map(|s| s..s + place.tangent.len())
    }

    /// Fills H and g at the estimate, and decides which factors take part. Where something is not finite, a factor is
    /// named that it comes from.
    pub fn linearize(&mut self) -> Evaluation {
        let clock = Instant::now();
        let mut total = self.model.linearize(&mut self.system.begin());
        self.system.finish();
        self.linearized = Some(self.model.revision());
        if !total.cost.is_finite() || !self.system.is_finite() {
            total.not_finite = total.not_finite.or_else(|| Some(self.model.not_finite_factor()));
        }
        self.times.linearize += clock.elapsed().as_secs_f64();
        total
    }

    /// The same, and the last factor by Cholesky stays: it is that of another H.
    pub(crate) fn linearize_keeping_factor(&mut self) -> Evaluation {
        let direct = self.system.take_direct();
        let evaluation = self.linearize();
        self.system.put_direct(direct);
        evaluation
    }

    /// Fills H and g, unless they are those of the estimate already.
    pub(crate) fn linearize_once(&mut self) {
        if self.linearized != Some(self.model.revision()) {
            self.linearize();
        }
    }

    /// The lower triangle of H = JᵀJ as compressed columns, in the order of elimination, and g = Jᵀr;
    /// as of the last linearization.
    pub fn normal_equations(&self) -> (&[usize], &[u32], &[f64], &[f64]) {
        let LinearSystem { layout, h, g, .. } = &self.system;
        (&layout.col_ptr, &layout.row_idx, h, g)
    }

    /// Cost at the estimate, over the factors that took part in the last linearization.
    pub fn cost(&self) -> Evaluation {
        self.model.cost()
    }

    /// ½ρ of each factor at the estimate, in the order of the graph, whatever its weight; zero where it is not
    /// defined.
    pub fn factor_costs(&self, costs: &mut Vec<f64>) {
        self.model.factor_costs(costs);
    }

    /// The weight of each factor, in the order of the graph; empty, where none was set.
    pub fn weights(&self) -> &[f64] {
        self.model.weights()
    }

    /// Each factor as it stands at the estimate, in the order of the graph.
    pub fn inspect(&self) -> Vec<FactorState> {
        self.model.inspect()
    }

    /// Visits the rows of the whitened and weighted Jacobian at the estimate, batch by batch.
    pub fn rows(&self, visit: &mut dyn FnMut(FactorRows<'_>)) {
        self.model.rows(visit);
    }

    /// Seconds spent so far.
    pub fn times(&self) -> Times {
        self.times
    }

    /// Makes `estimate ⊞ step` the trial, and returns its cost.
    pub(crate) fn try_step(&mut self, step: &[f64]) -> Evaluation {
        let clock = Instant::now();
        let cost = self.model.try_step(step);
        self.times.evaluate += clock.elapsed().as_secs_f64();
        cost
    }

    /// See [`LinearSystem::factorize`].
    pub(crate) fn factorize(
        &mut self,
        damping: Option<&[f64]>,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<(), NotPositiveDefinite> {
        let clock = Instant::now();
        let Self { model, system, .. } = self;
        let done = system.factorize(damping, &|visit| model.rows(visit), go_on);
        self.times.factorize += clock.elapsed().as_secs_f64();
        done
    }

    /// See [`LinearSystem::newton_step`].
    pub(crate) fn newton_step(&mut self, step: &mut Vec<f64>, go_on: &mut dyn FnMut() -> bool) {
        let clock = Instant::now();
        self.system.newton_step(step, go_on);
        self.times.solve += clock.elapsed().as_secs_f64();
    }
}

impl std::fmt::Debug for Problem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (variables, factors, dim) = (self.model.variables.len(), self.factors(), self.dim());
        write!(f, "Problem({variables} variables, {factors} factors, {dim} unknowns)")
    }
}
