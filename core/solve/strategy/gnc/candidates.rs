//! Selection of the factors that may be outliers.
use crate::odometry::{by_variables, is_sequential};
use crate::problem::{Problem, ProblemFactor};
use manifactor_graph::VariableIndices;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The factors that may be outliers. All remaining factors are trusted, and keep their full weight.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Candidates {
    /// Factors that couple variables, except odometry: the only factor between consecutive variables of one
    /// type, in the order of the values. If there are several between the same variables, all of them are
    /// candidates, since any may be a wrong loop closure. Priors and other factors of a single variable are
    /// trusted.
    #[default]
    LoopClosures,
    /// Every factor.
    All,
}

impl Candidates {
    /// Returns for each factor whether it is a candidate.
    pub(crate) fn of(self, problem: &Problem) -> Vec<bool> {
        let all =
            problem.model.factors.iter().map(|factor| (VariableIndices::from_slice(&factor.variables), ()));
        let connections = by_variables(all);
        let may = |factor: &ProblemFactor| match self {
            Self::All => true,
            Self::LoopClosures => {
                let place = |variable: &u32| &problem.model.variables[*variable as usize];
                let places =
                    factor.variables.iter().map(place).map(|place| (place.column, place.index as u64));
                let is_alone = || {
                    let mut variables = VariableIndices::from_slice(&factor.variables);
                    variables.sort_unstable();
                    connections.get(&variables).is_some_and(|factors| factors.len() == 1)
                };
                factor.variables.len() > 1 && !(is_sequential(places) && is_alone())
            }
        };
        problem.model.factors.iter().map(may).collect()
    }
}
