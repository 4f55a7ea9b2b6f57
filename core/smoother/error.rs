//! Why a session refuses something. It is then as it was.
use crate::factor_id::FactorId;
use manifactor_graph::{GraphError, Key};

/// Why a change is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChangeError {
    /// Factors and values do not fit each other or the session: everything that is wrong. Factors count from 0 in the list
    /// that was given.
    #[error("the factors do not fit the session:{}", GraphError::list(.0))]
    Graph(Vec<GraphError>),
    /// A variable that is there already.
    #[error("there is a variable `{key}` already; push factors on it without a value, or choose another key")]
    Known {
        /// Its key.
        key: Key,
    },
    /// A variable that is not there.
    #[error("there is no variable `{key}`")]
    NoVariable {
        /// What was asked for.
        key: Key,
    },
    /// A variable that has left the session: its factors are part of a linear prior, which nothing can be added to.
    #[error(
        "`{key}` has left the session; a factor to it, or another variable of that name, is not possible any more"
    )]
    Gone {
        /// What was asked for.
        key: Key,
    },
    /// A factor of variables that have left the session.
    #[error("factor {factor} has left the session with its variables: it is part of a linear prior")]
    GoneFactor {
        /// What was asked for.
        factor: FactorId,
    },
    /// A variable that has to keep its linearization point, as a neighbour of variables that have left.
    #[error(
        "`{key}` cannot be held or freed: it is tied to variables that have left, and keeps its linearization point"
    )]
    Sealed {
        /// Its key.
        key: Key,
    },
    /// A factor that is not there, or not any more.
    #[error("there is no factor {factor}: it was removed, or is of another session")]
    NoFactor {
        /// What was asked for.
        factor: FactorId,
    },
    /// A factor that is to be replaced by one between other variables.
    #[error("factor {factor} is between {}; remove it, and push the new one", names(.expected))]
    Keys {
        /// The factor.
        factor: FactorId,
        /// Its variables.
        expected: Vec<Key>,
    },
    /// A time that cannot come after the one before.
    #[error("time {time} s: expected a finite number{}", not_before(.last))]
    Time {
        /// What was given.
        time: f64,
        /// The one that was set before.
        last: Option<f64>,
    },
    /// A window by seconds without a clock.
    #[error(
        "the window is by seconds, and the session does not know the time; call `set_time` before the first `push`, or use \
         `window.poses`"
    )]
    NoTime,
    /// A weight that no factor can have.
    #[error("factor {factor}: expected a finite weight, 0 or more, got {weight}")]
    Weight {
        /// The factor.
        factor: FactorId,
        /// What was given.
        weight: f64,
    },
}

/// Why an update failed. All changes since the last update are taken back: the session is as that left it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UpdateError {
    /// A residual or a derivative that is not finite.
    #[error("not finite: the residual of factor {factor} ({}), or its derivative; the changes are taken back", names(.keys))]
    NonFinite {
        /// The factor: one of those that were pushed or changed.
        factor: FactorId,
        /// Its variables.
        keys: Vec<Key>,
    },
    /// Numbers that are finite, but too large for their sums.
    #[error(
        "the linear system overflows at `{key}`; scale the noise of its factors; the changes are taken back"
    )]
    Overflow {
        /// A variable that is part of it.
        key: Key,
    },
}

fn not_before(last: &Option<f64>) -> String {
    last.map_or_else(String::new, |last| format!(", {last} s or later: the time that was set before"))
}

fn names(keys: &[Key]) -> String {
    keys.iter().map(Key::as_str).collect::<Vec<_>>().join(", ")
}
