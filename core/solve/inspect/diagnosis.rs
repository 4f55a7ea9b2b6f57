//! Diagnosis after a solve: the factors with the largest costs, and the condition of the linear system.
use crate::Solution;
use crate::inspect::CovarianceError;
use crate::outcome::Undetermined;
use crate::problem::CompileError;
use crate::problem::Problem;
use manifactor_graph::batch::FactorState;
use manifactor_graph::{FactorEntry, Graph, Key};
use serde::Serialize;
use std::borrow::Cow;

/// Number of factors in the table of the worst.
const WORST_FACTORS: usize = 10;
/// Above this number of variables, the linear system is not analysed, since that takes several
/// factorizations.
const MAX_ANALYSED_VARIABLES: usize = 50_000;

/// Diagnosis after a solve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// The ten factors with the largest costs, in descending order, without those of zero cost.
    pub worst: Vec<FactorCost>,
    /// See [`Problem::condition`]. `None` if a direction is undetermined, and above 50,000 variables.
    pub condition: Option<f64>,
    /// An undetermined direction at the estimate; not searched for above 50,000 variables.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub undetermined: Option<Undetermined>,
}

/// Cost of one factor at the estimate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FactorCost {
    /// Index in the graph, from 0.
    pub factor: usize,
    /// Its name, or else the name of its type.
    pub name: Cow<'static, str>,
    /// Its variables.
    pub keys: Vec<Key>,
    /// Its unwhitened residual.
    pub residual: Vec<f64>,
    /// Cost ½ρ, with its weight.
    pub cost: f64,
    /// Weight from its loss, multiplied by the weight of the solver if the solver weights factors.
    pub weight: f64,
}

impl Problem {
    /// Returns an undetermined direction at the estimate, as far as f64 can tell. The result depends
    /// neither on damping nor on directions that a solver found on its way.
    pub fn undetermined(&mut self) -> Option<Undetermined> {
        match self.factorized() {
            Err(CovarianceError::Indeterminate(open)) => Some(open),
            _ => None,
        }
    }
}

impl Solution {
    /// Looks for problems: the factors with the largest costs, and an ill-conditioned or singular linear
    /// system.
    ///
    /// # Errors
    /// If `graph` is not the solved graph.
    pub fn diagnose(&self, graph: &Graph) -> Result<Diagnosis, CompileError> {
        let look = |problem: &mut Problem| match problem.factorized() {
            Ok(mut system) => (None, system.condition()),
            Err(CovarianceError::Indeterminate(open)) => (Some(open), None),
            Err(_) => (None, None),
        };
        let is_small = self.values.len() <= MAX_ANALYSED_VARIABLES;
        let (undetermined, condition) = if is_small { self.query(graph, look)? } else { (None, None) };
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
        Ok(Diagnosis { worst: entries.take(WORST_FACTORS).map(row).collect(), condition, undetermined })
    }
}
