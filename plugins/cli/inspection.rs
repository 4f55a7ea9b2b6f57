//! A graph to look at: what is connected to what, and what each factor costs before and after a solve.
mod dot;
mod svg;

use crate::failure::Failure;
use crate::output::text::Table;
use manifactor::graph::{Fixed, Graph, Values};
use manifactor::solve::Problem;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;

/// A graph with its costs.
#[derive(Debug, Serialize)]
pub(crate) struct Inspection {
    pub variables: Vec<VariableRow>,
    pub factors: Vec<FactorRow>,
    /// By key, the numbers of its factors.
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
    pub before: Value,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub after: Option<Value>,
}

#[derive(Debug, Serialize)]
pub(crate) struct FactorRow {
    /// Its place in the graph, from 0.
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
    /// Its name, or else that of its type.
    pub(crate) fn label(&self) -> &str {
        self.name.as_deref().unwrap_or(self.of_type)
    }
}

/// A factor at some values.
#[derive(Debug, Clone, Default, Serialize)]
pub(crate) struct State {
    /// Not whitened; empty where it is not defined.
    pub residual: Vec<f64>,
    /// ½ρ.
    pub cost: f64,
    /// How much it counts.
    pub weight: f64,
}

#[derive(Debug, Serialize)]
pub(crate) struct Costs {
    pub before: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub after: Option<f64>,
}

impl Inspection {
    /// Looks at a graph at its values, and at the estimate with the states that a solver left, where there is one.
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

    /// Puts the factors that cost most first; those that cost the same stay in the order of the graph.
    pub(crate) fn sort_by_cost(&mut self) {
        let cost = |row: &FactorRow| row.after.as_ref().unwrap_or(&row.before).cost;
        self.factors.sort_by(|a, b| cost(b).total_cmp(&cost(a)));
    }

    /// The factors of each key, with what they cost.
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
                if residual.is_empty() { "not defined".into() } else { residual.join(" ") },
            ]);
        }
        let after = self.cost.after.map(|c| format!(" -> {c:.6}")).unwrap_or_default();
        format!("{}\ncost {:.6}{after}\n", table.text(), self.cost.before)
    }

    /// In the language of Graphviz.
    pub(crate) fn dot(&self) -> String {
        dot::write(self)
    }

    /// A picture, seen from above.
    pub(crate) fn svg(&self) -> String {
        svg::write(self)
    }
}

/// What each factor costs in a problem, in the order of the graph.
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
