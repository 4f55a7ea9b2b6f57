//! Factors and variables that a solve excludes: undefined factors, and variables without an active factor.
use manifactor_graph::Key;
use serde::Serialize;
use std::borrow::Cow;
use std::fmt;

/// A factor that is undefined at the final values.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct InactiveFactor {
    /// Index in the graph, from 0.
    pub factor: usize,
    /// Its name, or else the name of its type.
    pub name: Cow<'static, str>,
    /// Its variables.
    pub keys: Vec<Key>,
}

/// Variables without an active factor, and so without information.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct UnconstrainedVariables {
    /// Their keys, in the order of the values, without fixed variables.
    pub keys: Vec<Key>,
    /// Number of active factors: they are defined, and have nonzero weight.
    pub active: usize,
    /// Number of factors in the problem.
    pub factors: usize,
}

impl fmt::Display for UnconstrainedVariables {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const MAX_LISTED: usize = 3;
        let keys: Vec<_> = self.keys.iter().take(MAX_LISTED).map(ToString::to_string).collect();
        write!(f, "no factor that takes part touches {}", keys.join(", "))?;
        match self.keys.len().saturating_sub(MAX_LISTED) {
            0 => {}
            1 => f.write_str(" and 1 more variable")?,
            more => write!(f, " and {more} more variables")?,
        }
        let advice = match (self.factors, self.factors - self.active) {
            (0, _) => " (the graph has no factors); add factors",
            (_, 0) => "; add factors",
            (factors, idle) => {
                write!(f, " ({idle} of {factors} take no part at these values)")?;
                "; begin where their factors are defined, add others"
            }
        };
        write!(f, "{advice}, or fix or remove what nothing touches")
    }
}
