//! Velocities of a rigid body: R⁶, with x ⊞ δ = x + δ.
use crate::groups::{Coordinates, LieGroup};
use manifactor_graph::{Dimension, JetOf, Lift, Manifold, Scalar, register_manifold};
use nalgebra::{Matrix6, SVector, U6, Vector3, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::Deref;

/// The velocity of a rigid body in the body frame: angular in rad/s, then linear in m/s.
///
/// Tangent (wx, wy, wz, vx, vy, vz); x ⊞ δ = x + δ.
///
/// ```toml
/// [values]
/// v0 = { type = "twist", angular = [0.0, 0.1, 0.0], linear = [0.0, 0.0, 0.5] }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "Document", into = "Document")]
#[schemars(with = "Document")]
pub struct Twist(pub Vector6<f64>);

/// The velocity of a rigid body in the body frame: angular in rad/s, then linear in m/s.
///
/// Tangent (wx, wy, wz, vx, vy, vz); x ⊞ δ = x + δ.
///
/// ```toml
/// [values]
/// v0 = { type = "twist", angular = [0.0, 0.1, 0.0], linear = [0.0, 0.0, 0.5] }
/// ```
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Twist")]
struct Document {
    /// Angular velocity about x, y and z, in rad/s.
    angular: Coordinates<3>,
    /// Linear velocity along x, y and z, in m/s.
    linear: Coordinates<3>,
}

impl Twist {
    /// Returns the twist of a body at rest.
    pub fn zero() -> Self {
        Self(Vector6::zeros())
    }
}

impl Deref for Twist {
    type Target = Vector6<f64>;
    fn deref(&self) -> &Vector6<f64> {
        &self.0
    }
}

impl From<Document> for Twist {
    fn from(Document { angular, linear }: Document) -> Self {
        let mut twist = Self::zero();
        twist.0.fixed_rows_mut::<3>(0).copy_from(&angular.vector());
        twist.0.fixed_rows_mut::<3>(3).copy_from(&linear.vector());
        twist
    }
}

impl From<Twist> for Document {
    fn from(Twist(x): Twist) -> Self {
        let part = |first: usize| Coordinates::unchecked(Vector3::from(x.fixed_rows::<3>(first)));
        Self { angular: part(0), linear: part(3) }
    }
}

impl Manifold for Twist {
    type Dim = U6;
    type Of<T: Scalar> = SVector<T, 6>;
    const TANGENT: &'static [&'static str] = &["wx", "wy", "wz", "vx", "vy", "vz"];

    fn lift<T: Scalar>(&self) -> SVector<T, 6> {
        self.0.lift()
    }
    fn seed(&self) -> SVector<JetOf<U6>, 6> {
        let jet = |i: usize| {
            let unit = Vector6::from_fn(|k, _| if k == i { 1.0 } else { 0.0 });
            manifactor_graph::Jet::with_gradient(self.0[i], unit.as_slice())
        };
        U6::vector(jet)
    }
    fn retract(&self, delta: &Vector6<f64>) -> Self {
        Self(self.0 + delta)
    }
    fn local(&self, other: &Self) -> Vector6<f64> {
        other.0 - self.0
    }
    fn is_finite(&self) -> bool {
        self.0.iter().all(|x| x.is_finite())
    }
}

impl LieGroup for Twist {
    const NAME: &'static str = "twist";
    const EXAMPLE: &'static str = "{ angular = [0.0, 0.1, 0.0], linear = [0.0, 0.0, 0.5] }";

    fn identity() -> Self {
        Self::zero()
    }
    fn compose(x: &Self, y: &Self) -> Self {
        Self(x.0 + y.0)
    }
    fn inverse(x: &Self) -> Self {
        Self(-x.0)
    }
    fn between<T: Scalar>(x: &SVector<T, 6>, y: &SVector<T, 6>) -> SVector<T, 6> {
        y - x
    }
    fn log<T: Scalar>(x: &SVector<T, 6>) -> SVector<T, 6> {
        *x
    }
    fn inverse_right_jacobian(_: &Vector6<f64>) -> Matrix6<f64> {
        Matrix6::identity()
    }
    fn adjoint_of_inverse(_: &Vector6<f64>) -> Matrix6<f64> {
        Matrix6::identity()
    }
}

register_manifold!("twist", Twist);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::any_twist;
    use manifactor_testing::manifold_laws;
    use manifactor_testing::strategies::vector;

    manifold_laws! {
        velocities_are_a_manifold: (any_twist(), any_twist(), vector::<6>(10.0));
    }

    #[test]
    fn a_document_reads_back() {
        let twist = Twist(Vector6::new(0.0, 0.1, 0.2, 0.3, 0.4, 0.5));
        let text = serde_json::to_string(&twist).unwrap();
        assert_eq!(text, r#"{"angular":[0.0,0.1,0.2],"linear":[0.3,0.4,0.5]}"#);
        assert_eq!(serde_json::from_str::<Twist>(&text).unwrap(), twist);
    }
}
