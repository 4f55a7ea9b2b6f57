//! Compiled problems, sparse linear algebra and solvers.
//!
//! [`Problem::compile`] turns a [`Graph`] and its [`Values`] into columns of variables, batches of factors
//! and the structure of their normal equations, once. An [`Optimizer`] moves the estimate of the problem,
//! and an [`Observer`] watches. [`solve`] combines these steps.
mod inspect;
mod linear;
mod observer;
pub mod odometry;
mod outcome;
mod problem;
mod strategy;

pub use inspect::{
    CovarianceError, Diagnosis, FactorCost, Factorized, Marginal, StartDiagnosis, WeakDirection,
};
pub use linear::memory::{Bytes, available_memory, memory_limit};
pub use linear::settings::{ConjugateGradients, LinearSolver, Method, Ordering, Preconditioner};
pub use linear::{BlockSystem, BlockSystemError};
pub use observer::{AllObservers, Interrupt, Observer, Silent};
pub use outcome::{
    ActiveBound, ConstraintState, InactiveFactor, IterationRecord, LargestMoves, Outcome, RejectedFactor,
    Times, UnconstrainedVariables,
};
pub use outcome::{Side, Stall, Termination, Tolerance, Undetermined};
pub use problem::{CompileError, Problem, ProblemChangeError, WeightError};
pub use strategy::{
    Auto, Candidates, Descent, DiagonalLimits, Dogleg, GaussNewton, GivenStart, Gnc, Growth,
    LevenbergMarquardt, NotLimits, Optimizer, Probability, Start, StartError, Stopping, TrialResult,
    TrialStep, Truncation,
};

/// The dense kernel of a front, for solvers that store their fronts themselves.
#[doc(hidden)]
pub mod front {
    pub use crate::linear::cholesky::kernel::eliminate;
    pub use crate::linear::cholesky::large::Scratch;
}

use manifactor_graph::batch::FactorState;
use manifactor_graph::{FactorEntry, Graph, Values};
use strategy::multipliers;

/// An estimate, and the outcome of its solve.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The estimate: the best found, however the solve ended.
    pub values: Values,
    /// Termination, costs, times and history of the solve.
    pub outcome: Outcome,
    /// Each factor at the estimate, in the order of the graph.
    pub factors: Vec<FactorState>,
    /// Weight of each factor by the solver, on top of its loss; empty if the solver does not weight
    /// factors.
    pub weights: Vec<f64>,
    /// The constraints with their multipliers.
    constraints: problem::Constraints,
    /// The solved problem, for queries about the estimate.
    problem: problem::SharedProblem,
}

/// Compiles and solves a graph, subject to its constraints.
///
/// # Errors
/// If graph and values do not fit each other. Numerical trouble is not an error: see
/// [`Outcome::termination`].
pub fn solve(
    graph: &Graph,
    values: &Values,
    optimizer: &dyn Optimizer,
    observer: &mut dyn Observer,
) -> Result<Solution, CompileError> {
    let solution = match graph.factors().iter().any(FactorEntry::is_constraint) {
        true => multipliers::solve(graph, values, optimizer, observer)?,
        false => optimizer.solve(graph, values, observer)?,
    };
    let Outcome { termination, iterations, initial_cost, final_cost, times, .. } = &solution.outcome;
    let (solver, seconds) = (optimizer.typetag_name(), times.total);
    tracing::info!(solver, iterations, initial_cost, final_cost, seconds, "{termination}");
    Ok(solution)
}

impl Solution {
    /// Takes estimate, factors and weights from a problem at the end of a solve.
    fn of(problem: Problem, outcome: Outcome) -> Self {
        let (values, factors, weights) = (problem.values(), problem.inspect(), problem.weights().to_vec());
        let constraints = problem.constraints.clone();
        let problem = problem::SharedProblem::new(problem);
        Self { values, outcome, factors, weights, constraints, problem }
    }
}
