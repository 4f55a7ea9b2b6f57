//! Errors of the smoother. A call that fails leaves the smoother unchanged.
use crate::factor_id::FactorId;
use manifactor_graph::{GraphError, Key};

/// Error of a change that the smoother rejects.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChangeError {
    /// Factors and values contradict each other or the smoother. The list has all errors; factors count from
    /// 0 in the list that was pushed.
    #[error("the factors do not fit the smoother:{}", GraphError::list(.0))]
    Graph(Vec<GraphError>),
    /// A new variable whose key already exists.
    #[error("there is a variable `{key}` already; push factors on it without a value, or choose another key")]
    Known {
        /// Its key.
        key: Key,
    },
    /// A key without a variable.
    #[error("there is no variable `{key}`")]
    NoVariable {
        /// The key of the call.
        key: Key,
    },
    /// A marginalized variable. Its factors are part of a linear prior, and no factor can be added to that.
    #[error("`{key}` was marginalized: it cannot get new factors, and its key cannot be used again")]
    Marginalized {
        /// The key of the call.
        key: Key,
    },
    /// A factor whose variables were marginalized.
    #[error("factor {factor} was marginalized with its variables: it is part of a linear prior")]
    MarginalizedFactor {
        /// The id of the call.
        factor: FactorId,
    },
    /// Bounds, which only solvers of whole graphs have.
    #[error("`{key}` has bounds, and the smoother has none: leave them out, or solve the whole graph")]
    Bounded {
        /// The first bounded variable.
        key: Key,
    },
    /// An equality constraint, which only solvers of whole graphs have.
    #[error(
        "factor {factor} is a constraint, and the smoother has none: solve the whole graph, or take a small noise"
    )]
    Constraint {
        /// Its index in the list that was pushed, from 0.
        factor: usize,
    },
    /// A variable that has to keep its linearization point because it is part of a linear prior.
    #[error(
        "`{key}` cannot be held, freed or moved: it is part of a linear prior, and keeps its linearization point"
    )]
    FixedLinearization {
        /// Its key.
        key: Key,
    },
    /// A new estimate of a different type.
    #[error("`{key}` is of type `{expected}`, and the new estimate of type `{found}`")]
    Type {
        /// The variable.
        key: Key,
        /// Its type.
        expected: &'static str,
        /// Type of the estimate.
        found: &'static str,
    },
    /// A factor that never existed here or was removed.
    #[error("there is no factor {factor}: it was removed, or belongs to another smoother")]
    NoFactor {
        /// The id of the call.
        factor: FactorId,
    },
    /// A replacement that connects different variables than the factor it replaces.
    #[error("factor {factor} is between {}; remove it, and push the new one", names(.expected))]
    Keys {
        /// The factor.
        factor: FactorId,
        /// Its variables.
        expected: Vec<Key>,
    },
    /// A time that is not finite or lies before the last one.
    #[error("time {time} s: expected a finite number{}", not_before(.last))]
    Time {
        /// The time of the call. Unit: seconds.
        time: f64,
        /// The time of the last successful call. Unit: seconds.
        last: Option<f64>,
    },
    /// A window in seconds although no time was ever set.
    #[error(
        "the window is by seconds, and the smoother does not know the time; call `set_time` before the first `push`, or use \
         `window.poses`"
    )]
    NoTime,
    /// A weight that is negative or not finite.
    #[error("factor {factor}: expected a finite weight, 0 or more, got {weight}")]
    Weight {
        /// The factor.
        factor: FactorId,
        /// The weight of the call.
        weight: f64,
    },
}

/// Error of an update. All changes since the last successful update are undone.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UpdateError {
    /// A residual or a derivative is not finite.
    #[error("not finite: the residual of factor {factor} ({}), or its derivative; the changes are taken back", names(.keys))]
    NonFinite {
        /// One of the factors that were pushed or changed.
        factor: FactorId,
        /// Its variables.
        keys: Vec<Key>,
    },
    /// The terms of a sum are finite, but the sum is not.
    #[error(
        "the linear system overflows at `{key}`; scale the noise of its factors; the changes are taken back"
    )]
    Overflow {
        /// A variable in the sum that overflows.
        key: Key,
    },
}

fn not_before(last: &Option<f64>) -> String {
    last.map_or_else(String::new, |last| format!(", {last} s or later: the time that was set before"))
}

fn names(keys: &[Key]) -> String {
    keys.iter().map(Key::as_str).collect::<Vec<_>>().join(", ")
}
