//! Compiled problems, sparse linear algebra and solvers.
//!
//! [`Problem::compile`] turns a [`Graph`] and its [`Values`] into columns of variables, batches of
//! factors and the structure of their normal equations, once. An [`Optimizer`] moves the problem's
//! estimate; an [`Observer`] watches. [`solve`] does it all.
mod auto;
mod block_system;
mod compile;
mod condition;
mod covariance;
mod diagnose;
mod diagnosis;
mod dogleg;
mod gauss_newton;
mod gnc;
mod kept;
mod layout;
mod levenberg_marquardt;
mod leverage;
mod linear;
mod linear_solver;
mod linear_system;
mod observer;
mod optimizer;
mod outcome;
mod problem;
mod start;
mod system;
mod termination;

pub use auto::Auto;
pub use block_system::{BlockSystem, BlockSystemError};
pub use compile::CompileError;
pub use covariance::{CovarianceError, Marginal};
pub use diagnosis::{Diagnosis, FactorCost};
pub use dogleg::Dogleg;
pub use gauss_newton::GaussNewton;
pub use gnc::{BadParameter, Candidates, FactorType, Gnc, Growth, Probability, Truncation, UnknownFactor};
pub use levenberg_marquardt::LevenbergMarquardt;
pub use linear::memory::{Bytes, available_memory, memory_limit};
pub use linear_solver::{ConjugateGradients, LinearSolver, Method, Ordering, Preconditioner};
pub use observer::{All, Interrupt, Observer, Silent};
pub use optimizer::{Optimizer, SettingError, Stopping};
pub use outcome::{InactiveFactor, IterationRecord, Moving, Outcome, Rejected, Times, Untouched};
pub use problem::{Problem, WeightError};
pub use start::{Given, Start, StartError};
pub use termination::{Stall, Termination, Tolerance, Undetermined};

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
    problem: kept::Kept,
}

/// Compiles and solves.
///
/// # Errors
/// Where graph and values do not fit each other, or a setting of the solver is outside its domain. Numerical trouble is no error: see
/// [`Outcome::termination`].
pub fn solve(
    graph: &Graph,
    values: &Values,
    optimizer: &dyn Optimizer,
    observer: &mut dyn Observer,
) -> Result<Solution, CompileError> {
    optimizer.check()?;
    let solution = optimizer.solve_graph(graph, values, observer)?;
    let Outcome { termination, iterations, initial_cost, final_cost, times, .. } = &solution.outcome;
    let (solver, seconds) = (optimizer.typetag_name(), times.total);
    tracing::info!(solver, iterations, initial_cost, final_cost, seconds, "{termination}");
    Ok(solution)
}

impl Solution {
    /// The problem's estimate, at the end of a solve.
    fn of(problem: Problem, outcome: Outcome) -> Self {
        let (values, factors, weights) = (problem.values(), problem.inspect(), problem.weights().to_vec());
        Self { values, outcome, factors, weights, problem: kept::Kept::new(problem) }
    }
}
