//! SO(3): rotations in space, stored as unit quaternions.
use crate::groups::LieGroup;
use crate::groups::small_angle;
use crate::groups::so2::atan2;
use manifactor_graph::quantity::{Quantity, Shape};
use manifactor_graph::{Jet, JetOf, Manifold, Motion, Scalar, register_manifold};
use nalgebra::{Matrix3, Quaternion, Rotation3, U3, UnitQuaternion, Vector3, Vector4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A rotation in space, R·Exp(ω): tangent (rx, ry, rz), in radians, about the axes of the rotated frame.
///
/// Read from a quaternion (x, y, z, w) of length 1 to within 0.001, and normalized. The logarithm is the
/// shortest rotation vector. At an angle of exactly π there are two of them, and the logarithm jumps.
///
/// ```toml
/// [values]
/// r0 = { type = "so3", rotation = [0.0, 0.0, 0.6, 0.8] }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "Document", into = "Document")]
#[serde(bound(serialize = "Self: Into<Document>", deserialize = "Self: From<Document>"))]
#[schemars(with = "Document", bound = "")]
pub struct So3<T: Scalar = f64>(UnitQuaternion<T>);

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Document {
    /// Unit quaternion (x, y, z, w).
    rotation: Xyzw,
}

/// A unit quaternion, as written in documents.
#[derive(Clone, Copy, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "[f64; 4]", into = "[f64; 4]")]
#[schemars(with = "[f64; 4]")]
pub(crate) struct Xyzw(pub(crate) So3);

/// A quaternion that is not a rotation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "expected a unit quaternion (x, y, z, w), got {xyzw:?} of length {length}; its length has to be 1 to within 0.001"
)]
pub struct RotationError {
    /// The quaternion given.
    pub xyzw: [f64; 4],
    /// Its length.
    pub length: f64,
}

/// Normalizes a quaternion. If its length is already 1 up to rounding, it is returned unchanged, bit for bit.
fn renormalized(q: Quaternion<f64>) -> So3 {
    let n2 = q.norm_squared();
    let q = if (n2 - 1.0).abs() <= 4.0 * f64::EPSILON { q } else { q / n2.sqrt() };
    So3(UnitQuaternion::new_unchecked(q))
}

impl<T: Scalar> So3<T> {
    /// Returns the identity rotation.
    pub fn identity() -> Self {
        Self(UnitQuaternion::identity())
    }
    /// Returns the rotation about `omega` by its length, in radians.
    pub fn exp(omega: &Vector3<T>) -> Self {
        let e = small_angle::exponential(omega.norm_squared());
        Self(UnitQuaternion::new_unchecked(Quaternion::from_parts(e.cos_half, omega * e.sin_half)))
    }
    /// Returns the changes of velocity and of position in one unit of time, for a constant acceleration in a
    /// frame that turns by `omega` in this time. Both are in the frame at the beginning:
    /// ∫ Exp(s ω) a ds and ∫ (1 - s) Exp(s ω) a ds, for s from 0 to 1.
    pub fn integrals(omega: &Vector3<T>, acceleration: &Vector3<T>) -> (Vector3<T>, Vector3<T>) {
        let theta2 = omega.norm_squared();
        let e = small_angle::exponential(theta2);
        let once = omega.cross(acceleration);
        let twice = omega.cross(&once);
        (
            acceleration + once * e.a + twice * e.b,
            acceleration * T::from(0.5) + once * e.b + twice * small_angle::second_integral(theta2, e.a),
        )
    }
    /// Returns the shortest rotation vector, in radians.
    pub fn log(&self) -> Vector3<T> {
        self.log_and_k().0
    }
    /// Returns the logarithm ω and k(|ω|²) of [`small_angle::k`], which needs no further trigonometric
    /// function here.
    pub(crate) fn log_and_k(&self) -> (Vector3<T>, T) {
        let q = *self.0.quaternion();
        // q and -q are one rotation; the quaternion with w ≥ 0 has the shorter logarithm.
        let q = if q.w < T::zero() { -q } else { q };
        let (v, w) = (q.imag(), q.w);
        let n2 = v.norm_squared();
        // atan(n/w)/n as a series close to n = 0, as n has no derivative there.
        let scale = if n2 < T::from(1e-8) {
            let x = n2 / (w * w);
            (T::one() - x / 3.0 + x * x / 5.0) * 2.0 / w
        } else {
            let n = n2.sqrt();
            atan2(n, w) * 2.0 / n
        };
        let omega = v * scale;
        let theta2 = omega.norm_squared();
        (omega, small_angle::k(theta2, || theta2.sqrt() * 0.5 * w / n2.sqrt()))
    }
    /// Returns self · other.
    pub fn compose(&self, other: &Self) -> Self {
        Self(self.0 * other.0)
    }
    /// Returns self⁻¹.
    pub fn inverse(&self) -> Self {
        Self(self.0.conjugate())
    }
    /// Returns self⁻¹ · other.
    pub fn between(&self, other: &Self) -> Self {
        self.inverse().compose(other)
    }
    /// Returns R v.
    pub fn act(&self, v: &Vector3<T>) -> Vector3<T> {
        self.0 * v
    }
    /// Returns the rotation matrix R.
    pub fn matrix(&self) -> Matrix3<T> {
        self.0.to_rotation_matrix().into_inner()
    }
    /// Returns the unit quaternion; q and -q are one rotation.
    pub fn quaternion(&self) -> UnitQuaternion<T> {
        self.0
    }
}

impl So3 {
    /// Creates the rotation from a unit quaternion, given as x, y, z, w.
    ///
    /// # Errors
    /// If the length differs from 1 by more than 0.001. A smaller difference is removed by normalization.
    pub fn from_quaternion_xyzw(xyzw: [f64; 4]) -> Result<Self, RotationError> {
        let q = Quaternion::from(Vector4::from(xyzw));
        let length = q.norm();
        // This form also rejects NaN.
        if (length - 1.0).abs() <= 1e-3 { Ok(renormalized(q)) } else { Err(RotationError { xyzw, length }) }
    }
    /// Returns the unit quaternion as x, y, z, w.
    pub fn quaternion_xyzw(&self) -> [f64; 4] {
        self.0.coords.into()
    }
    /// Creates the rotation from an orthogonal matrix of determinant 1. Rounding errors in the matrix are
    /// removed.
    pub fn from_matrix(matrix: &Matrix3<f64>) -> Self {
        let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*matrix));
        renormalized(q.into_inner())
    }
    /// Returns x·Exp(δ) with its derivative with respect to δ at δ = 0, in the slots `first..first + 3` of
    /// jets with `dim` slots.
    pub fn seed_in<J: Jet>(&self, dim: usize, first: usize) -> So3<J> {
        let q = self.0.quaternion();
        // d(q·Exp(δ))/dδₖ = q·(eₖ/2)
        let dq: [Quaternion<f64>; 3] =
            std::array::from_fn(|k| q * Quaternion::from_imag(Vector3::ith(k, 0.5)));
        let coords = Vector4::from_fn(|i, _| jet(q.coords[i], dim, first, dq.map(|d| d.coords[i])));
        So3(UnitQuaternion::new_unchecked(Quaternion::from(coords)))
    }
    /// Returns self · other, normalized again, as repeated retractions would accumulate rounding errors.
    pub(crate) fn compose_renormalized(&self, other: &Self) -> Self {
        renormalized(self.compose(other).0.into_inner())
    }
    /// Returns Jᵣ(ω), with Exp(ω + δ) ≈ Exp(ω)·Exp(Jᵣ(ω)δ).
    pub fn right_jacobian(omega: &Vector3<f64>) -> Matrix3<f64> {
        let (w, e) = (omega.cross_matrix(), small_angle::exponential(omega.norm_squared()));
        Matrix3::identity() - w * e.a + w * w * e.b
    }
    /// Returns Jᵣ⁻¹(ω), with Log(Exp(ω)·Exp(δ)) ≈ ω + Jᵣ⁻¹(ω)δ.
    pub fn inverse_right_jacobian(omega: &Vector3<f64>) -> Matrix3<f64> {
        let (w, (k, _)) = (omega.cross_matrix(), small_angle::k_and_slope(omega.norm_squared()));
        Matrix3::identity() + w * 0.5 + w * w * k
    }
}

/// Returns a jet with three entries of its gradient set.
#[inline(always)]
pub(crate) fn jet<J: Jet>(value: f64, dim: usize, first: usize, derivatives: [f64; 3]) -> J {
    let mut gradient = [0.0; 32];
    gradient[first..first + 3].copy_from_slice(&derivatives);
    J::with_gradient(value, &gradient[..dim])
}

/// Storage order: the quaternion x, y, z, w.
impl Quantity for So3 {
    const SHAPE: Shape = Shape { name: "so3", size: 4 };
    type Of<T: Scalar> = So3<T>;
    #[inline]
    fn read<T: Scalar>(from: &[T]) -> So3<T> {
        So3(UnitQuaternion::new_unchecked(Quaternion::new(from[3], from[0], from[1], from[2])))
    }
    #[inline]
    fn write<T: Scalar>(x: &So3<T>, to: &mut [T]) {
        to.copy_from_slice(x.0.coords.as_slice());
    }
}

impl Manifold for So3 {
    type Dim = U3;
    type Of<T: Scalar> = So3<T>;
    const TANGENT: &'static [&'static str] = &["rx", "ry", "rz"];

    fn lift<T: Scalar>(&self) -> So3<T> {
        So3(UnitQuaternion::new_unchecked(Quaternion::from(self.0.coords.map(T::from))))
    }
    fn seed(&self) -> So3<JetOf<U3>> {
        self.seed_in(3, 0)
    }
    fn retract(&self, delta: &Vector3<f64>) -> Self {
        self.compose_renormalized(&So3::exp(delta))
    }
    fn local(&self, other: &Self) -> Vector3<f64> {
        self.between(other).log()
    }
    fn moved(&self, motion: Motion) -> Option<Vector3<f64>> {
        Some(self.inverse().act(&motion.rotation().into()))
    }
    fn is_finite(&self) -> bool {
        self.0.coords.iter().all(|x| x.is_finite())
    }
}
register_manifold!("so3", So3);

impl LieGroup for So3 {
    const NAME: &'static str = "so3";
    const EXAMPLE: &'static str = "{ rotation = [0.0, 0.0, 0.6, 0.8] }";
    fn identity() -> So3 {
        So3::identity()
    }
    fn compose(x: &So3, y: &So3) -> So3 {
        x.compose_renormalized(y)
    }
    fn inverse(x: &So3) -> So3 {
        x.inverse()
    }
    fn between<T: Scalar>(x: &So3<T>, y: &So3<T>) -> So3<T> {
        x.between(y)
    }
    fn log<T: Scalar>(x: &So3<T>) -> Vector3<T> {
        x.log()
    }
    fn inverse_right_jacobian(xi: &Vector3<f64>) -> Matrix3<f64> {
        So3::inverse_right_jacobian(xi)
    }
    fn adjoint_of_inverse(x: &So3) -> Matrix3<f64> {
        x.matrix().transpose()
    }
}

impl TryFrom<[f64; 4]> for Xyzw {
    type Error = RotationError;
    fn try_from(xyzw: [f64; 4]) -> Result<Self, RotationError> {
        So3::from_quaternion_xyzw(xyzw).map(Self)
    }
}
impl From<Xyzw> for [f64; 4] {
    fn from(q: Xyzw) -> [f64; 4] {
        q.0.quaternion_xyzw()
    }
}
impl From<Document> for So3 {
    fn from(document: Document) -> Self {
        document.rotation.0
    }
}
impl From<So3> for Document {
    fn from(x: So3) -> Self {
        Self { rotation: Xyzw(x) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::any_so3;
    use manifactor_testing::manifold_laws;
    use manifactor_testing::strategies::{rotation_vector, vector};
    use proptest::prelude::*;
    use std::f64::consts::PI;

    manifold_laws! { retract_and_local_are_inverse: (any_so3(), any_so3(), rotation_vector()) }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        #[test]
        fn exp_is_the_matrix_exponential(omega in rotation_vector()) {
            let expected = omega.cross_matrix().exp();
            prop_assert!((So3::exp(&omega).matrix() - expected).norm() < 1e-12);
        }

        #[test]
        fn integrals_are_those_of_the_exponential(omega in rotation_vector(), a in vector::<3>(10.0)) {
            // the columns of exp [ω]× a 0; 0 0 1; 0 0 0 are the rotation and the two integrals
            let mut generator = nalgebra::Matrix5::zeros();
            generator.fixed_view_mut::<3, 3>(0, 0).copy_from(&omega.cross_matrix());
            generator.fixed_view_mut::<3, 1>(0, 3).copy_from(&a);
            generator[(3, 4)] = 1.0;
            let expected = generator.exp();
            let (velocity, position) = So3::integrals(&omega, &a);
            prop_assert!((velocity - expected.fixed_view::<3, 1>(0, 3)).norm() < 1e-10);
            prop_assert!((position - expected.fixed_view::<3, 1>(0, 4)).norm() < 1e-10);
        }

        #[test]
        fn log_inverts_exp(omega in rotation_vector()) {
            prop_assert!((So3::exp(&omega).log() - omega).norm() < 1e-9);
        }

        #[test]
        fn a_quaternion_and_its_opposite_are_one_rotation(omega in rotation_vector()) {
            let opposite = So3::exp(&omega).quaternion_xyzw().map(|x| -x);
            let log = So3::from_quaternion_xyzw(opposite).unwrap().log();
            prop_assert!((log - omega).norm() < 1e-9, "the shortest rotation vector: {log}");
        }

        #[test]
        fn the_right_jacobians_are_inverse(omega in rotation_vector()) {
            let product = So3::right_jacobian(&omega) * So3::inverse_right_jacobian(&omega);
            prop_assert!((product - Matrix3::identity()).norm() < 1e-10);
        }

        #[test]
        fn a_matrix_gives_its_rotation_back(r in any_so3()) {
            prop_assert!(r.local(&So3::from_matrix(&r.matrix())).norm() < 1e-12);
        }

        #[test]
        fn acting_is_multiplying_by_the_matrix(r in any_so3(), v in vector::<3>(10.0)) {
            prop_assert!((r.act(&v) - r.matrix() * v).norm() < 1e-12);
        }
    }

    #[test]
    fn half_a_turn_has_a_logarithm() {
        for axis in [Vector3::x(), Vector3::y(), Vector3::new(0.6, 0.0, -0.8)] {
            let log = So3::exp(&(axis * PI)).log();
            assert!((log.norm() - PI).abs() < 1e-12 && log.cross(&axis).norm() < 1e-12, "{log}");
            assert!(So3::inverse_right_jacobian(&log).iter().all(|x| x.is_finite()));
            // w is exactly zero here.
            let half_turn = So3::from_quaternion_xyzw([axis.x, axis.y, axis.z, 0.0]).unwrap();
            let jets = half_turn.seed().log();
            assert!(jets.iter().all(|x| x.gradient().is_some_and(|g| g.iter().all(|x| x.is_finite()))));
        }
    }

    #[test]
    fn a_quarter_turn_about_z_takes_x_to_y() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let r = So3::from_quaternion_xyzw([0.0, 0.0, half, half]).unwrap();
        assert!((r.act(&Vector3::x()) - Vector3::y()).norm() < 1e-15);
        assert!((r.log() - Vector3::z() * (PI / 2.0)).norm() < 1e-15);
    }

    #[test]
    fn quaternions_are_checked_and_normalized_when_read() {
        let read = |text: &str| serde_json::from_str::<So3>(text);
        let r = read(r#"{ "rotation": [0, 0, 0.6005, 0.8] }"#).unwrap();
        assert!((r.quaternion().norm() - 1.0).abs() < 1e-15);
        let error = read(r#"{ "rotation": [0, 0, 0.7, 0.8] }"#).unwrap_err().to_string();
        assert!(error.contains("expected a unit quaternion") && error.contains("1.06"), "{error}");
        assert!(So3::from_quaternion_xyzw([f64::NAN, 0.0, 0.0, 1.0]).is_err());
        assert!(So3::from_quaternion_xyzw([0.0; 4]).is_err());
        assert!(read(r#"{ "rotation": [0, 0, 0, 1], "angle": 1 }"#).is_err());
    }

    #[test]
    fn many_small_steps_stay_rotations() {
        let step = Vector3::new(0.1, -0.2, 0.3);
        let r = (0..100_000).fold(So3::identity(), |r, _| r.retract(&step));
        assert!((r.quaternion().norm() - 1.0).abs() < 1e-15);
    }
}
