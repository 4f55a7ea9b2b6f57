//! How a solve ended, and why.
use crate::outcome::Untouched;
use manifactor_graph::Key;
use serde::Serialize;
use std::fmt;

/// How a solve ended. The values are the best found, whatever the ending.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "status", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Termination {
    /// A minimum, to the tolerance named.
    Converged {
        /// Which tolerance was met.
        reason: Tolerance,
    },
    /// As many iterations as were allowed.
    MaxIterations,
    /// No step lowers the cost, and no tolerance is met.
    Stalled {
        /// Why there is no step.
        reason: Stall,
    },
    /// Some variables are touched by no factor that takes part; the others are at a minimum.
    Indeterminate(Untouched),
    /// A residual, a derivative or a step that is not finite: at the values, or wherever a step leads.
    NonFinite {
        /// The factor's place in the graph, from 0.
        factor: usize,
        /// Its variables.
        keys: Vec<Key>,
    },
    /// An observer asked to stop.
    Interrupted,
}

/// Tolerances that end a solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Tolerance {
    /// The cost changed by less than a share of itself.
    RelativeCost,
    /// The cost is as good as zero.
    AbsoluteCost,
    /// The gradient is as good as zero.
    Gradient,
    /// The step is as good as zero.
    Step,
}

/// Reasons not to find a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stall {
    /// Damping has reached its bound, and still no step lowers the cost.
    Damping,
    /// The cost rises by more than rounding however short the step is: it has a jump or a kink there, and
    /// is least beside it.
    Jump,
    /// The trust region has shrunk to nothing.
    TrustRegion,
    /// Each step leaves the domain of a factor, however short.
    Domain,
    /// Gauss-Newton's steps have been raising the cost.
    Diverging,
}

/// A direction in which the cost does not change.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Undetermined {
    /// The variables that move the most, the first the most.
    pub keys: Vec<Key>,
    /// How each of them moves: name of the tangent direction, and its share.
    pub direction: Vec<(Key, &'static str, f64)>,
    /// How many variables move at all.
    pub moving: usize,
}

impl Termination {
    /// Returns whether the values are a solution.
    pub fn is_converged(&self) -> bool {
        matches!(self, Self::Converged { .. })
    }
}

impl fmt::Display for Undetermined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts: Vec<_> =
            self.direction.iter().map(|(k, name, x)| format!("{k}.{name} by {x:.2}")).collect();
        let more = match self.moving.saturating_sub(self.keys.len()) {
            0 => String::new(),
            n => format!(", and {n} more variables with them"),
        };
        write!(
            f,
            "nothing constrains {}{more}; add a prior or another measurement, or fix one of them",
            parts.join(", ")
        )
    }
}

impl fmt::Display for Termination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Converged { reason } => f.write_str(match reason {
                Tolerance::RelativeCost => "converged: the cost has settled",
                Tolerance::AbsoluteCost => "converged: the cost is zero",
                Tolerance::Gradient => "converged: the gradient is zero",
                Tolerance::Step => "converged: the step is zero",
            }),
            Self::MaxIterations => f.write_str("stopped after the allowed number of iterations"),
            Self::Stalled { reason } => f.write_str(match reason {
                Stall::Damping => "stalled: no step lowers the cost, however damped",
                Stall::Jump => "stalled: the cost has a jump or a kink here, and is least beside it",
                Stall::TrustRegion => "stalled: no step lowers the cost, however small the trust region",
                Stall::Domain => "stalled: each step leaves the domain of a factor",
                Stall::Diverging => "stalled: the steps raise the cost; use levenberg_marquardt",
            }),
            Self::Indeterminate(u) => write!(f, "indeterminate: {u}"),
            Self::NonFinite { factor, keys } => {
                let keys: Vec<_> = keys.iter().map(ToString::to_string).collect();
                let keys = keys.join(", ");
                write!(f, "not finite: the residual of factor {factor} ({keys}), or its derivative")
            }
            Self::Interrupted => f.write_str("interrupted"),
        }
    }
}
