//! The report of a solve, which is pickled with its solution.
use crate::errors;
use manifactor::graph::batch::FactorState;
use manifactor::graph::{Graph, Values};
use manifactor::solve::{LevenbergMarquardt, Outcome, Silent, Solution, Stopping, solve};
use manifactor::viz::SolveSummary;
use pyo3::prelude::*;
use serde_json::Value as Json;

/// The report of the solver for Python.
#[derive(Clone, IntoPyObject, FromPyObject)]
#[pyo3(from_item_all)]
pub(super) struct Account {
    pub converged: bool,
    pub termination: String,
    pub initial_cost: f64,
    pub final_cost: f64,
    pub iterations: usize,
    /// The report in words, and the costs of the steps.
    pub verdict: String,
    pub warnings: Vec<String>,
    pub costs: Vec<f64>,
    /// The whole report, and the seconds by stage, as JSON.
    pub outcome: String,
    pub times: String,
}

impl Account {
    pub(super) fn new(outcome: &Outcome) -> PyResult<Self> {
        let json = |value: Result<String, serde_json::Error>| value.map_err(errors::internal);
        let SolveSummary { verdict, warnings, costs } = SolveSummary::new(outcome);
        Ok(Self {
            verdict,
            warnings,
            costs,
            converged: outcome.termination.is_converged(),
            termination: outcome.termination.to_string(),
            initial_cost: outcome.initial_cost,
            final_cost: outcome.final_cost,
            iterations: outcome.iterations,
            outcome: json(serde_json::to_string(outcome))?,
            times: json(serde_json::to_string(&outcome.times))?,
        })
    }

    /// Returns the report in words.
    pub(super) fn summary(&self) -> SolveSummary {
        let Self { verdict, warnings, costs, .. } = self.clone();
        SolveSummary { verdict, warnings, costs }
    }
}

/// Parses a JSON text of [`Account`].
pub(super) fn parsed(text: &str) -> PyResult<Json> {
    serde_json::from_str(text).map_err(errors::internal)
}

/// State of a factor at the estimate.
#[derive(IntoPyObject, FromPyObject)]
#[pyo3(from_item_all)]
pub(super) struct State {
    entry: usize,
    defined: bool,
    residual: Vec<f64>,
    whitened: Vec<f64>,
    weight: f64,
    cost: f64,
}

impl From<FactorState> for State {
    fn from(state: FactorState) -> Self {
        let FactorState { entry, defined, residual, whitened, weight, cost } = state;
        Self { entry, defined, residual, whitened, weight, cost }
    }
}

impl From<State> for FactorState {
    fn from(state: State) -> Self {
        let State { entry, defined, residual, whitened, weight, cost } = state;
        Self { entry, defined, residual, whitened, weight, cost }
    }
}

/// Returns the solution of a graph at these values, with the states and weights of the original solve. It
/// takes no step.
pub(super) fn restored(
    graph: &Graph,
    values: &Values,
    states: Vec<State>,
    weights: Vec<f64>,
) -> Result<Solution, String> {
    let stop = Stopping { max_iterations: 0, ..Stopping::default() };
    let solver = LevenbergMarquardt { stop, ..LevenbergMarquardt::default() };
    let mut solution = solve(graph, values, &solver, &mut Silent).map_err(|error| error.to_string())?;
    solution.values = values.clone();
    solution.factors = states.into_iter().map(Into::into).collect();
    solution.weights = weights;
    Ok(solution)
}
