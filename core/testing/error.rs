//! What a broken law says: the worst entry, and the point to reproduce it.
use manifactor_graph::{Factor, Variable};

/// A law that does not hold. Points and factors are JSON, as documents write them.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LawError {
    /// Variables that the factor does not take; nothing was checked.
    #[error("the factor {factor} does not take these variables: {point}")]
    WrongVariables {
        /// The factor.
        factor: Box<str>,
        /// The variables.
        point: Box<str>,
    },
    /// A point where the factor says it is not defined; nothing was checked.
    #[error("the factor {factor} is not defined at {point}")]
    NotDefined {
        /// The factor.
        factor: Box<str>,
        /// The variables.
        point: Box<str>,
    },
    /// Two residuals that should be equal.
    #[error("{law}: row {row} is {found} and should be {expected}\n  factor {factor}\n  at {point}")]
    Residual {
        /// Which two.
        law: &'static str,
        /// The row that differs most, from 0.
        row: usize,
        /// What it is.
        found: f64,
        /// What it should be.
        expected: f64,
        /// The factor.
        factor: Box<str>,
        /// The variables.
        point: Box<str>,
    },
    /// Two Jacobians that should be equal.
    #[error(
        "{law}: row {row} by `{of}.{direction}`, variable {variable}, is {found} and should be {expected}\n  \
         factor {factor}\n  at {point}"
    )]
    Jacobian {
        /// Which two.
        law: &'static str,
        /// The row of the entry that differs most, from 0.
        row: usize,
        /// The variable's position, from 0.
        variable: usize,
        /// The name of its type.
        of: &'static str,
        /// The tangent direction's name.
        direction: &'static str,
        /// What the entry is.
        found: f64,
        /// What it should be.
        expected: f64,
        /// The factor.
        factor: Box<str>,
        /// The variables.
        point: Box<str>,
    },
    /// A residual that is not a number, or infinite, where the factor says that it is defined.
    #[error(
        "row {row} of the residual is {found}: keep such points out with `is_defined`, or write it so that it is \
         finite\n  factor {factor}\n  at {point}"
    )]
    NotFinite {
        /// The row, from 0.
        row: usize,
        /// What it is.
        found: f64,
        /// The factor.
        factor: Box<str>,
        /// The variables.
        point: Box<str>,
    },
    /// A manifold's law.
    #[error("{law}: off by {error:e}\n  x = {x}\n  y = {y}\n  delta = {delta:?}")]
    Manifold {
        /// Which law.
        law: &'static str,
        /// By how much.
        error: f64,
        /// A point.
        x: String,
        /// Another point.
        y: String,
        /// A tangent vector at `x`.
        delta: Vec<f64>,
    },
    /// A registered type whose catalogue entry lacks something.
    #[error("{kind} `{name}`: {problem}")]
    Entry {
        /// Factor, variable, loss, …
        kind: &'static str,
        /// Its name.
        name: &'static str,
        /// What is wrong with it.
        problem: String,
    },
}

/// A variable, as a document writes it.
pub(crate) fn json_of(variable: &dyn Variable) -> String {
    serde_json::to_string(variable).unwrap_or_else(|error| format!("{variable:?} ({error})"))
}

/// Variables, as a document writes them.
pub(crate) fn json_of_all(variables: &[&dyn Variable]) -> Box<str> {
    let all: Vec<String> = variables.iter().map(|v| json_of(*v)).collect();
    format!("[{}]", all.join(", ")).into()
}

/// A factor, as a document writes it.
pub(crate) fn json_of_factor(factor: &dyn Factor) -> Box<str> {
    serde_json::to_string(factor).unwrap_or_else(|error| format!("{factor:?} ({error})")).into()
}
