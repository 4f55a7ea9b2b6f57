//! What is worth a look after a solve: the worst factors, and the condition of the linear system.
use crate::Solution;
use crate::inspect::CovarianceError;
use crate::outcome::Undetermined;
use crate::problem::CompileError;
use crate::problem::Problem;
use manifactor_graph::batch::FactorState;
use manifactor_graph::{FactorEntry, Graph, Key};
use serde::Serialize;
use std::borrow::Cow;

/// Factors in the table of the worst.
const WORST: usize = 10;
/// Variables up to which the linear system is looked at: it takes some factorizations.
const LARGE: usize = 50_000;

/// What is worth a look after a solve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// The ten factors that cost the most, the worst first; none that cost nothing.
    pub worst: Vec<FactorCost>,
    /// See [`Problem::condition`]; `None` also where something is undetermined, and for more than 50,000 variables.
    pub condition: Option<f64>,
    /// A direction that nothing constrains at the estimate; not looked for among more than 50,000 variables.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub undetermined: Option<Undetermined>,
}

/// What one factor costs at the estimate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FactorCost {
    /// Its place in the graph, from 0.
    pub factor: usize,
    /// Its name, or else that of its type.
    pub name: Cow<'static, str>,
    /// Its variables.
    pub keys: Vec<Key>,
    /// Its residual, not whitened.
    pub residual: Vec<f64>,
    /// ½ρ, as much as it counts.
    pub cost: f64,
    /// How much it counts: by its loss, and by the solver's weight where that weighs factors.
    pub weight: f64,
}

impl Problem {
    /// A direction that nothing constrains at the estimate, as far as f64 can tell: neither damping nor what a solver
    /// found on its way has a part in it.
    pub fn undetermined(&mut self) -> Option<Undetermined> {
        match self.factorized() {
            Err(CovarianceError::Indeterminate(open)) => Some(open),
            _ => None,
        }
    }
}

impl Solution {
    /// Looks for what is wrong: the factors that fit worst, and a linear system that is close to open.
    ///
    /// # Errors
    /// If `graph` is not the one that was solved.
    pub fn diagnose(&self, graph: &Graph) -> Result<Diagnosis, CompileError> {
        let look = |problem: &mut Problem| match problem.factorized() {
            Ok(mut system) => (None, system.condition()),
            Err(CovarianceError::Indeterminate(open)) => (Some(open), None),
            Err(_) => (None, None),
        };
        let is_small = self.values.len() <= LARGE;
        let (undetermined, condition) = if is_small { self.ask(graph, look)? } else { (None, None) };
        let mut costly: Vec<_> = self.factors.iter().filter(|f| f.cost > 0.0).collect();
        costly.sort_by(|a, b| b.cost.total_cmp(&a.cost));
        let row = |(state, entry): (&FactorState, &FactorEntry)| FactorCost {
            factor: state.entry,
            name: entry.label(),
            keys: entry.keys.clone(),
            residual: state.residual.clone(),
            cost: state.cost,
            weight: state.weight,
        };
        let entries = costly.into_iter().filter_map(|f| Some((f, graph.factors().get(f.entry)?)));
        Ok(Diagnosis { worst: entries.take(WORST).map(row).collect(), condition, undetermined })
    }
}
