//! SE(3): poses in space.
use crate::groups::Coordinates;
use crate::groups::LieGroup;
use crate::groups::small_angle;
use crate::groups::{So3, Xyzw, jet};
use manifactor_graph::quantity::{Quantity, Shape};
use manifactor_graph::{Jet, JetOf, Lift, Manifold, Motion, Scalar, register_manifold};
use nalgebra::{Matrix3, Matrix4, Matrix6, U6, Vector3, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A pose in space, X·Exp(ω, v): tangent (rx, ry, rz, x, y, z), in radians and metres, in the local frame.
///
/// It maps points from the local frame to the outer one: R p + t. The rotation is a unit quaternion (x, y, z,
/// w).
///
/// ```toml
/// [values]
/// x0 = { type = "se3", translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8] }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "Document", into = "Document")]
#[serde(bound(serialize = "Self: Into<Document>", deserialize = "Self: From<Document>"))]
#[schemars(with = "Document", bound = "")]
pub struct Se3<T: Scalar = f64> {
    /// Rotates directions from the local frame to the outer one.
    pub rotation: So3<T>,
    /// Origin of the local frame in the outer one.
    pub translation: Vector3<T>,
}

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Document {
    /// Position, in metres.
    translation: Coordinates<3>,
    /// Unit quaternion (x, y, z, w).
    rotation: Xyzw,
}

fn split_tangent<T: Scalar>(xi: &Vector6<T>) -> (Vector3<T>, Vector3<T>) {
    (Vector3::new(xi[0], xi[1], xi[2]), Vector3::new(xi[3], xi[4], xi[5]))
}

/// Returns the block matrix [a 0; b c].
fn block_lower(a: &Matrix3<f64>, b: &Matrix3<f64>, c: &Matrix3<f64>) -> Matrix6<f64> {
    let mut m = Matrix6::zeros();
    m.fixed_view_mut::<3, 3>(0, 0).copy_from(a);
    m.fixed_view_mut::<3, 3>(3, 0).copy_from(b);
    m.fixed_view_mut::<3, 3>(3, 3).copy_from(c);
    m
}

impl<T: Scalar> Se3<T> {
    /// Creates the pose with this rotation and this position.
    pub fn new(rotation: So3<T>, translation: Vector3<T>) -> Self {
        Self { rotation, translation }
    }
    /// Returns the identity: the outer frame.
    pub fn identity() -> Self {
        Self::new(So3::identity(), Vector3::zeros())
    }
    /// Returns the pose after turning by ω and moving by v at constant speed in the local frame: ξ = (ω, v).
    pub fn exp(xi: &Vector6<T>) -> Self {
        let (w, v) = split_tangent(xi);
        let e = small_angle::exponential(w.norm_squared());
        let wv = w.cross(&v);
        Self::new(So3::exp(&w), v + wv * e.a + w.cross(&wv) * e.b)
    }
    /// Returns ξ = (ω, v), the inverse of [`Se3::exp`].
    pub fn log(&self) -> Vector6<T> {
        let (w, k) = self.rotation.log_and_k();
        let wt = w.cross(&self.translation);
        let v = self.translation - wt * T::from(0.5) + w.cross(&wt) * k;
        Vector6::new(w.x, w.y, w.z, v.x, v.y, v.z)
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
    pub fn act(&self, point: &Vector3<T>) -> Vector3<T> {
        self.rotation.act(point) + self.translation
    }
    /// Maps a point from the outer frame to the local one.
    pub fn inverse_act(&self, point: &Vector3<T>) -> Vector3<T> {
        self.rotation.inverse().act(&(point - self.translation))
    }
    /// Returns the homogeneous matrix [R t; 0 1].
    pub fn matrix(&self) -> Matrix4<T> {
        let mut m = Matrix4::identity();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.rotation.matrix());
        m.fixed_view_mut::<3, 1>(0, 3).copy_from(&self.translation);
        m
    }
}

impl Se3 {
    /// Returns the adjoint Ad(x), with x·Exp(δ)·x⁻¹ = Exp(Ad(x)δ).
    pub fn adjoint(&self) -> Matrix6<f64> {
        let r = self.rotation.matrix();
        block_lower(&r, &(self.translation.cross_matrix() * r), &r)
    }
    /// Returns Jᵣ⁻¹(ξ), with Log(Exp(ξ)·Exp(δ)) ≈ ξ + Jᵣ⁻¹(ξ)δ.
    pub fn inverse_right_jacobian(xi: &Vector6<f64>) -> Matrix6<f64> {
        let (w, v) = split_tangent(xi);
        let (wx, vx) = (w.cross_matrix(), v.cross_matrix());
        let (k, slope) = small_angle::k_and_slope(w.norm_squared());
        let r = Matrix3::identity() + wx * 0.5 + wx * wx * k;
        // Derivative of r(ω) in the direction v.
        let q = vx * 0.5 + (wx * vx + vx * wx) * k + wx * wx * (slope * w.dot(&v));
        block_lower(&r, &q, &r)
    }
    /// Returns Jᵣ(ξ), with Exp(ξ + δ) ≈ Exp(ξ)·Exp(Jᵣ(ξ)δ). Defined for any rotation, also beyond a whole turn.
    pub fn right_jacobian(xi: &Vector6<f64>) -> Matrix6<f64> {
        let (w, v) = split_tangent(xi);
        let (wx, vx) = (w.cross_matrix(), v.cross_matrix());
        let e = small_angle::exponential(w.norm_squared());
        let (a_slope, b_slope) = small_angle::exponential_slopes(w.norm_squared(), &e);
        let (wx2, along) = (wx * wx, w.dot(&v));
        let r = Matrix3::identity() - wx * e.a + wx2 * e.b;
        // Derivative of r(ω) in the direction v.
        let q = (wx * vx + vx * wx) * e.b - vx * e.a + wx2 * (b_slope * along) - wx * (a_slope * along);
        block_lower(&r, &q, &r)
    }
    /// Returns x·Exp(δ) with its derivative with respect to δ at δ = 0, in the slots `first..first + 6` of
    /// jets with `dim` slots. For manifolds that contain a pose.
    pub fn seed_in<J: Jet>(&self, dim: usize, first: usize) -> Se3<J> {
        let r = self.rotation.matrix();
        let translation = Vector3::from_fn(|i, _| {
            jet(self.translation[i], dim, first + 3, [r[(i, 0)], r[(i, 1)], r[(i, 2)]])
        });
        Se3::new(self.rotation.seed_in(dim, first), translation)
    }
}

/// Storage order: the rotation, then the translation.
impl Quantity for Se3 {
    const SHAPE: Shape = Shape { name: "se3", size: 7 };
    type Of<T: Scalar> = Se3<T>;
    #[inline]
    fn read<T: Scalar>(from: &[T]) -> Se3<T> {
        Se3::new(So3::read(from), Vector3::<f64>::read(&from[4..]))
    }
    #[inline]
    fn write<T: Scalar>(x: &Se3<T>, to: &mut [T]) {
        So3::write(&x.rotation, &mut to[..4]);
        Vector3::<f64>::write(&x.translation, &mut to[4..]);
    }
}

impl Manifold for Se3 {
    type Dim = U6;
    type Of<T: Scalar> = Se3<T>;
    const TANGENT: &'static [&'static str] = &["rx", "ry", "rz", "x", "y", "z"];

    fn lift<T: Scalar>(&self) -> Se3<T> {
        Se3::new(self.rotation.lift(), self.translation.lift())
    }
    fn seed(&self) -> Se3<JetOf<U6>> {
        self.seed_in(6, 0)
    }
    fn retract(&self, delta: &Vector6<f64>) -> Self {
        LieGroup::compose(self, &Se3::exp(delta))
    }
    fn local(&self, other: &Self) -> Vector6<f64> {
        self.between(other).log()
    }
    fn position(&self) -> Option<[f64; 3]> {
        Some(self.translation.into())
    }
    fn moved(&self, motion: Motion) -> Option<Vector6<f64>> {
        let local = |v: [f64; 3]| self.rotation.inverse().act(&v.into());
        let (w, v) = (local(motion.rotation()), local(motion.velocity(self.translation.into())));
        Some(Vector6::new(w.x, w.y, w.z, v.x, v.y, v.z))
    }
    fn is_finite(&self) -> bool {
        self.rotation.is_finite() && self.translation.iter().all(|x| x.is_finite())
    }
}
register_manifold!("se3", Se3);

impl LieGroup for Se3 {
    const NAME: &'static str = "se3";
    const EXAMPLE: &'static str = "{ translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8] }";
    const LEADING: usize = 3;
    fn identity() -> Se3 {
        Se3::identity()
    }
    fn compose(x: &Se3, y: &Se3) -> Se3 {
        Se3::new(x.rotation.compose_renormalized(&y.rotation), x.act(&y.translation))
    }
    fn inverse(x: &Se3) -> Se3 {
        x.inverse()
    }
    fn between<T: Scalar>(x: &Se3<T>, y: &Se3<T>) -> Se3<T> {
        x.between(y)
    }
    fn log<T: Scalar>(x: &Se3<T>) -> Vector6<T> {
        x.log()
    }
    fn inverse_right_jacobian(xi: &Vector6<f64>) -> Matrix6<f64> {
        Se3::inverse_right_jacobian(xi)
    }
    fn adjoint_of_inverse(x: &Se3) -> Matrix6<f64> {
        let r = x.rotation.matrix().transpose();
        block_lower(&r, &(-r * x.translation.cross_matrix()), &r)
    }
}

impl From<Document> for Se3 {
    fn from(document: Document) -> Self {
        Self::new(document.rotation.0, document.translation.vector())
    }
}
impl From<Se3> for Document {
    fn from(x: Se3) -> Self {
        Self { translation: Coordinates::unchecked(x.translation), rotation: Xyzw(x.rotation) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_se3, se3_tangent};
    use manifactor_testing::manifold_laws;
    use manifactor_testing::strategies::vector;
    use proptest::prelude::*;

    manifold_laws! { retract_and_local_are_inverse: (any_se3(), any_se3(), se3_tangent()) }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        #[test]
        fn exp_is_the_matrix_exponential(xi in se3_tangent()) {
            let (w, v) = split_tangent(&xi);
            let mut m = Matrix4::zeros();
            m.fixed_view_mut::<3, 3>(0, 0).copy_from(&w.cross_matrix());
            m.fixed_view_mut::<3, 1>(0, 3).copy_from(&v);
            prop_assert!((Se3::exp(&xi).matrix() - m.exp()).norm() < 1e-11);
        }

        #[test]
        fn log_inverts_exp(xi in se3_tangent()) {
            prop_assert!((Se3::exp(&xi).log() - xi).norm() < 1e-9);
        }

        #[test]
        fn acting_is_multiplying_by_the_matrix(x in any_se3(), p in vector::<3>(10.0)) {
            prop_assert!((x.act(&p).push(1.0) - x.matrix() * p.push(1.0)).norm() < 1e-12);
            prop_assert!((x.inverse_act(&x.act(&p)) - p).norm() < 1e-12);
            prop_assert!((x.inverse().act(&p) - x.inverse_act(&p)).norm() < 1e-12);
        }

        #[test]
        fn composition_follows_the_matrices(x in any_se3(), y in any_se3()) {
            prop_assert!((x.compose(&y).matrix() - x.matrix() * y.matrix()).norm() < 1e-11);
            prop_assert!(x.between(&x.compose(&y)).local(&y).norm() < 1e-9);
        }

        #[test]
        fn the_adjoint_moves_a_step_to_the_other_side(x in any_se3(), delta in se3_tangent()) {
            let (left, right) = (x.adjoint() * delta, x.compose(&Se3::exp(&delta)));
            prop_assert!((Se3::exp(&left).compose(&x).matrix() - right.matrix()).norm() < 1e-9);
            let inverse = Se3::adjoint_of_inverse(&x) * x.adjoint();
            prop_assert!((inverse - Matrix6::identity()).norm() < 1e-10);
        }
    }

    proptest! {
        #[test]
        fn the_right_jacobian_is_that_of_exp(xi in se3_tangent(), turns in 1.0..2.0_f64) {
            let product = Se3::right_jacobian(&xi) * Se3::inverse_right_jacobian(&xi);
            prop_assert!((product - Matrix6::identity()).norm() < 1e-9, "{product}");
            // Jᵣ(ξ) ξ = ξ, also beyond half a turn
            let longer = xi * turns;
            prop_assert!((Se3::right_jacobian(&longer) * longer - longer).norm() < 1e-10);
            for i in 0..6 {
                let step = Vector6::ith(i, 1e-5);
                let exp = |sign: f64| Se3::exp(&(longer + step * sign));
                let numeric = exp(-1.0).local(&exp(1.0)) / 2e-5;
                let column = Se3::right_jacobian(&longer).column(i) - numeric;
                prop_assert!(column.norm() < 1e-6, "{column}");
            }
        }
    }

    #[test]
    fn a_turning_frame_moves_on_an_arc() {
        // Forward at 1 m/s, a quarter turn to the left in 1 s: radius 2/π.
        let radius = std::f64::consts::FRAC_2_PI;
        let pose = Se3::exp(&Vector6::new(0.0, 0.0, 1.0 / radius, 1.0, 0.0, 0.0));
        assert!((pose.translation - Vector3::new(radius, radius, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn documents_are_checked_when_read() {
        let read = |text: &str| serde_json::from_str::<Se3>(text).map_err(|e| e.to_string());
        let rotation = r#""rotation": [0, 0, 0, 1]"#;
        assert_eq!(read(&format!(r#"{{ "translation": [0, 0, 0], {rotation} }}"#)), Ok(Se3::identity()));
        let error = read(&format!(r#"{{ "translation": [0, 0], {rotation} }}"#)).unwrap_err();
        assert!(error.contains("expected 3 numbers, got 2"), "{error}");
        let error = read(&format!(r#"{{ "translation": [0, 0, 0], {rotation}, "x": 1 }}"#)).unwrap_err();
        assert!(error.contains("unknown field `x`"), "{error}");
        assert!(read(r#"{ "translation": [0, 0, 0] }"#).unwrap_err().contains("missing field `rotation`"));
    }
}
