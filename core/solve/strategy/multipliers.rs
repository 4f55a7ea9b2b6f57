//! The method of multipliers, for graphs with equality constraints.
//!
//! Minimizes f subject to c = 0 by a series of minima of f + ½μ‖c + λ/μ‖², with λ ← λ + μc after each (Hestenes 1969,
//! Powell 1969; Nocedal and Wright, *Numerical Optimization*, section 17.3). Each term is a residual, so every solver
//! applies as it is.
use crate::Solution;
use crate::observer::Observer;
use crate::outcome::{Outcome, Stall, Termination};
use crate::problem::{CONSTRAINT_TOLERANCE, CompileError, Problem};
use crate::strategy::optimizer::Optimizer;
use manifactor_graph::{Graph, Values};

/// Maximum number of minima. With stiff penalties, five to ten suffice.
const MAX_ROUNDS: usize = 40;
/// Share of the violation above which a round has lowered it too little.
const MAX_SHARE: f64 = 0.25;
/// Factor of the penalty after such a round.
const GROWTH: f64 = 10.0;

/// Factor of the penalty for queries such as covariances, which a solve would not bear.
const QUERY_PENALTY: f64 = 1e4;

/// Solves a graph with constraints, from `values`.
pub(crate) fn solve(
    graph: &Graph,
    values: &Values,
    optimizer: &dyn Optimizer,
    observer: &mut dyn Observer,
) -> Result<Solution, CompileError> {
    let mut problem = Problem::compile_for(graph, values, &optimizer.linear())?;
    let initial_cost = problem.objective();
    let mut penalty = problem.stiff_penalty();
    problem.set_penalty(penalty);
    let mut outcome = optimizer.descend(&mut problem, observer);
    let mut before = f64::INFINITY;
    let mut violation = problem.violation();
    for _ in 0..MAX_ROUNDS {
        if !outcome.termination.is_converged() {
            break;
        }
        problem.update_multipliers();
        if violation <= CONSTRAINT_TOLERANCE {
            break;
        }
        if violation > MAX_SHARE * before {
            penalty *= GROWTH;
        }
        before = violation;
        problem.set_penalty(penalty);
        let next = optimizer.descend(&mut problem, observer);
        outcome = outcome.then(next, true);
        violation = problem.violation();
        tracing::debug!(violation, penalty, "updated the multipliers");
    }
    let termination = match outcome.termination {
        Termination::Converged { .. } if violation > CONSTRAINT_TOLERANCE => {
            Termination::Stalled { reason: Stall::Violation }
        }
        termination => termination,
    };
    problem.set_penalty(QUERY_PENALTY * penalty);
    let (final_cost, constraints) = (problem.objective(), problem.constraint_states());
    let outcome = Outcome { initial_cost, final_cost, constraints, termination, ..outcome };
    Ok(Solution::of(problem, outcome))
}
