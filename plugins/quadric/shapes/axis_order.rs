//! How the semi-axes of two objects are compared.
use crate::shapes::SemiAxes;
use manifactor_graph::prelude::*;

/// Whether semi-axes are compared in the order that they have in the object.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AxisOrder {
    /// The longest with the longest, and so on: which axis is which does not matter.
    #[default]
    Sorted,
    /// The object's x with the first, its y with the second, its z with the third.
    AsGiven,
}

impl AxisOrder {
    /// log(s/s₀), both in this order, the shortest first if sorted.
    pub(crate) fn log_ratio<T: Scalar>(self, s: &Vector3<T>, s0: &SemiAxes) -> Vector3<T> {
        let (mut s, mut s0) = (*s, s0.vector());
        if self == Self::Sorted {
            sort(&mut s);
            sort(&mut s0);
        }
        s.zip_map(&s0, |s, s0| (s / s0).ln())
    }
}

/// Three numbers by size; written out, as sorting a slice of jets wants a total order of them.
fn sort<T: Scalar>(s: &mut Vector3<T>) {
    for (a, b) in [(0, 1), (1, 2), (0, 1)] {
        if s[a] > s[b] {
            s.swap_rows(a, b);
        }
    }
}
