//! Which factors may be outliers.
use crate::problem::{FactorPlace, Problem};
use manifactor_graph::catalogue;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The factors that may be outliers. All others are trusted, and keep their full weight.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Candidates {
    /// Factors that couple variables, but for odometry: between variables of one type that follow one another in
    /// the order of the values. Priors and other factors of a single variable are trusted too.
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

/// A name that no factor has.
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
    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Candidates {
    /// By factor: whether it is a candidate.
    pub(crate) fn of(self, problem: &Problem) -> Vec<bool> {
        let follows = |pair: &[u32]| {
            let (a, b) =
                (&problem.model.variables[pair[0] as usize], &problem.model.variables[pair[1] as usize]);
            a.column == b.column && a.index.abs_diff(b.index) == 1
        };
        let may = |factor: &FactorPlace| match self {
            Self::All => true,
            Self::LoopClosures => factor.variables.len() > 1 && !factor.variables.windows(2).all(follows),
        };
        problem.model.factors.iter().map(may).collect()
    }
}
