//! Sim(3): poses in space with a scale.
use crate::groups::{Coordinates, LieGroup, Se3, So3, Xyzw, jet, small_angle};
use manifactor_graph::checked::Positive;
use manifactor_graph::quantity::{Quantity, Shape};
use manifactor_graph::{Jet, JetOf, Lift, Manifold, Scalar, register_manifold};
use nalgebra::{Matrix3, Matrix4, SMatrix, SVector, U4, U7, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A pose with a scale, X·Exp(ω, v, λ): tangent (rx, ry, rz, x, y, z, log_scale), in the local frame.
///
/// It maps points from the local frame to the outer one: s R p + t. The tangent is in radians, metres of the local
/// frame, and the logarithm of the scale. A camera without depth measures up to a scale that drifts; a pose graph of
/// such poses corrects it.
///
/// ```toml
/// [values]
/// x0 = { type = "sim3", translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8], scale = 1.2 }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "Document", into = "Document")]
#[serde(bound(serialize = "Self: Into<Document>", deserialize = "Self: From<Document>"))]
#[schemars(with = "Document", bound = "")]
pub struct Sim3<T: Scalar = f64> {
    /// Rotates directions from the local frame to the outer one.
    pub rotation: So3<T>,
    /// Origin of the local frame in the outer one.
    pub translation: Vector3<T>,
    /// Length in the outer frame of a unit of the local one; positive.
    pub scale: T,
}

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Document {
    /// Position, in metres.
    translation: Coordinates<3>,
    /// Unit quaternion (x, y, z, w).
    rotation: Xyzw,
    /// Length in the outer frame of a unit of the local one.
    #[serde(deserialize_with = "positive")]
    #[schemars(with = "Positive")]
    scale: f64,
}

fn positive<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Positive::deserialize(deserializer).map(|scale| *scale)
}

type Vector7<T> = SVector<T, 7>;
type Matrix7 = SMatrix<f64, 7, 7>;

/// Returns ω, v and λ.
fn split_tangent<T: Scalar>(xi: &Vector7<T>) -> (Vector3<T>, Vector3<T>, T) {
    (Vector3::new(xi[0], xi[1], xi[2]), Vector3::new(xi[3], xi[4], xi[5]), xi[6])
}

/// Returns (a + b ω^ + c (ω^)²) v.
fn apply<T: Scalar>([a, b, c]: [T; 3], w: &Vector3<T>, v: &Vector3<T>) -> Vector3<T> {
    let wv = w.cross(v);
    v * a + wv * b + w.cross(&wv) * c
}

impl<T: Scalar> Sim3<T> {
    /// Creates the similarity with this rotation, position and scale.
    pub fn new(rotation: So3<T>, translation: Vector3<T>, scale: T) -> Self {
        Self { rotation, translation, scale }
    }
    /// Returns the identity: the outer frame.
    pub fn identity() -> Self {
        Self::rigid(Se3::identity())
    }
    /// Creates the similarity of scale 1 from a pose.
    pub fn rigid(pose: Se3<T>) -> Self {
        Self::new(pose.rotation, pose.translation, T::one())
    }
    /// Returns the similarity after turning by ω, moving by v and growing by the factor e^λ at constant speed in the
    /// local frame: ξ = (ω, v, λ).
    pub fn exp(xi: &Vector7<T>) -> Self {
        let (w, v, lambda) = split_tangent(xi);
        let integral = small_angle::scaled_integral(w.norm_squared(), lambda);
        Self::new(So3::exp(&w), apply(integral.forward, &w, &v), lambda.exp())
    }
    /// Returns ξ = (ω, v, λ), the inverse of [`Sim3::exp`].
    pub fn log(&self) -> Vector7<T> {
        let (w, lambda) = (self.rotation.log(), self.scale.ln());
        let integral = small_angle::scaled_integral(w.norm_squared(), lambda);
        let v = apply(integral.inverse, &w, &self.translation);
        Vector7::from([w.x, w.y, w.z, v.x, v.y, v.z, lambda])
    }
    /// Returns self · other.
    pub fn compose(&self, other: &Self) -> Self {
        Self::new(
            self.rotation.compose(&other.rotation),
            self.act(&other.translation),
            self.scale * other.scale,
        )
    }
    /// Returns self⁻¹.
    pub fn inverse(&self) -> Self {
        let (rotation, scale) = (self.rotation.inverse(), self.scale.recip());
        Self::new(rotation, -rotation.act(&self.translation) * scale, scale)
    }
    /// Returns self⁻¹ · other, the similarity `other` in the frame of `self`.
    pub fn between(&self, other: &Self) -> Self {
        let scale = self.scale.recip();
        let translation = self.inverse_act(&other.translation);
        Self::new(self.rotation.between(&other.rotation), translation, other.scale * scale)
    }
    /// Maps a point from the local frame to the outer one.
    pub fn act(&self, point: &Vector3<T>) -> Vector3<T> {
        self.rotation.act(point) * self.scale + self.translation
    }
    /// Maps a point from the outer frame to the local one.
    pub fn inverse_act(&self, point: &Vector3<T>) -> Vector3<T> {
        self.rotation.inverse().act(&(point - self.translation)) * self.scale.recip()
    }
    /// Maps a pose from the local frame to the outer one. Only its position is scaled.
    pub fn act_on_pose(&self, pose: &Se3<T>) -> Se3<T> {
        Se3::new(self.rotation.compose(&pose.rotation), self.act(&pose.translation))
    }
    /// Returns the rotation and the position, without the scale.
    pub fn pose(&self) -> Se3<T> {
        Se3::new(self.rotation, self.translation)
    }
    /// Returns the homogeneous matrix [sR t; 0 1].
    pub fn matrix(&self) -> Matrix4<T> {
        let mut m = Matrix4::identity();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(&(self.rotation.matrix() * self.scale));
        m.fixed_view_mut::<3, 1>(0, 3).copy_from(&self.translation);
        m
    }
}

impl Sim3 {
    /// Returns Jᵣ⁻¹(ξ), with Log(Exp(ξ)·Exp(δ)) ≈ ξ + Jᵣ⁻¹(ξ)δ.
    ///
    /// v = W⁻¹t depends on ω and λ through W alone, whose derivative is that of [`Sim3::exp`] by dual numbers.
    pub fn inverse_right_jacobian(xi: &Vector7<f64>) -> Matrix7 {
        let (w, v, lambda) = split_tangent(xi);
        let integral = small_angle::scaled_integral(w.norm_squared(), lambda);
        let inverse = |x: Vector3<f64>| apply(integral.inverse, &w, &x);
        let of_rotation = So3::inverse_right_jacobian(&w);
        let moved = derivatives_of_translation(&w, &v, lambda);
        let by_rotation = -Matrix3::from_columns(&[0, 1, 2].map(|i| inverse(moved[i]))) * of_rotation;
        let scaled = So3::exp(&w).matrix() * lambda.exp();
        let by_translation = Matrix3::from_columns(&[0, 1, 2].map(|i| inverse(scaled.column(i).into())));
        let mut m = Matrix7::identity();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(&of_rotation);
        m.fixed_view_mut::<3, 3>(3, 0).copy_from(&by_rotation);
        m.fixed_view_mut::<3, 3>(3, 3).copy_from(&by_translation);
        m.fixed_view_mut::<3, 1>(3, 6).copy_from(&-inverse(moved[3]));
        m
    }
}

/// Returns the derivatives of W(ω, λ)v with respect to ω and λ.
fn derivatives_of_translation(w: &Vector3<f64>, v: &Vector3<f64>, lambda: f64) -> [Vector3<f64>; 4] {
    let dual = |x: f64, slot: usize| jet::<JetOf<U4>>(x, 4, slot, [1.0, 0.0, 0.0]);
    let (w, lambda) = (Vector3::new(dual(w.x, 0), dual(w.y, 1), dual(w.z, 2)), dual(lambda, 3));
    let integral = small_angle::scaled_integral(w.norm_squared(), lambda);
    let moved = apply(integral.forward, &w, &v.lift());
    let slope = |row: usize, slot: usize| moved[row].gradient().map_or(0.0, |gradient| gradient[slot]);
    [0, 1, 2, 3].map(|slot| Vector3::from_fn(|row, _| slope(row, slot)))
}

/// Storage order: the rotation, the translation, the scale.
impl Quantity for Sim3 {
    const SHAPE: Shape = Shape { name: "sim3", size: 8 };
    type Of<T: Scalar> = Sim3<T>;
    #[inline]
    fn read<T: Scalar>(from: &[T]) -> Sim3<T> {
        let pose = Se3::read(from);
        Sim3::new(pose.rotation, pose.translation, from[7])
    }
    #[inline]
    fn write<T: Scalar>(x: &Sim3<T>, to: &mut [T]) {
        Se3::write(&x.pose(), &mut to[..7]);
        to[7] = x.scale;
    }
}

impl Manifold for Sim3 {
    type Dim = U7;
    type Of<T: Scalar> = Sim3<T>;
    const TANGENT: &'static [&'static str] = &["rx", "ry", "rz", "x", "y", "z", "log_scale"];

    fn lift<T: Scalar>(&self) -> Sim3<T> {
        Sim3::new(self.rotation.lift(), self.translation.lift(), T::from(self.scale))
    }
    fn seed(&self) -> Sim3<JetOf<U7>> {
        let r = self.rotation.matrix() * self.scale;
        let translation =
            Vector3::from_fn(|i, _| jet(self.translation[i], 7, 3, [r[(i, 0)], r[(i, 1)], r[(i, 2)]]));
        Sim3::new(self.rotation.seed_in(7, 0), translation, jet(self.scale, 7, 6, [self.scale, 0.0, 0.0]))
    }
    fn retract(&self, delta: &Vector7<f64>) -> Self {
        LieGroup::compose(self, &Sim3::exp(delta))
    }
    fn local(&self, other: &Self) -> Vector7<f64> {
        self.between(other).log()
    }
    fn position(&self) -> Option<[f64; 3]> {
        Some(self.translation.into())
    }
    fn is_finite(&self) -> bool {
        self.pose().is_finite() && self.scale.is_finite() && self.scale > 0.0
    }
}
register_manifold!("sim3", Sim3);

impl LieGroup for Sim3 {
    const NAME: &'static str = "sim3";
    const EXAMPLE: &'static str =
        "{ translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8], scale = 1.2 }";
    const LEADING: usize = 3;
    fn identity() -> Sim3 {
        Sim3::identity()
    }
    fn compose(x: &Sim3, y: &Sim3) -> Sim3 {
        Sim3::new(x.rotation.compose_renormalized(&y.rotation), x.act(&y.translation), x.scale * y.scale)
    }
    fn inverse(x: &Sim3) -> Sim3 {
        x.inverse()
    }
    fn between<T: Scalar>(x: &Sim3<T>, y: &Sim3<T>) -> Sim3<T> {
        x.between(y)
    }
    fn log<T: Scalar>(x: &Sim3<T>) -> Vector7<T> {
        x.log()
    }
    fn inverse_right_jacobian(xi: &Vector7<f64>) -> Matrix7 {
        Sim3::inverse_right_jacobian(xi)
    }
    fn adjoint_of_inverse(x: &Sim3) -> Matrix7 {
        let r = x.rotation.matrix().transpose();
        let (shrunk, t) = (r / x.scale, x.translation);
        let mut m = Matrix7::identity();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(&r);
        m.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-shrunk * t.cross_matrix()));
        m.fixed_view_mut::<3, 3>(3, 3).copy_from(&shrunk);
        m.fixed_view_mut::<3, 1>(3, 6).copy_from(&(shrunk * t));
        m
    }
}

impl From<Document> for Sim3 {
    fn from(document: Document) -> Self {
        Self::new(document.rotation.0, document.translation.vector(), document.scale)
    }
}
impl From<Sim3> for Document {
    fn from(x: Sim3) -> Self {
        Self {
            translation: Coordinates::unchecked(x.translation),
            rotation: Xyzw(x.rotation),
            scale: x.scale,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_sim3, sim3_tangent};
    use manifactor_testing::manifold_laws;
    use manifactor_testing::strategies::vector;
    use proptest::prelude::*;

    manifold_laws! { retract_and_local_are_inverse: (any_sim3(), any_sim3(), sim3_tangent()) }

    /// Largest entry relative to the largest entry of the second matrix.
    fn deviation(a: &Matrix4<f64>, b: &Matrix4<f64>) -> f64 {
        (a - b).amax() / b.amax()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        #[test]
        fn exp_is_the_matrix_exponential(xi in sim3_tangent()) {
            let (w, v, lambda) = split_tangent(&xi);
            let mut m = Matrix4::zeros();
            m.fixed_view_mut::<3, 3>(0, 0).copy_from(&(w.cross_matrix() + Matrix3::identity() * lambda));
            m.fixed_view_mut::<3, 1>(0, 3).copy_from(&v);
            prop_assert!(deviation(&Sim3::exp(&xi).matrix(), &m.exp()) < 1e-12);
        }

        #[test]
        fn log_inverts_exp(xi in sim3_tangent()) {
            prop_assert!((Sim3::exp(&xi).log() - xi).norm() < 1e-8);
        }

        #[test]
        fn acting_is_multiplying_by_the_matrix(x in any_sim3(), y in any_sim3(), p in vector::<3>(10.0)) {
            prop_assert!((x.act(&p).push(1.0) - x.matrix() * p.push(1.0)).norm() < 1e-11);
            prop_assert!((x.inverse_act(&x.act(&p)) - p).norm() < 1e-10);
            prop_assert!((x.inverse().act(&p) - x.inverse_act(&p)).norm() < 1e-10);
            prop_assert!(deviation(&x.compose(&y).matrix(), &(x.matrix() * y.matrix())) < 1e-12);
            prop_assert!(x.between(&x.compose(&y)).local(&y).norm() < 1e-8);
        }

        #[test]
        fn the_adjoint_moves_a_step_to_the_other_side(x in any_sim3(), delta in sim3_tangent()) {
            let moved = Sim3::exp(&(Sim3::adjoint_of_inverse(&x) * delta));
            let expected = x.inverse().compose(&Sim3::exp(&delta)).compose(&x);
            prop_assert!(deviation(&moved.matrix(), &expected.matrix()) < 1e-9);
        }
    }

    #[test]
    fn a_growing_frame_moves_on_a_spiral() {
        // Forward at 1 m/s, half a turn and twice the size in 1 s: ∫ e^{(ln 2 + iπ) s} ds.
        let (turn, growth) = (std::f64::consts::PI, std::f64::consts::LN_2);
        let end = Sim3::exp(&Vector7::from([0.0, 0.0, turn, 1.0, 0.0, 0.0, growth]));
        let size = turn * turn + growth * growth;
        let expected = Vector3::new(-3.0 * growth, 3.0 * turn, 0.0) / size;
        assert!((end.translation - expected).norm() < 1e-14, "{}", end.translation);
        assert!((end.scale - 2.0).abs() < 1e-15);
    }

    #[test]
    fn a_scale_has_to_be_positive() {
        let read = |scale: &str| {
            let text =
                format!(r#"{{ "translation": [0, 0, 0], "rotation": [0, 0, 0, 1], "scale": {scale} }}"#);
            serde_json::from_str::<Sim3>(&text).map_err(|error| error.to_string())
        };
        assert_eq!(read("1"), Ok(Sim3::identity()));
        for scale in ["0", "-1", "\"big\""] {
            assert!(read(scale).is_err());
        }
        assert!(!Sim3 { scale: 0.0, ..Sim3::identity() }.is_finite());
    }
}
