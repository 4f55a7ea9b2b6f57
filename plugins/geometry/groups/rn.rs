//! Points: Rⁿ, with x ⊞ δ = x + δ.
use crate::groups::Coordinates;
use crate::groups::lie_group::additive_group;
use manifactor_graph::{Dimension, JetOf, Lift, Manifold, Motion, Scalar, register_manifold};
use nalgebra::{Const, SVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::Deref;

/// A point in n dimensions. Residual functions get it as a plain vector.
///
/// In documents, for n = 3:
/// ```toml
/// l0 = { type = "point3", position = [1.0, 0.0, 0.5] }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "Document<N>", into = "Document<N>")]
#[schemars(with = "Document<N>", description = description(N))]
pub struct Rn<const N: usize>(pub SVector<f64, N>);

/// A number.
pub type Point1 = Rn<1>;
/// A point in the plane.
pub type Point2 = Rn<2>;
/// A point in space.
pub type Point3 = Rn<3>;

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Document<const N: usize> {
    /// Its coordinates.
    position: Coordinates<N>,
}

fn description(n: usize) -> String {
    let position = ["1.0", "0.0", "0.5", "0.0"].get(..n).unwrap_or_default().join(", ");
    let axes = tangent(n).join(", ");
    format!(
        "A point in {n} dimension{}.\n\nTangent ({axes}); x ⊞ δ = x + δ.\n\n```toml\n[values]\n\
         l0 = {{ type = \"point{n}\", position = [{position}] }}\n```",
        if n == 1 { "" } else { "s" }
    )
}

/// Names of the n tangent directions.
const fn tangent(n: usize) -> &'static [&'static str] {
    if n <= AXES.len() { AXES.split_at(n).0 } else { NUMBERED.split_at(n).0 }
}

const AXES: [&str; 3] = ["x", "y", "z"];
const NUMBERED: [&str; 32] = [
    "x0", "x1", "x2", "x3", "x4", "x5", "x6", "x7", "x8", "x9", "x10", "x11", "x12", "x13", "x14", "x15",
    "x16", "x17", "x18", "x19", "x20", "x21", "x22", "x23", "x24", "x25", "x26", "x27", "x28", "x29", "x30",
    "x31",
];

impl<const N: usize> Rn<N> {
    /// Creates the point with these coordinates.
    pub fn new(position: impl Into<SVector<f64, N>>) -> Self {
        Self(position.into())
    }
}

impl<const N: usize> Deref for Rn<N> {
    type Target = SVector<f64, N>;
    fn deref(&self) -> &SVector<f64, N> {
        &self.0
    }
}

impl<const N: usize> From<Document<N>> for Rn<N> {
    fn from(document: Document<N>) -> Self {
        Self(document.position.vector())
    }
}

impl<const N: usize> From<Rn<N>> for Document<N> {
    fn from(x: Rn<N>) -> Self {
        Self { position: Coordinates::unchecked(x.0) }
    }
}

impl<const N: usize> Manifold for Rn<N> {
    type Dim = Const<N>;
    type Of<T: Scalar> = SVector<T, N>;
    const TANGENT: &'static [&'static str] = tangent(N);

    fn lift<T: Scalar>(&self) -> SVector<T, N> {
        self.0.lift()
    }
    fn seed(&self) -> SVector<JetOf<Const<N>>, N> {
        let jet = |i: usize| {
            let unit = SVector::<f64, N>::from_fn(|k, _| if k == i { 1.0 } else { 0.0 });
            manifactor_graph::Jet::with_gradient(self.0[i], unit.as_slice())
        };
        Const::<N>::vector(jet)
    }
    fn retract(&self, delta: &SVector<f64, N>) -> Self {
        Self(self.0 + delta)
    }
    fn local(&self, other: &Self) -> SVector<f64, N> {
        other.0 - self.0
    }
    fn coordinate(&self, direction: usize) -> Option<f64> {
        self.0.get(direction).copied()
    }
    fn position(&self) -> Option<[f64; 3]> {
        match *self.0.as_slice() {
            [x, y] => Some([x, y, 0.0]),
            [x, y, z] => Some([x, y, z]),
            _ => None,
        }
    }
    fn moved(&self, motion: Motion) -> Option<SVector<f64, N>> {
        let velocity = motion.velocity(self.position()?);
        Some(SVector::from_fn(|i, _| velocity[i]))
    }
    fn is_finite(&self) -> bool {
        self.0.iter().all(|x| x.is_finite())
    }
}

macro_rules! point {
    ($n:literal, $name:literal, $example:literal) => {
        additive_group!(Rn<$n>, $n, $name, $example);
        register_manifold!($name, Rn<$n>);
    };
}
point!(1, "point1", "{ position = [1.0] }");
point!(2, "point2", "{ position = [1.0, 0.5] }");
point!(3, "point3", "{ position = [1.0, 0.5, 0.0] }");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::any_point;
    use manifactor_testing::manifold_laws;
    use manifactor_testing::strategies::vector;

    manifold_laws! {
        numbers_are_a_manifold: (any_point::<1>(), any_point::<1>(), vector::<1>(10.0));
        the_plane_is_a_manifold: (any_point::<2>(), any_point::<2>(), vector::<2>(10.0));
        space_is_a_manifold: (any_point::<3>(), any_point::<3>(), vector::<3>(10.0));
    }

    #[test]
    fn more_than_three_directions_are_numbered() {
        assert_eq!(Rn::<2>::TANGENT, ["x", "y"]);
        assert_eq!(Rn::<4>::TANGENT, ["x0", "x1", "x2", "x3"]);
    }

    #[test]
    fn the_number_of_coordinates_is_checked() {
        let error = serde_json::from_str::<Point3>(r#"{ "position": [1, 2] }"#).unwrap_err();
        assert!(error.to_string().contains("expected 3 numbers, got 2"), "{error}");
    }
}
