//! SE(2): poses in the plane.
use crate::groups::Coordinates;
use crate::groups::LieGroup;
use crate::groups::small_angle;
use crate::groups::{Angle, So2};
use manifactor_graph::quantity::{Quantity, Shape};
use manifactor_graph::{Jet, JetOf, Lift, Manifold, Motion, Scalar, register_manifold};
use nalgebra::{Matrix3, U3, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A pose in the plane, X·Exp(v, θ): tangent (x, y, theta), in metres and radians, in the local frame.
///
/// It maps points from the local frame to the outer one: R p + t. The angle is in radians, counter-clockwise.
///
/// ```toml
/// [values]
/// x0 = { type = "se2", translation = [1.0, 0.5], angle = 0.5 }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "Document", into = "Document")]
#[serde(bound(serialize = "Self: Into<Document>", deserialize = "Self: From<Document>"))]
#[schemars(with = "Document", bound = "")]
pub struct Se2<T: Scalar = f64> {
    /// Rotates directions from the local frame to the outer one.
    pub rotation: So2<T>,
    /// Origin of the local frame in the outer one.
    pub translation: Vector2<T>,
}

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Document {
    /// Position, in metres.
    translation: Coordinates<2>,
    /// Angle in radians, counter-clockwise.
    angle: Angle,
}

/// Returns v, rotated by a quarter turn counter-clockwise.
pub(crate) fn quarter_turn<T: Scalar>(v: &Vector2<T>) -> Vector2<T> {
    Vector2::new(-v.y, v.x)
}

impl<T: Scalar> Se2<T> {
    /// Creates the pose with this rotation and this position.
    pub fn new(rotation: So2<T>, translation: Vector2<T>) -> Self {
        Self { rotation, translation }
    }
    /// Returns the identity: the outer frame.
    pub fn identity() -> Self {
        Self::new(So2::identity(), Vector2::zeros())
    }
    /// Returns the pose after moving by v and turning by θ at constant speed in the local frame: ξ = (v, θ).
    pub fn exp(xi: &Vector3<T>) -> Self {
        Self::new(So2::exp(xi.z), Self::exp_translation(xi))
    }
    /// Translation of Exp(v, θ): V v with V = sin θ/θ + (1 - cos θ)/θ · quarter turn.
    fn exp_translation(xi: &Vector3<T>) -> Vector2<T> {
        let (v, theta) = (xi.xy(), xi.z);
        let e = small_angle::exponential(theta * theta);
        v * (e.sin_half * e.cos_half * 2.0) + quarter_turn(&v) * (e.a * theta)
    }
    /// Returns ξ = (v, θ), the inverse of [`Se2::exp`].
    pub fn log(&self) -> Vector3<T> {
        let theta = self.rotation.angle();
        let (half, theta2) = (theta * 0.5, theta * theta);
        let (c, s) = self.rotation.cos_sin();
        // Avoids a zero denominator: sin θ is zero at half a turn, 1 - cos θ at θ = 0.
        let cot = || if c > T::zero() { (c + 1.0) / s } else { s / (T::one() - c) };
        let half_cot = T::one() - theta2 * small_angle::k(theta2, || half * cot());
        let v = self.translation * half_cot - quarter_turn(&self.translation) * half;
        Vector3::new(v.x, v.y, theta)
    }
    /// Returns self · other.
    pub fn compose(&self, other: &Self) -> Self {
        Self::new(self.rotation.compose(&other.rotation), self.act(&other.translation))
    }
    /// Returns self⁻¹.
    pub fn inverse(&self) -> Self {
        let inverse = self.rotation.inverse();
        Self::new(inverse, -inverse.act(&self.translation))
    }
    /// Returns self⁻¹ · other, the pose `other` in the frame of `self`.
    pub fn between(&self, other: &Self) -> Self {
        Self::new(self.rotation.between(&other.rotation), self.inverse_act(&other.translation))
    }
    /// Maps a point from the local frame to the outer one.
    pub fn act(&self, point: &Vector2<T>) -> Vector2<T> {
        self.rotation.act(point) + self.translation
    }
    /// Maps a point from the outer frame to the local one.
    pub fn inverse_act(&self, point: &Vector2<T>) -> Vector2<T> {
        self.rotation.inverse().act(&(point - self.translation))
    }
    /// Returns the homogeneous matrix [R t; 0 1].
    pub fn matrix(&self) -> Matrix3<T> {
        let mut m = Matrix3::identity();
        m.fixed_view_mut::<2, 2>(0, 0).copy_from(&self.rotation.matrix());
        m.fixed_view_mut::<2, 1>(0, 2).copy_from(&self.translation);
        m
    }
}

impl Se2 {
    /// Returns the adjoint Ad(x), with x·Exp(δ)·x⁻¹ = Exp(Ad(x)δ).
    pub fn adjoint(&self) -> Matrix3<f64> {
        let mut m = Matrix3::identity();
        m.fixed_view_mut::<2, 2>(0, 0).copy_from(&self.rotation.matrix());
        m.fixed_view_mut::<2, 1>(0, 2).copy_from(&-quarter_turn(&self.translation));
        m
    }
    /// Returns Jᵣ⁻¹(ξ), with Log(Exp(ξ)·Exp(δ)) ≈ ξ + Jᵣ⁻¹(ξ)δ.
    pub fn inverse_right_jacobian(xi: &Vector3<f64>) -> Matrix3<f64> {
        let (theta, half) = (xi.z, 0.5 * xi.z);
        let (k, slope) = small_angle::k_and_slope(theta * theta);
        let half_cot = 1.0 - theta * theta * k;
        let half_cot_slope = -2.0 * theta * k - theta.powi(3) * slope;
        // Derivative of v = V⁻¹t with respect to θ: (V⁻¹)' t, with t = Vv.
        let t = Se2::exp_translation(xi);
        let d = t * half_cot_slope - quarter_turn(&t) * 0.5;
        Matrix3::new(half_cot, -half, d.x, half, half_cot, d.y, 0.0, 0.0, 1.0)
    }
}

/// Storage order: the rotation, then the translation.
impl Quantity for Se2 {
    const SHAPE: Shape = Shape { name: "se2", size: 5 };
    type Of<T: Scalar> = Se2<T>;
    #[inline]
    fn read<T: Scalar>(from: &[T]) -> Se2<T> {
        Se2::new(So2::read(from), Vector2::<f64>::read(&from[3..]))
    }
    #[inline]
    fn write<T: Scalar>(x: &Se2<T>, to: &mut [T]) {
        So2::write(&x.rotation, &mut to[..3]);
        Vector2::<f64>::write(&x.translation, &mut to[3..]);
    }
}

impl Manifold for Se2 {
    type Dim = U3;
    type Of<T: Scalar> = Se2<T>;
    const TANGENT: &'static [&'static str] = &["x", "y", "theta"];

    fn lift<T: Scalar>(&self) -> Se2<T> {
        Se2::new(self.rotation.lift(), self.translation.lift())
    }
    fn seed(&self) -> Se2<JetOf<U3>> {
        let r = self.rotation.matrix();
        let translation =
            Vector2::from_fn(|i, _| Jet::with_gradient(self.translation[i], &[r[(i, 0)], r[(i, 1)], 0.0]));
        let angle = JetOf::<U3>::with_gradient(self.rotation.angle(), &[0.0, 0.0, 1.0]);
        Se2::new(So2::exp(angle), translation)
    }
    fn retract(&self, delta: &Vector3<f64>) -> Self {
        // The cosine is recomputed from the summed angle, so rounding does not accumulate.
        Se2::new(So2::exp(self.rotation.angle() + delta.z), self.act(&Se2::exp_translation(delta)))
    }
    fn local(&self, other: &Self) -> Vector3<f64> {
        self.between(other).log()
    }
    fn position(&self) -> Option<[f64; 3]> {
        Some([self.translation.x, self.translation.y, 0.0])
    }
    fn moved(&self, motion: Motion) -> Option<Vector3<f64>> {
        let ([.., turn], [x, y, _]) = (motion.rotation(), motion.velocity(self.position()?));
        Some(self.rotation.inverse().act(&Vector2::new(x, y)).push(turn))
    }
    fn is_finite(&self) -> bool {
        self.rotation.is_finite() && self.translation.iter().all(|x| x.is_finite())
    }
}
register_manifold!("se2", Se2);

impl LieGroup for Se2 {
    const NAME: &'static str = "se2";
    const EXAMPLE: &'static str = "{ translation = [1.0, 0.5], angle = 0.5 }";
    fn identity() -> Se2 {
        Se2::identity()
    }
    fn compose(x: &Se2, y: &Se2) -> Se2 {
        x.compose(y)
    }
    fn inverse(x: &Se2) -> Se2 {
        x.inverse()
    }
    fn between<T: Scalar>(x: &Se2<T>, y: &Se2<T>) -> Se2<T> {
        x.between(y)
    }
    fn log<T: Scalar>(x: &Se2<T>) -> Vector3<T> {
        x.log()
    }
    fn inverse_right_jacobian(xi: &Vector3<f64>) -> Matrix3<f64> {
        Se2::inverse_right_jacobian(xi)
    }
    fn adjoint_of_inverse(x: &Se2) -> Matrix3<f64> {
        x.inverse().adjoint()
    }
}

impl From<Document> for Se2 {
    fn from(document: Document) -> Self {
        Self::new(document.angle.0, document.translation.vector())
    }
}
impl From<Se2> for Document {
    fn from(x: Se2) -> Self {
        Self { translation: Coordinates::unchecked(x.translation), angle: Angle(x.rotation) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_se2, se2_tangent};
    use manifactor_testing::manifold_laws;
    use manifactor_testing::strategies::vector;
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_2_PI, PI};

    manifold_laws! { retract_and_local_are_inverse: (any_se2(), any_se2(), se2_tangent()) }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        #[test]
        fn exp_is_the_matrix_exponential(xi in se2_tangent()) {
            let m = Matrix3::new(0.0, -xi.z, xi.x, xi.z, 0.0, xi.y, 0.0, 0.0, 0.0);
            prop_assert!((Se2::exp(&xi).matrix() - m.exp()).norm() < 1e-11);
        }

        #[test]
        fn log_inverts_exp(xi in se2_tangent()) {
            prop_assert!((Se2::exp(&xi).log() - xi).norm() < 1e-9);
        }

        #[test]
        fn acting_is_multiplying_by_the_matrix(x in any_se2(), p in vector::<2>(10.0)) {
            prop_assert!((x.act(&p).push(1.0) - x.matrix() * p.push(1.0)).norm() < 1e-12);
            prop_assert!((x.inverse_act(&x.act(&p)) - p).norm() < 1e-12);
            prop_assert!((x.inverse().act(&p) - x.inverse_act(&p)).norm() < 1e-12);
        }

        #[test]
        fn the_adjoint_moves_a_step_to_the_other_side(x in any_se2(), delta in se2_tangent()) {
            let (left, right) = (x.adjoint() * delta, x.compose(&Se2::exp(&delta)));
            prop_assert!((Se2::exp(&left).compose(&x).matrix() - right.matrix()).norm() < 1e-9);
        }
    }

    #[test]
    fn a_turning_frame_moves_on_an_arc() {
        // Forward at 1 m/s, a quarter turn to the left in 1 s: radius 2/π.
        let pose = Se2::exp(&Vector3::new(1.0, 0.0, 1.0 / FRAC_2_PI));
        assert!((pose.translation - Vector2::new(FRAC_2_PI, FRAC_2_PI)).norm() < 1e-15);
    }

    #[test]
    fn half_a_turn_has_a_logarithm() {
        let xi = Vector3::new(1.0, 2.0, PI);
        assert!((Se2::exp(&xi).log() - xi).norm() < 1e-12);
        assert!(Se2::inverse_right_jacobian(&xi).iter().all(|x| x.is_finite()));
    }
}
