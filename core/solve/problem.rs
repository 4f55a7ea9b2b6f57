//! A compiled graph: indexed, columnar, with the structure of its linear system.
mod compile;
mod estimate;
mod kept;
mod not_finite;

use crate::linear::Method;
use crate::linear::layout::Layout;
use crate::linear::settings::LinearSolver;
use crate::outcome::Times;
use manifactor_graph::batch::{Batch, Evaluation, FactorRows, FactorState};
use manifactor_graph::column::Columns;
use manifactor_graph::normal_equations::NormalEquations;
use manifactor_graph::{Graph, Key, Values, VariableIndices, Version};
use std::time::Instant;

pub use compile::CompileError;
pub use estimate::WeightError;
pub(crate) use kept::Kept;

/// A variable in a problem.
#[derive(Debug, Clone)]
pub(crate) struct Place {
    pub key: Key,
    /// Which column, and where in it.
    pub column: usize,
    pub index: usize,
    pub tangent: &'static [&'static str],
    /// Where it begins in the linear system; `None` for one that is held.
    pub start: Option<usize>,
    /// A bit for each direction that is held.
    pub held: u32,
}

/// A graph, compiled. The structure lives as long as the problem; solves reuse it.
pub struct Problem {
    pub(crate) variables: Vec<Place>,
    /// Of the graph that was compiled.
    pub(crate) version: Version,
    /// By factor: which variables.
    pub(crate) factor_variables: Vec<VariableIndices>,
    /// By factor: its type's name, and the rows of its residual that were observed.
    pub(crate) factor_types: Vec<(&'static str, usize)>,
    /// By factor: how often it counts; empty, where nobody weighs them.
    pub(crate) weights: Vec<f64>,
    /// The estimate, and room for a trial step.
    pub(crate) columns: Columns,
    pub(crate) trial: Columns,
    /// By column: where each variable begins in the linear system.
    pub(crate) starts: Vec<Vec<u32>>,
    pub(crate) batches: Vec<Box<dyn Batch>>,
    pub(crate) layout: Layout,
    pub(crate) h: Vec<f64>,
    pub(crate) g: Vec<f64>,
    /// Indices of the scalar unknowns that are held; one on the diagonal of H.
    pub(crate) held: Vec<usize>,
    pub(crate) method: Method,
    /// Steps of iterative refinement after each solve.
    pub(crate) refinements: usize,
    /// Damping of the last factorization.
    pub(crate) added: Option<Vec<f64>>,
    /// -L⁻¹g of the last factorization, or the step itself, by what the method is.
    pub(crate) forward: Vec<f64>,
    pub(crate) times: Times,
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

    /// The estimate, in the order of the values that the problem was compiled with.
    pub fn values(&self) -> Values {
        let mut values = Values::new();
        for place in &self.variables {
            if let Some(value) = self.columns.column(place.column).get(place.index) {
                values.insert_boxed(place.key.clone(), value);
            }
        }
        values
    }

    /// Number of scalar unknowns.
    pub fn dim(&self) -> usize {
        self.layout.dim()
    }

    /// Number of factors.
    pub fn factors(&self) -> usize {
        self.factor_variables.len()
    }

    /// The variables of a factor.
    pub(crate) fn factor_keys(&self, factor: usize) -> Vec<Key> {
        self.factor_variables
            .get(factor)
            .into_iter()
            .flatten()
            .map(|v| self.variables[*v as usize].key.clone())
            .collect()
    }

    /// Scalar unknowns of a variable: `None` where there is no such variable, or it is held.
    pub fn unknowns(&self, key: &str) -> Option<std::ops::Range<usize>> {
        let place = self.variables.iter().find(|p| p.key.as_str() == key)?;
        place.start.map(|s| s..s + place.tangent.len())
    }

    /// Fills H and g at the estimate, and decides which factors take part. Where something is not finite, a factor is
    /// named that it comes from.
    pub fn linearize(&mut self) -> Evaluation {
        let clock = Instant::now();
        self.h.fill(0.0);
        self.g.fill(0.0);
        let mut to = NormalEquations { h: &mut self.h, g: &mut self.g };
        let mut total = Evaluation::default();
        for batch in &mut self.batches {
            total = total.and(batch.linearize(&self.columns, &mut to));
        }
        for &i in &self.held {
            self.h[self.layout.diagonal()[i]] = 1.0;
        }
        if !total.cost.is_finite() || !self.is_finite() {
            total.not_finite = total.not_finite.or_else(|| Some(self.not_finite_factor()));
        }
        self.times.linearize += clock.elapsed().as_secs_f64();
        total
    }

    /// The lower triangle of H = JᵀJ as compressed columns, in the order of elimination, and g = Jᵀr;
    /// as of the last linearization.
    pub fn normal_equations(&self) -> (&[usize], &[u32], &[f64], &[f64]) {
        (&self.layout.col_ptr, &self.layout.row_idx, &self.h, &self.g)
    }

    /// Cost at the estimate, over the factors that took part in the last linearization.
    pub fn cost(&self) -> Evaluation {
        self.batches.iter().map(|b| b.cost(&self.columns)).fold(Evaluation::default(), Evaluation::and)
    }

    /// ½ρ of each factor at the estimate, in the order of the graph, whatever its weight; zero where it is not
    /// defined.
    pub fn factor_costs(&self, costs: &mut Vec<f64>) {
        costs.resize(self.factors(), 0.0);
        self.batches.iter().for_each(|b| b.costs(&self.columns, costs));
    }

    /// The weight of each factor, in the order of the graph; empty, where none was set.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Makes `estimate ⊞ step` the trial, and returns its cost.
    pub(crate) fn try_step(&mut self, step: &[f64]) -> Evaluation {
        let clock = Instant::now();
        for (i, starts) in self.starts.iter().enumerate() {
            self.trial.column_mut(i).retract_from(self.columns.column(i), starts, step);
        }
        let cost = self.batches.iter().map(|b| b.cost(&self.trial));
        let cost = cost.fold(Evaluation::default(), Evaluation::and);
        self.times.evaluate += clock.elapsed().as_secs_f64();
        cost
    }

    /// Makes the trial the estimate.
    pub(crate) fn accept(&mut self) {
        std::mem::swap(&mut self.columns, &mut self.trial);
    }

    /// Each factor as it stands at the estimate, in the order of the graph.
    pub fn inspect(&self) -> Vec<FactorState> {
        let mut all: Vec<_> = self.batches.iter().flat_map(|b| b.inspect(&self.columns)).collect();
        all.sort_by_key(|f| f.entry);
        all
    }

    /// Visits the rows of the whitened and weighted Jacobian at the estimate, batch by batch.
    pub fn rows(&self, visit: &mut dyn FnMut(FactorRows<'_>)) {
        self.batches.iter().for_each(|b| b.rows(&self.columns, visit));
    }

    /// Seconds spent so far.
    pub fn times(&self) -> Times {
        self.times
    }
}

impl std::fmt::Debug for Problem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (variables, factors, dim) = (self.variables.len(), self.factors(), self.dim());
        write!(f, "Problem({variables} variables, {factors} factors, {dim} unknowns)")
    }
}
