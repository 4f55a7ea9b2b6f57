//! Terminations of a solve, and their reasons.
use crate::outcome::UnconstrainedVariables;
use manifactor_graph::Key;
use serde::Serialize;
use std::fmt;

/// Termination of a solve. The values are the best found, for every termination.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "status", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Termination {
    /// A minimum, to the given tolerance.
    Converged {
        /// The tolerance that was met.
        reason: Tolerance,
    },
    /// The maximum number of iterations was reached.
    MaxIterations,
    /// No step lowers the cost, and no tolerance is met.
    Stalled {
        /// The reason for the missing step.
        reason: Stall,
    },
    /// Some variables have no active factor; the remaining ones are at a minimum.
    Indeterminate(UnconstrainedVariables),
    /// A residual, a derivative or a step is not finite, at the current values or after every step.
    NonFinite {
        /// Index of the factor in the graph, from 0.
        factor: usize,
        /// Its variables.
        keys: Vec<Key>,
    },
    /// An observer requested the end.
    Interrupted,
}

/// Tolerances that end a solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Tolerance {
    /// The relative change of the cost is below its tolerance.
    RelativeCost,
    /// The cost is below its tolerance.
    AbsoluteCost,
    /// The gradient is below its tolerance.
    Gradient,
    /// The step is below its tolerance.
    Step,
}

/// Reasons for a missing step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stall {
    /// Damping is at its maximum, and still no step lowers the cost.
    Damping,
    /// The cost rises by more than rounding for arbitrarily short steps. It has a jump or a kink here, with
    /// its minimum next to it.
    Jump,
    /// The radius of the trust region has become zero.
    TrustRegion,
    /// Every step leaves the domain of a factor, even very short ones.
    Domain,
    /// Several Gauss-Newton steps in a row raised the cost.
    Diverging,
    /// The steps have led to where the cost does not depend on a variable, although it did at the initial
    /// values. Its factors still have a cost.
    RunOff,
    /// The cost is at a minimum, but constraints are violated.
    Violation,
}

/// A direction along which the cost is constant.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Undetermined {
    /// Motions of the whole along which the cost is constant, such as `position`, `orientation about z` and `scale`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub free: Vec<String>,
    /// The variables that move most, in descending order of motion. None if only the whole moves.
    pub keys: Vec<Key>,
    /// Motion of each of these variables: name of the tangent direction, and its share.
    pub direction: Vec<(Key, &'static str, f64)>,
    /// Total number of moving variables.
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
        let parts = parts.join(", ");
        match (&self.free[..], self.keys.is_empty()) {
            ([], _) => {
                write!(
                    f,
                    "nothing constrains {parts}{more}; add a prior or another measurement, or fix one of them"
                )
            }
            (free, true) => {
                write!(f, "nothing constrains the {} of the whole; ", and(free))?;
                f.write_str(if free.iter().any(|what| what == "scale") {
                    "fix one pose, and for the scale the distance of another, or add measurements in the frame of the map"
                } else {
                    "fix one pose, or add measurements in the frame of the map"
                })
            }
            (free, false) => write!(
                f,
                "nothing constrains the {} of the whole, and {parts}{more}; add priors or other measurements, or fix one of \
                 the variables",
                and(free)
            ),
        }
    }
}

/// Returns `a`, `a and b`, `a, b and c`.
fn and(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [only] => only.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
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
                Stall::RunOff => {
                    "stalled: the steps ran off to where the cost does not depend on a variable; use different initial values, or add a prior"
                }
                Stall::Violation => {
                    "stalled: constraints are not satisfied; they contradict each other, or the initial values are too far away"
                }
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
