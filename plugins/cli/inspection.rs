//! A graph for display: its connections, and the cost of each factor before and after a solve.
mod dot;

use crate::failure::Failure;
use crate::output::text::Table;
use manifactor::graph::{Bounds, Fixed, Graph, Values};
use manifactor::solve::Problem;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;

/// A graph with its costs.
#[derive(Debug, Serialize)]
pub(crate) struct Inspection {
    pub variables: Vec<VariableRow>,
    pub factors: Vec<FactorRow>,
    /// Numbers of the factors of each key.
    pub factors_by_key: BTreeMap<String, Vec<usize>>,
    pub cost: Costs,
}

#[derive(Debug, Serialize)]
pub(crate) struct VariableRow {
    pub key: String,
    #[serde(rename = "type")]
    pub of_type: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fixed: Option<Fixed>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bounds: Option<Bounds>,
    pub before: Value,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub after: Option<Value>,
}

#[derive(Debug, Serialize)]
pub(crate) struct FactorRow {
    /// Index of the factor in the graph, from 0.
    pub number: usize,
    #[serde(rename = "type")]
    pub of_type: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    pub keys: Vec<String>,
    pub before: State,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub after: Option<State>,
}

impl FactorRow {
    /// Name of the factor, or else of its type.
    pub(crate) fn label(&self) -> &str {
        self.name.as_deref().unwrap_or(self.of_type)
    }
}

/// A factor evaluated at some values.
#[derive(Debug, Clone, Default, Serialize)]
pub(crate) struct State {
    /// Residual before whitening; empty if it is undefined.
    pub residual: Vec<f64>,
    /// Half the robust loss, ½ρ.
    pub cost: f64,
    /// Weight from the robust loss.
    pub weight: f64,
}

#[derive(Debug, Serialize)]
pub(crate) struct Costs {
    pub before: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub after: Option<f64>,
}

impl Inspection {
    /// Evaluates a graph at its values, and at the estimate of a solver with its states if there is one.
    pub(crate) fn new(
        graph: &Graph,
        before: &Values,
        after: Option<(&Values, Vec<State>)>,
    ) -> Result<Self, Failure> {
        let states = states(&Problem::compile(graph, before).map_err(Failure::input)?, graph);
        let (estimate, after) = after.unzip();
        let json = |value| serde_json::to_value(value).unwrap_or_default();
        let variables = before.iter().map(|(key, value)| VariableRow {
            key: key.to_string(),
            of_type: value.typetag_name(),
            fixed: graph.fixed().get(key).cloned(),
            bounds: graph.bounds().get(key).cloned(),
            before: json(value),
            after: estimate.and_then(|values| values.variable(key.as_str())).map(json),
        });
        let mut factors_by_key: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        let total = |states: &[State]| states.iter().map(|s| s.cost).sum();
        let cost = Costs { before: total(&states), after: after.as_deref().map(total) };
        let mut factors = vec![];
        for (number, (entry, before)) in graph.factors().iter().zip(states).enumerate() {
            let keys: Vec<String> = entry.keys.iter().map(ToString::to_string).collect();
            for key in &keys {
                factors_by_key.entry(key.clone()).or_default().push(number);
            }
            let after = after.as_ref().and_then(|states| states.get(number)).cloned();
            let (of_type, name) = (entry.factor.typetag_name(), entry.name.as_deref().map(str::to_owned));
            factors.push(FactorRow { number, of_type, name, keys, before, after });
        }
        Ok(Self { variables: variables.collect(), factors, factors_by_key, cost })
    }

    /// Sorts the factors by decreasing cost; equal costs keep the order of the graph.
    pub(crate) fn sort_by_cost(&mut self) {
        let cost = |row: &FactorRow| row.after.as_ref().unwrap_or(&row.before).cost;
        self.factors.sort_by(|a, b| cost(b).total_cmp(&cost(a)));
    }

    /// A table of the factors with their keys and costs.
    pub(crate) fn table(&self) -> String {
        let header = ["factor", "keys", "cost before", "after", "weight", "residual"];
        let mut table = Table::of_numbers(&header);
        for row in &self.factors {
            let last = row.after.as_ref().unwrap_or(&row.before);
            let residual: Vec<_> = last.residual.iter().map(|r| format!("{r:.3}")).collect();
            table.row([
                format!("{} {}", row.number, row.label()),
                row.keys.join(", "),
                format!("{:.4}", row.before.cost),
                row.after.as_ref().map_or_else(|| "-".into(), |s| format!("{:.4}", s.cost)),
                format!("{:.3}", last.weight),
                if residual.is_empty() { "undefined".into() } else { residual.join(" ") },
            ]);
        }
        let after = self.cost.after.map(|c| format!(" -> {c:.6}")).unwrap_or_default();
        format!("{}\ncost {:.6}{after}\n", table.text(), self.cost.before)
    }

    /// The graph as Graphviz.
    pub(crate) fn dot(&self) -> String {
        dot::write(self)
    }
}

/// State of each factor in a solved problem, in the order of the graph.
pub(crate) fn states(problem: &Problem, graph: &Graph) -> Vec<State> {
    let mut states = vec![State::default(); graph.factors().len()];
    for found in problem.inspect() {
        if let Some(state) = states.get_mut(found.entry) {
            let residual = if found.defined { found.residual } else { vec![] };
            *state = State { residual, cost: found.cost, weight: found.weight };
        }
    }
    states
}
