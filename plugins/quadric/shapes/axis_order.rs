//! Matching of the semi-axes of two objects.
use crate::shapes::SemiAxes;
use manifactor_graph::prelude::*;

/// Order of an object's semi-axes in a comparison.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AxisOrder {
    /// By length: the longest with the longest, and so on. The numbering of the axes does not matter.
    #[default]
    Sorted,
    /// The object's x with the first, its y with the second, its z with the third.
    AsGiven,
}

impl AxisOrder {
    /// Returns log(s/s₀) with both in this order; if sorted, the shortest first.
    pub(crate) fn log_ratio<T: Scalar>(self, s: &Vector3<T>, s0: &SemiAxes) -> Vector3<T> {
        let (mut s, mut s0) = (*s, s0.vector());
        if self == Self::Sorted {
            sort(&mut s);
            sort(&mut s0);
        }
        s.zip_map(&s0, |s, s0| (s / s0).ln())
    }
}

/// Sorts three numbers. Written out, as sorting a slice of jets requires a total order.
fn sort<T: Scalar>(s: &mut Vector3<T>) {
    for (a, b) in [(0, 1), (1, 2), (0, 1)] {
        if s[a] > s[b] {
            s.swap_rows(a, b);
        }
    }
}
