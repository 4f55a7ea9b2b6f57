//! Selection of the factors that may be outliers.
use crate::problem::{Problem, ProblemFactor};
use manifactor_graph::{VariableIndices, catalogue};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use smallvec::SmallVec;
use std::collections::HashMap;

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

/// The name of a registered factor.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub struct FactorType(String);

/// The error for a name without a factor.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no factor `{0}`; see `manifactor list factors`")]
pub struct UnknownFactor(String);

impl TryFrom<String> for FactorType {
    type Error = UnknownFactor;
    fn try_from(name: String) -> Result<Self, UnknownFactor> {
        match catalogue::find("factor", &name) {
            Some(_) => Ok(Self(name)),
            None => Err(UnknownFactor(name)),
        }
    }
}

impl From<FactorType> for String {
    fn from(name: FactorType) -> Self {
        name.0
    }
}

impl FactorType {
    /// Returns the name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Candidates {
    /// Returns for each factor whether it is a candidate.
    pub(crate) fn of(self, problem: &Problem) -> Vec<bool> {
        let mut connections: HashMap<VariableIndices, usize> = HashMap::new();
        for factor in problem.model.factors.iter().filter(|factor| factor.variables.len() > 1) {
            *connections.entry(sorted(&factor.variables)).or_default() += 1;
        }
        let may = |factor: &ProblemFactor| match self {
            Self::All => true,
            Self::LoopClosures => {
                let place = |variable: &u32| &problem.model.variables[*variable as usize];
                let places =
                    factor.variables.iter().map(place).map(|place| (place.column, place.index as u64));
                let is_alone = || connections.get(&sorted(&factor.variables)) == Some(&1);
                factor.variables.len() > 1 && !(is_sequential(places) && is_alone())
            }
        };
        problem.model.factors.iter().map(may).collect()
    }
}

/// Returns whether variables are of one type and consecutive, like the variables of odometry.
///
/// A variable is given by its column, one for each type, and its position among the variables of that type.
pub fn is_sequential(variables: impl IntoIterator<Item = (usize, u64)>) -> bool {
    let variables: SmallVec<[(usize, u64); 4]> = variables.into_iter().collect();
    variables.windows(2).all(|pair| pair[0].0 == pair[1].0 && pair[0].1.abs_diff(pair[1].1) == 1)
}

fn sorted(variables: &[u32]) -> VariableIndices {
    let mut sorted = VariableIndices::from_slice(variables);
    sorted.sort_unstable();
    sorted
}
