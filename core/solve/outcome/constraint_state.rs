//! Equality constraints at the end of a solve.
use manifactor_graph::Key;
use serde::Serialize;
use std::borrow::Cow;
use std::fmt;

/// An equality constraint at the estimate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConstraintState {
    /// Index of its factor in the graph, from 0.
    pub factor: usize,
    /// Its name, or else the name of its type.
    pub name: Cow<'static, str>,
    /// Its variables.
    pub keys: Vec<Key>,
    /// Its whitened residual, which is zero if the constraint is satisfied.
    pub residual: Vec<f64>,
    /// The Lagrange multipliers, one for each row: decrease of the cost per unit by which the whitened residual is
    /// larger than zero, to first order.
    pub multipliers: Vec<f64>,
}

impl fmt::Display for ConstraintState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let keys: Vec<_> = self.keys.iter().map(ToString::to_string).collect();
        let multipliers: Vec<_> = self.multipliers.iter().map(|x| format!("{x:.3e}")).collect();
        let s = if multipliers.len() == 1 { "" } else { "s" };
        write!(
            f,
            "constraint {} {} ({}): multiplier{s} {}",
            self.factor,
            self.name,
            keys.join(", "),
            multipliers.join(", ")
        )
    }
}
