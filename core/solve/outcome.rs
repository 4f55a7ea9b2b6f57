//! The outcome of a solve.
mod active_bound;
mod constraint_state;
mod moving;
mod termination;
mod unconstrained;

use manifactor_graph::Key;
use serde::Serialize;
use std::borrow::Cow;

pub use active_bound::{ActiveBound, Side};
pub use constraint_state::ConstraintState;
pub use moving::LargestMoves;
pub use termination::{Stall, Termination, Tolerance, Undetermined};
pub use unconstrained::{InactiveFactor, UnconstrainedVariables};

/// Termination, costs, diagnosis and history of a solve.
#[derive(Debug, Clone, Serialize)]
pub struct Outcome {
    /// ½ Σ ρ at the initial values.
    pub initial_cost: f64,
    /// ½ Σ ρ at the final values.
    pub final_cost: f64,
    /// Number of linearizations that were followed by a step.
    pub iterations: usize,
    /// Reason for the end of the solve.
    pub termination: Termination,
    /// A direction that only damping constrains.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub undetermined: Option<Undetermined>,
    /// The variables that the last step moved most, if the solve ran out of iterations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moving: Option<LargestMoves>,
    /// The bounds that hold the estimate.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub active_bounds: Vec<ActiveBound>,
    /// The equality constraints. The costs are those of the other factors.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub constraints: Vec<ConstraintState>,
    /// Free variables without an active factor. A solve with such variables is never converged.
    #[serde(rename = "untouched", skip_serializing_if = "Option::is_none")]
    pub unconstrained: Option<UnconstrainedVariables>,
    /// Number of factors in the problem.
    pub factors: usize,
    /// Number of factors that are undefined at the final values, and excluded from the cost.
    pub inactive: usize,
    /// The first ten inactive factors.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub inactive_factors: Vec<InactiveFactor>,
    /// Factors that the solver rejects as outliers, in the order of the graph.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rejected: Vec<RejectedFactor>,
    /// Durations of the stages.
    pub times: Times,
    /// A record for each tried step.
    pub history: Vec<IterationRecord>,
}

impl Outcome {
    /// Combines the outcomes of two consecutive solves of one problem. The end of `next` counts if it is
    /// `better`.
    pub(crate) fn then(self, mut next: Self, better: bool) -> Self {
        // a solve without a step does not search for undetermined directions, so the result of the first
        // one counts
        if next.iterations == 0 {
            next.undetermined = next.undetermined.or_else(|| self.undetermined.clone());
        }
        let (initial_cost, iterations) = (self.initial_cost, self.iterations + next.iterations);
        let times = self.times.and(next.times);
        let history = [&self.history[..], &next.history].concat();
        let end = if better { next } else { self };
        Self { initial_cost, iterations, times, history, ..end }
    }
}

/// A factor whose cost exceeds the inlier bound.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RejectedFactor {
    /// Index in the graph, from 0.
    pub factor: usize,
    /// Its name, or else the name of its type.
    pub name: Cow<'static, str>,
    /// Its variables.
    pub keys: Vec<Key>,
    /// Its remaining weight, from 0 to 1.
    pub weight: f64,
    /// Its cost at full weight.
    pub cost: f64,
}

/// Durations by stage, in seconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Times {
    /// Compilation of the graph: columns, batches, ordering, symbolic factorization.
    pub compile: f64,
    /// Residuals, Jacobians and normal equations.
    pub linearize: f64,
    /// Numeric Cholesky.
    pub factorize: f64,
    /// Triangular solves.
    pub solve: f64,
    /// Retractions and costs of trial steps.
    pub evaluate: f64,
    /// Search for undetermined directions, without its factorizations and solves.
    pub diagnose: f64,
    /// Everything else.
    pub other: f64,
    /// Total, including compilation.
    pub total: f64,
}

impl Times {
    /// Returns the sum of both.
    #[must_use]
    pub fn plus(self, next: Self) -> Self {
        Self {
            compile: self.compile + next.compile,
            linearize: self.linearize + next.linearize,
            factorize: self.factorize + next.factorize,
            solve: self.solve + next.solve,
            evaluate: self.evaluate + next.evaluate,
            diagnose: self.diagnose + next.diagnose,
            other: self.other + next.other,
            total: self.total + next.total,
        }
    }

    /// Returns the sum of two solves that share one compilation.
    fn and(self, next: Self) -> Self {
        self.plus(Self { compile: 0.0, total: next.total - next.compile, ..next })
    }

    /// Returns the sum of the stages of a solve, without compilation.
    pub(crate) fn stages(&self) -> f64 {
        self.linearize + self.factorize + self.solve + self.evaluate + self.diagnose
    }
}

/// One tried step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IterationRecord {
    /// Number of the linearization, from 1. A rejected step has the number of its linearization.
    pub iteration: usize,
    /// Cost at the linearization.
    pub cost: f64,
    /// Cost after the step; `None` if the step left the domain of a factor or the cost is not finite.
    pub trial_cost: Option<f64>,
    /// Largest entry of the gradient.
    pub gradient: f64,
    /// Euclidean norm of the step.
    pub step: f64,
    /// λ of Levenberg-Marquardt, radius of Dogleg, length factor of Gauss-Newton.
    pub control: f64,
    /// Whether the step was accepted.
    pub accepted: bool,
    /// Number of inactive factors.
    pub inactive: usize,
    /// Seconds since the start of the solve.
    pub seconds: f64,
}
