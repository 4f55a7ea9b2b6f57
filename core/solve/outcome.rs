//! What a solve has to tell.
mod moving;
mod termination;
mod untouched;

use manifactor_graph::Key;
use serde::Serialize;
use std::borrow::Cow;

pub use moving::Moving;
pub use termination::{Stall, Termination, Tolerance, Undetermined};
pub use untouched::{InactiveFactor, Untouched};

/// What a solve did and how it ended.
#[derive(Debug, Clone, Serialize)]
pub struct Outcome {
    /// ½ Σ ρ at the values that the solve began with.
    pub initial_cost: f64,
    /// ½ Σ ρ at the values that it leaves.
    pub final_cost: f64,
    /// Linearizations that were followed by a step.
    pub iterations: usize,
    /// How it ended.
    pub termination: Termination,
    /// A direction that nothing but damping constrains.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub undetermined: Option<Undetermined>,
    /// What the last step still moved, where iterations ran out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moving: Option<Moving>,
    /// Free variables that no factor which takes part touches. A solve with such is never converged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub untouched: Option<Untouched>,
    /// Factors in the problem.
    pub factors: usize,
    /// Factors that are not defined at the final values, and take no part in the cost.
    pub inactive: usize,
    /// The first ten of these.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub inactive_factors: Vec<InactiveFactor>,
    /// Factors that a solver has found to be outliers, in the order of the graph.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rejected: Vec<Rejected>,
    /// Where the time went.
    pub times: Times,
    /// A record for each step tried.
    pub history: Vec<IterationRecord>,
}

impl Outcome {
    /// The account of two solves of one problem, the first and the `next`, whose end counts if it is `better`.
    pub(crate) fn then(self, mut next: Self, better: bool) -> Self {
        // one that takes no step does not look for what is open: that is as the first has left it
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

/// A factor that costs more than an inlier may.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rejected {
    /// Its place in the graph, from 0.
    pub factor: usize,
    /// Its name, or else that of its type.
    pub name: Cow<'static, str>,
    /// Its variables.
    pub keys: Vec<Key>,
    /// How much it still counts, from 0 to 1.
    pub weight: f64,
    /// What it would cost with full weight.
    pub cost: f64,
}

/// Seconds by stage.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Times {
    /// From graph to problem: columns, batches, ordering, symbolic factorization.
    pub compile: f64,
    /// Residuals, Jacobians and normal equations.
    pub linearize: f64,
    /// Numeric Cholesky.
    pub factorize: f64,
    /// Triangular solves.
    pub solve: f64,
    /// Retractions and costs of trial steps.
    pub evaluate: f64,
    /// The search for directions that nothing constrains, but for its factorizations and solves.
    pub diagnose: f64,
    /// All else.
    pub other: f64,
    /// All of it, compilation included.
    pub total: f64,
}

impl Times {
    /// Both together.
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

    /// Both, of one compilation.
    fn and(self, next: Self) -> Self {
        self.plus(Self { compile: 0.0, total: next.total - next.compile, ..next })
    }

    /// What the stages of a solve have taken, its compilation excluded.
    pub(crate) fn stages(&self) -> f64 {
        self.linearize + self.factorize + self.solve + self.evaluate + self.diagnose
    }
}

/// One step that was tried.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IterationRecord {
    /// From 1; a refused step keeps the number of the linearization that it came from.
    pub iteration: usize,
    /// Cost at the linearization.
    pub cost: f64,
    /// Cost after the step; `None` where it left the domain of a factor or was not finite.
    pub trial_cost: Option<f64>,
    /// Largest entry of the gradient.
    pub gradient: f64,
    /// Euclidean norm of the step.
    pub step: f64,
    /// λ of Levenberg-Marquardt, radius of Dogleg, length factor of Gauss-Newton.
    pub control: f64,
    /// Whether the step was taken.
    pub accepted: bool,
    /// Factors that take no part.
    pub inactive: usize,
    /// Seconds since the solve began.
    pub seconds: f64,
}
