//! Compiled problems, sparse linear algebra and solvers.
//!
//! [`Problem::compile`] turns a [`Graph`] and its [`Values`] into columns of variables, batches of
//! factors and the structure of their normal equations, once. An [`Optimizer`] moves the problem's
//! estimate; an [`Observer`] watches. [`solve`] does it all.
mod inspect;
mod linear;
mod observer;
mod outcome;
mod problem;
mod strategy;

pub use inspect::{AtStart, CovarianceError, Diagnosis, FactorCost, Factorized, Marginal, Weak};
pub use linear::memory::{Bytes, available_memory, memory_limit};
pub use linear::settings::{ConjugateGradients, LinearSolver, Method, Ordering, Preconditioner};
pub use linear::{BlockSystem, BlockSystemError};
pub use observer::{All, Interrupt, Observer, Silent};
pub use outcome::{InactiveFactor, IterationRecord, Moving, Outcome, Rejected, Times, Untouched};
pub use outcome::{Stall, Termination, Tolerance, Undetermined};
pub use problem::{ChangeError, CompileError, Problem, WeightError};
pub use strategy::{
    Auto, Candidates, Descent, DiagonalLimits, Dogleg, FactorType, GaussNewton, Given, Gnc, Growth,
    LevenbergMarquardt, NotLimits, Optimizer, Probability, Start, StartError, Step, Stopping, Tried,
    Truncation, UnknownFactor, is_sequential,
};

/// The dense kernel of a front, for solvers that keep fronts of their own.
#[doc(hidden)]
pub mod front {
    pub use crate::linear::cholesky::kernel::eliminate;
    pub use crate::linear::cholesky::large::Scratch;
}

use manifactor_graph::batch::FactorState;
use manifactor_graph::{Graph, Values};

/// An estimate, and how it came about.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The estimate: the best found, however the solve ended.
    pub values: Values,
    /// What the solver has to tell.
    pub outcome: Outcome,
    /// Each factor at the estimate, in the order of the graph.
    pub factors: Vec<FactorState>,
    /// How often the solver has let each factor count, on top of its loss; empty, where it does not weigh them.
    pub weights: Vec<f64>,
    /// What was solved, for questions about the estimate.
    problem: problem::Kept,
}

/// Compiles and solves.
///
/// # Errors
/// Graph and values that do not fit each other. Numerical trouble is no error: see [`Outcome::termination`].
pub fn solve(
    graph: &Graph,
    values: &Values,
    optimizer: &dyn Optimizer,
    observer: &mut dyn Observer,
) -> Result<Solution, CompileError> {
    let solution = optimizer.solve(graph, values, observer)?;
    let Outcome { termination, iterations, initial_cost, final_cost, times, .. } = &solution.outcome;
    let (solver, seconds) = (optimizer.typetag_name(), times.total);
    tracing::info!(solver, iterations, initial_cost, final_cost, seconds, "{termination}");
    Ok(solution)
}

impl Solution {
    /// The problem's estimate, at the end of a solve.
    fn of(problem: Problem, outcome: Outcome) -> Self {
        let (values, factors, weights) = (problem.values(), problem.inspect(), problem.weights().to_vec());
        Self { values, outcome, factors, weights, problem: problem::Kept::new(problem) }
    }
}
