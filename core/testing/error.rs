//! Errors of broken laws, with the worst entry and the point that reproduces it.
use manifactor_graph::{Factor, Variable};

/// A law that does not hold. Points and factors are JSON, as in documents.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LawError {
    /// Variables that do not fit the factor. Nothing was checked.
    #[error("the factor {factor} does not take these variables: {point}")]
    WrongVariables {
        /// The factor.
        factor: Box<str>,
        /// The variables.
        point: Box<str>,
    },
    /// A point at which the factor is not defined. Nothing was checked.
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
        /// Name of the comparison.
        law: &'static str,
        /// The row with the largest difference, counted from 0.
        row: usize,
        /// Actual value.
        found: f64,
        /// Expected value.
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
        /// Name of the comparison.
        law: &'static str,
        /// The row of the entry with the largest difference, counted from 0.
        row: usize,
        /// Position of the variable, counted from 0.
        variable: usize,
        /// Name of its type.
        of: &'static str,
        /// Name of the tangent direction.
        direction: &'static str,
        /// Actual entry.
        found: f64,
        /// Expected entry.
        expected: f64,
        /// The factor.
        factor: Box<str>,
        /// The variables.
        point: Box<str>,
    },
    /// A residual that is NaN or infinite although the factor is defined at the point.
    #[error(
        "row {row} of the residual is {found}: keep such points out with `is_defined`, or write it so that it is \
         finite\n  factor {factor}\n  at {point}"
    )]
    NotFinite {
        /// The row, counted from 0.
        row: usize,
        /// Actual value.
        found: f64,
        /// The factor.
        factor: Box<str>,
        /// The variables.
        point: Box<str>,
    },
    /// A law of a manifold.
    #[error("{law}: off by {error:e}\n  x = {x}\n  y = {y}\n  delta = {delta:?}")]
    Manifold {
        /// Name of the law.
        law: &'static str,
        /// Size of the violation.
        error: f64,
        /// First point.
        x: String,
        /// Second point.
        y: String,
        /// A tangent vector at `x`.
        delta: Vec<f64>,
    },
    /// A registered type with an incomplete catalogue entry.
    #[error("{kind} `{name}`: {problem}")]
    Entry {
        /// Kind of the type: factor, variable, loss, …
        kind: &'static str,
        /// Name of the type.
        name: &'static str,
        /// The problem.
        problem: String,
    },
}

/// Formats a variable as in a document.
pub(crate) fn json_of(variable: &dyn Variable) -> String {
    serde_json::to_string(variable).unwrap_or_else(|error| format!("{variable:?} ({error})"))
}

/// Formats variables as in a document.
pub(crate) fn json_of_all(variables: &[&dyn Variable]) -> Box<str> {
    let all: Vec<String> = variables.iter().map(|v| json_of(*v)).collect();
    format!("[{}]", all.join(", ")).into()
}

/// Formats a factor as in a document.
pub(crate) fn json_of_factor(factor: &dyn Factor) -> Box<str> {
    serde_json::to_string(factor).unwrap_or_else(|error| format!("{factor:?} ({error})")).into()
}
