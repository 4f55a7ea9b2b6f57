//! Bounds that hold an estimate.
use manifactor_graph::Key;
use serde::Serialize;
use std::fmt;

/// A bound at which the estimate is, and without which the cost would be lower.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ActiveBound {
    /// The variable.
    pub key: Key,
    /// Name of its direction.
    pub direction: &'static str,
    /// The side of the interval.
    pub side: Side,
    /// The bound.
    pub value: f64,
    /// The Lagrange multiplier, zero or more: decrease of the cost per unit by which the bound is relaxed, to first
    /// order.
    pub multiplier: f64,
}

/// A side of an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// The lower limit.
    Min,
    /// The upper limit.
    Max,
}

impl fmt::Display for ActiveBound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { key, direction, side, value, multiplier } = self;
        let side = match side {
            Side::Min => "minimum",
            Side::Max => "maximum",
        };
        write!(f, "{key}.{direction} is at its {side}, {value} (multiplier {multiplier:.3e})")
    }
}
