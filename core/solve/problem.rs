//! A compiled graph: a model of variables and factors, and the linear system of its steps.
mod bounds;
mod change;
mod compile;
mod constraints;
mod estimate;
mod method;
mod model;
mod shared;

use crate::linear::NotPositiveDefinite;
use crate::linear::settings::LinearSolver;
use crate::linear::system::LinearSystem;
use crate::outcome::Times;
use manifactor_graph::batch::{Evaluation, FactorRows, FactorState};
use manifactor_graph::{Graph, Values, Version};
use std::time::Instant;

pub use change::ProblemChangeError;
pub use compile::CompileError;
pub(crate) use constraints::{Constraints, TOLERANCE as CONSTRAINT_TOLERANCE};
pub use estimate::WeightError;
pub(crate) use model::{Model, ProblemFactor, ProblemVariable};
pub(crate) use shared::SharedProblem;

/// A compiled graph. The structure lives as long as the problem, and all its solves reuse it.
pub struct Problem {
    pub(crate) model: Model,
    pub(crate) system: LinearSystem,
    pub(crate) times: Times,
    /// Version of the compiled graph; renewed when a measurement is changed in the problem.
    version: Version,
    bounds: bounds::BoundedUnknowns,
    pub(crate) constraints: Constraints,
    /// Revision of the model at which H and g were computed.
    linearized: Option<u64>,
    /// Revision of the model at which the factor of H showed no undetermined direction.
    pub(crate) determined: Option<u64>,
}

impl Problem {
    /// Sorts variables into columns and factors into batches, and analyses the linear system.
    ///
    /// # Errors
    /// All errors between graph and values.
    pub fn compile(graph: &Graph, values: &Values) -> Result<Self, CompileError> {
        Self::compile_for(graph, values, &LinearSolver::default())
    }

    /// Compiles a graph for a given linear solver; see [`compile`](Self::compile).
    ///
    /// # Errors
    /// As [`compile`](Self::compile), or if the solver does not fit the graph, or its factor does not fit
    /// into memory.
    pub fn compile_for(graph: &Graph, values: &Values, linear: &LinearSolver) -> Result<Self, CompileError> {
        compile::compile(graph, values, linear)
    }

    fn new(model: Model, system: LinearSystem, version: Version, times: Times) -> Self {
        let (bounds, constraints) = (bounds::BoundedUnknowns::default(), Constraints::default());
        Self { model, system, times, version, bounds, constraints, linearized: None, determined: None }
    }

    /// Returns the estimate, in the order of the values at compilation.
    pub fn values(&self) -> Values {
        self.model.values()
    }

    /// Returns the number of scalar unknowns.
    pub fn dim(&self) -> usize {
        self.system.dim()
    }

    /// Returns the number of factors.
    pub fn factors(&self) -> usize {
        self.model.factors.len()
    }

    /// Returns the scalar unknowns of a variable; `None` if there is no such variable, or it is fixed.
    pub fn unknowns(&self, key: &str) -> Option<std::ops::Range<usize>> {
        let place = self.model.place(key)?;
        place.start.map(|s| s..s + place.tangent.len())
    }

    /// Returns the cost of the factors between fixed variables.
    pub(crate) fn constant_cost(&self) -> f64 {
        let variables = &self.model.variables;
        let is_fixed =
            |variable: &u32| variables[*variable as usize].unknowns().all(|unknown| unknown.is_none());
        let constant = || {
            let factors = self.model.factors.iter().enumerate();
            factors.filter(|(_, factor)| factor.variables.iter().all(is_fixed)).map(|(i, _)| i)
        };
        if constant().next().is_none() {
            return 0.0;
        }
        let mut costs = vec![];
        self.model.factor_costs(&mut costs);
        let weights = self.model.weights();
        constant().map(|i| weights.get(i).unwrap_or(&1.0) * costs[i]).sum()
    }

    /// Returns the coordinate to which each scalar unknown adds; `None` for unknowns without one, such as rotations.
    pub(crate) fn coordinates(&self) -> Vec<Option<f64>> {
        let mut all = vec![None; self.dim()];
        for place in &self.model.variables {
            let column = self.model.columns().column(place.column);
            for (direction, unknown) in place.unknowns().enumerate() {
                if let Some(unknown) = unknown {
                    all[unknown] = column.coordinate(place.index, direction);
                }
            }
        }
        all
    }

    /// Computes H and g at the estimate, and decides which factors are active. If a value is not finite,
    /// the result names a factor that causes it.
    pub fn linearize(&mut self) -> Evaluation {
        let clock = Instant::now();
        let mut total = self.model.linearize(&mut self.system.begin());
        self.system.finish();
        self.hold_active();
        self.linearized = Some(self.model.revision());
        if !total.cost.is_finite() || !self.system.is_finite() {
            total.not_finite = total.not_finite.or_else(|| Some(self.model.not_finite_factor()));
        }
        self.times.linearize += clock.elapsed().as_secs_f64();
        total
    }

    /// Linearizes, but keeps the last separate Cholesky factor, which belongs to the previous H.
    pub(crate) fn linearize_keeping_factor(&mut self) -> Evaluation {
        let direct = self.system.detach_direct();
        let evaluation = self.linearize();
        self.system.restore_direct(direct);
        evaluation
    }

    /// Computes H and g, unless they are up to date.
    pub(crate) fn linearize_once(&mut self) {
        if self.linearized != Some(self.model.revision()) {
            self.linearize();
        }
    }

    /// Returns H = JᵀJ (lower triangle, compressed columns, in elimination order) and g = Jᵀr, as of the
    /// last linearization. Unknowns that are fixed or held at a bound have one on the diagonal of H and zero elsewhere.
    pub fn normal_equations(&self) -> (&[usize], &[u32], &[f64], &[f64]) {
        let LinearSystem { layout, h, g, .. } = &self.system;
        (&layout.col_ptr, &layout.row_idx, h, g)
    }

    /// Evaluates the cost at the estimate, over the factors that were active at the last linearization.
    pub fn cost(&self) -> Evaluation {
        self.model.cost()
    }

    /// Computes ½ρ of each factor at the estimate, in the order of the graph, without its weight; zero if
    /// it is undefined.
    pub fn factor_costs(&self, costs: &mut Vec<f64>) {
        self.model.factor_costs(costs);
    }

    /// Returns the weight of each factor, in the order of the graph; empty if none was set.
    pub fn weights(&self) -> &[f64] {
        self.model.weights()
    }

    /// Returns the state of each factor at the estimate, in the order of the graph.
    pub fn inspect(&self) -> Vec<FactorState> {
        self.model.inspect()
    }

    /// Visits the rows of the whitened and weighted Jacobian at the estimate, batch by batch.
    pub fn rows(&self, visit: &mut dyn FnMut(FactorRows<'_>)) {
        self.model.rows(visit);
    }

    /// Returns the durations so far, in seconds.
    pub fn times(&self) -> Times {
        self.times
    }

    /// Sets the trial to `estimate ⊞ step`, within the bounds, and returns its cost.
    pub(crate) fn try_step(&mut self, step: &[f64]) -> Evaluation {
        let clock = Instant::now();
        self.retract(step);
        let cost = self.model.trial_cost();
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
