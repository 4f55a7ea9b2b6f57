//! What a solver is, and when it stops.
use crate::Solution;
use crate::linear::settings::LinearSolver;
use crate::observer::Observer;
use crate::outcome::Outcome;
use crate::problem::CompileError;
use crate::problem::Problem;
use manifactor_graph::checked::not_negative;
use manifactor_graph::{Graph, Values};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;

use crate::setting::{SettingError, not_negative as all_not_negative};

/// A strategy that lowers the cost of a problem. Chosen by name.
#[typetag::serialize(tag = "type")]
pub trait Optimizer: Debug + Send + Sync {
    /// Moves a compiled problem's estimate downhill from where it is, to a minimum or as far as it gets. The estimate is the
    /// best found, however that ends. It is what a loop calls that keeps its problem.
    fn descend(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome;

    /// How the linear system of each step is solved.
    fn linear(&self) -> LinearSolver {
        LinearSolver::default()
    }

    /// Whether each setting is within its domain. [`solve`](crate::solve()) asks before it begins; a config is checked
    /// when it is read.
    ///
    /// # Errors
    /// Names the setting that is not.
    fn check(&self) -> Result<(), SettingError> {
        Ok(())
    }

    /// Solves a graph: compiles it, and [`descend`](Self::descend)s from `values`. A solver that begins elsewhere as well, as
    /// `auto` does with the registered starts, overrides this. [`solve`](crate::solve()) calls it, once settings are checked.
    ///
    /// # Errors
    /// Where graph and values do not fit each other.
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

/// When to stop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Stopping {
    /// Most linearizations.
    pub max_iterations: usize,
    /// Stop once a step changes the cost by less than this share of it.
    #[serde(deserialize_with = "not_negative")]
    #[schemars(extend("minimum" = 0))]
    pub relative_cost: f64,
    /// Stop once the cost is below this.
    #[serde(deserialize_with = "not_negative")]
    #[schemars(extend("minimum" = 0))]
    pub absolute_cost: f64,
    /// Stop once no entry of the gradient is larger than this.
    #[serde(deserialize_with = "not_negative")]
    #[schemars(extend("minimum" = 0))]
    pub gradient: f64,
    /// Stop once the Euclidean norm of a step is below this.
    #[serde(deserialize_with = "not_negative")]
    #[schemars(extend("minimum" = 0))]
    pub step: f64,
}

impl Default for Stopping {
    fn default() -> Self {
        Self { max_iterations: 100, relative_cost: 1e-8, absolute_cost: 1e-20, gradient: 1e-12, step: 1e-12 }
    }
}

impl Stopping {
    /// Whether each tolerance is a finite number, 0 or more: one that is not would never be met.
    ///
    /// # Errors
    /// Names the one that is not.
    pub fn check(&self) -> Result<(), SettingError> {
        all_not_negative(&[
            ("stop.relative_cost", self.relative_cost),
            ("stop.absolute_cost", self.absolute_cost),
            ("stop.gradient", self.gradient),
            ("stop.step", self.step),
        ])
    }
}
