//! Directions in space as variables.
use manifactor_graph::prelude::*;
use manifactor_graph::quantity::Shape;
use nalgebra::Matrix3x2;

/// A direction in space, such as gravity: a point on the unit sphere.
///
/// Tangent (a, b): along two axes perpendicular to the direction n, B(n) = [b₁ b₂] of Duff et al., *Building
/// an Orthonormal Basis, Revisited* (2017). n ⊞ δ = cos|δ| n + sin|δ|/|δ| B δ, the great circle from n
/// towards B δ. The opposite of n is half a turn away in every direction; `local` uses the first axis.
///
/// ```toml
/// [values]
/// g0 = { type = "s2", direction = [0.0, 0.0, 1.0] }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct S2 {
    /// Direction vector, of any length but zero.
    pub direction: Direction,
}

impl S2 {
    /// Creates the variable from a direction.
    pub const fn new(direction: Direction) -> Self {
        Self { direction }
    }
    /// Returns two unit vectors perpendicular to this direction and to each other.
    pub fn basis(&self) -> Matrix3x2<f64> {
        let n = *self.direction;
        let sign = 1f64.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Matrix3x2::from_columns(&[
            Vector3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            Vector3::new(b, sign + n.y * n.y * a, -n.y),
        ])
    }
}

impl Manifold for S2 {
    type Dim = U2;
    type Of<T: Scalar> = Vector3<T>;
    const TANGENT: &'static [&'static str] = &["a", "b"];

    fn lift<T: Scalar>(&self) -> Vector3<T> {
        self.direction.map(T::from)
    }
    fn seed(&self) -> Vector3<JetOf<U2>> {
        let basis = self.basis();
        Vector3::from_fn(|i, _| Jet::with_gradient(self.direction[i], &[basis[(i, 0)], basis[(i, 1)]]))
    }
    fn retract(&self, delta: &Vector2<f64>) -> Self {
        let angle = delta.norm();
        if angle == 0.0 {
            return *self;
        }
        let there = *self.direction * angle.cos() + self.basis() * (delta * (angle.sin() / angle));
        // A step that is not finite gives no direction: keep the current one; the residual reports the
        // problem.
        Self { direction: Direction::new(there).unwrap_or(self.direction) }
    }
    fn local(&self, other: &Self) -> Vector2<f64> {
        let across = self.basis().tr_mul(&other.direction);
        let (sin, cos) = (across.norm(), self.direction.dot(&other.direction));
        if sin > 0.0 {
            return across * (sin.atan2(cos) / sin);
        }
        Vector2::new(if cos < 0.0 { std::f64::consts::PI } else { 0.0 }, 0.0)
    }
    fn is_finite(&self) -> bool {
        self.direction.iter().all(|x| x.is_finite())
    }
}
register_manifold!("s2", S2);

impl Quantity for S2 {
    const SHAPE: Shape = <Vector3<f64> as Quantity>::SHAPE;
    type Of<T: Scalar> = Vector3<T>;
    fn read<T: Scalar>(from: &[T]) -> Vector3<T> {
        Vector3::<f64>::read(from)
    }
    fn write<T: Scalar>(x: &Vector3<T>, to: &mut [T]) {
        Vector3::<f64>::write(x, to);
    }
}
register_quantity!(S2 as Vector3<f64>);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::any_s2;
    use manifactor_testing::manifold_laws;
    use manifactor_testing::strategies::{signed_angle, vector};
    use proptest::prelude::*;

    /// Tangent vectors inside the chart: shorter than π.
    fn tangent() -> impl Strategy<Value = Vector2<f64>> {
        (signed_angle(), vector::<2>(1.0))
            .prop_map(|(angle, v)| v.try_normalize(0.0).unwrap_or(Vector2::x()) * angle)
    }
    manifold_laws! { retract_and_local_are_inverse: (any_s2(), any_s2(), tangent()) }

    #[test]
    fn the_opposite_is_half_a_turn_away() {
        let (up, down) = (S2::new(Direction::Z), S2::new(Direction::new(-Vector3::z()).unwrap()));
        assert_eq!(up.local(&down).norm(), std::f64::consts::PI);
        assert!((*up.retract(&up.local(&down)).direction + Vector3::z()).norm() < 1e-12);
    }

    #[test]
    fn a_step_that_is_not_finite_stays() {
        let up = S2::new(Direction::Z);
        assert_eq!(up.retract(&Vector2::new(f64::NAN, 0.0)), up);
    }
}
