//! The interface of solvers, and stopping criteria.
use crate::Solution;
use crate::linear::settings::LinearSolver;
use crate::observer::Observer;
use crate::outcome::Outcome;
use crate::problem::CompileError;
use crate::problem::Problem;
use manifactor_graph::checked::NotNegative;
use manifactor_graph::{Graph, Values};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;

/// A solver, which lowers the cost of a problem. Documents choose it by name.
#[typetag::serialize(tag = "type")]
pub trait Optimizer: Debug + Send + Sync {
    /// Moves the estimate of a compiled problem to a minimum, or as close as possible. The final estimate
    /// is the best one found, for every termination. Loops that keep their problem call it directly.
    fn descend(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome;

    /// Returns the settings of the linear solver for each step.
    fn linear(&self) -> LinearSolver {
        LinearSolver::default()
    }

    /// Compiles a graph, and [`descend`](Self::descend)s from `values`. Override it in a solver with
    /// further starts, such as the registered starts of `auto`. [`solve`](crate::solve()) calls it.
    ///
    /// # Errors
    /// If graph and values do not fit each other.
    fn solve(
        &self,
        graph: &Graph,
        values: &Values,
        observer: &mut dyn Observer,
    ) -> Result<Solution, CompileError> {
        let mut problem = Problem::compile_for(graph, values, &self.linear())?;
        let outcome = self.descend(&mut problem, observer);
        Ok(Solution::of(problem, outcome))
    }
}

manifactor_graph::kind!(dyn Optimizer, "solver");

/// Stopping criteria.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Stopping {
    /// Maximum number of linearizations.
    pub max_iterations: usize,
    /// Stop once a step changes the cost by less than this share of it. Default: 1e-8. With at most 32
    /// unknowns, steps continue to 1e-15, which is rounding error, as long as there are iterations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative_cost: Option<NotNegative>,
    /// Stop once the cost is below this. For coordinates below one it shrinks with their square.
    pub absolute_cost: NotNegative,
    /// Stop once no entry of the gradient is larger than this, and no single unknown could lower the cost by a
    /// thousandth.
    pub gradient: NotNegative,
    /// Stop once the Euclidean norm of a step is below this, and it changes no coordinate by a millionth of its value.
    pub step: NotNegative,
}

impl Default for Stopping {
    fn default() -> Self {
        Self {
            max_iterations: 100,
            relative_cost: None,
            absolute_cost: NotNegative::literal(1e-20),
            gradient: NotNegative::literal(1e-12),
            step: NotNegative::literal(1e-12),
        }
    }
}

impl Stopping {
    /// Returns the relative change of the cost that shows a minimum.
    pub(crate) fn relative_cost(&self) -> f64 {
        self.relative_cost.map_or(1e-8, |share| *share)
    }
    /// Returns the relative change of the cost down to which a solve with this number of unknowns continues.
    pub(crate) fn exact_cost(&self, unknowns: usize) -> f64 {
        /// Maximum number of unknowns for which further steps cost little.
        const MAX_SMALL: usize = 32;
        match self.relative_cost {
            None if unknowns <= MAX_SMALL => 1e-15,
            _ => self.relative_cost(),
        }
    }
}
