//! Objects as constrained dual quadrics: ellipsoids with a pose and three positive semi-axes.
use crate::shapes::Box3;
use crate::shapes::ellipsoid;
use crate::shapes::{SemiAxes, semi_axes};
use manifactor_geometry::{Coordinates, RotationError, Se3, So3};
use manifactor_graph::invariance::Random;
use manifactor_graph::quantity::{Quantity, Shape};
use manifactor_graph::{Jet, JetOf, Lift, Manifold, Motion, Scalar, register_manifold};
use nalgebra::{Matrix4, SVector, U9, Vector3, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// An object as an ellipsoid: Q* = Z diag(a², b², c², -1) Zᵀ with the pose Z.
///
/// Tangent (rx, ry, rz, x, y, z, log_a, log_b, log_c): the pose steps by Z·Exp(δ) in the local frame, the
/// semi-axes by s·exp(δ). The semi-axes therefore stay positive for any step; they are clamped to 1e-9 to 1e9
/// metres. Rotating the ellipsoid about a principal axis by half a turn, or permuting its axes, describes one
/// body by different points of the manifold.
///
/// ```toml
/// [values]
/// q0 = { type = "dual_quadric", translation = [0.5, 0.2, 4.0], rotation = [0.0, 0.0, 0.6, 0.8], semi_axes = [0.1, 0.2, 0.3] }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "Document", into = "Document")]
#[serde(bound(serialize = "Self: Into<Document>", deserialize = "Self: From<Document>"))]
#[schemars(with = "Document", bound = "")]
pub struct DualQuadric<T: Scalar = f64> {
    /// Centre and axes: maps points from the ellipsoid's local frame to the outer one.
    pub pose: Se3<T>,
    /// Half the extents along the local x, y and z axes, in metres; from 1e-9 to 1e9.
    pub semi_axes: Vector3<T>,
}

#[derive(Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Document {
    /// Centre, in metres.
    translation: Centre,
    /// Unit quaternion (x, y, z, w).
    rotation: Xyzw,
    /// Half the extents along the local axes, in metres: three numbers from 1e-9 to 1e9.
    semi_axes: SemiAxes,
}

/// Three finite numbers.
#[derive(Clone, Copy, Serialize, Deserialize, JsonSchema)]
#[serde(from = "Coordinates<3>", into = "[f64; 3]")]
#[schemars(with = "[f64; 3]")]
struct Centre(Vector3<f64>);

/// A unit quaternion.
#[derive(Clone, Copy, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "[f64; 4]", into = "[f64; 4]")]
#[schemars(with = "[f64; 4]")]
struct Xyzw(So3);

impl<T: Scalar> DualQuadric<T> {
    /// Returns Q* = Z diag(a², b², c², -1) Zᵀ. Planes π with πᵀQ*π = 0 touch the ellipsoid.
    pub fn matrix(&self) -> Matrix4<T> {
        let z = self.pose.matrix();
        let s = self.semi_axes.component_mul(&self.semi_axes);
        z * Matrix4::from_diagonal(&s.push(-T::one())) * z.transpose()
    }
    /// Returns the centre.
    pub fn centroid(&self) -> Vector3<T> {
        self.pose.translation
    }
    /// Returns the unit direction of the longest semi-axis, the first of equal ones; its sign is arbitrary.
    ///
    /// It is a column of the rotation, because an eigendecomposition of Q* has no derivative if axes are
    /// equally long. It jumps if a different axis becomes the longest.
    pub fn major_axis(&self) -> Vector3<T> {
        let s = &self.semi_axes;
        let longer = if s[1] > s[0] { 1 } else { 0 };
        let longest = if s[2] > s[longer] { 2 } else { longer };
        self.pose.rotation.act(&Vector3::ith(longest, T::one()))
    }
}

impl DualQuadric {
    /// Returns the smallest axis-aligned box in the outer frame around the ellipsoid.
    pub fn axes_aligned_box(&self) -> Box3 {
        let axes = self.pose.rotation.matrix() * nalgebra::Matrix3::from_diagonal(&self.semi_axes);
        let half = Vector3::from_fn(|i, _| axes.row(i).norm());
        Box3 { min: self.centroid() - half, max: self.centroid() + half }
    }
    /// Returns whether the shortest semi-axis is below 1/50 of the longest. Boxes from one side leave the
    /// thickness of an object undetermined, and an estimate without a prior then collapses to a plate.
    pub fn is_flat(&self) -> bool {
        const MAX_AXIS_RATIO: f64 = 50.0;
        self.semi_axes.max() > MAX_AXIS_RATIO * self.semi_axes.min()
    }
    /// Returns whether the whole ellipsoid is in front of a camera, see
    /// [`Ellipsoid::is_in_front`](crate::Ellipsoid::is_in_front).
    #[inline]
    pub fn is_in_front_of(&self, world_from_camera: &Se3) -> bool {
        // Only the extent along the optical axis matters, which halves the work.
        let forward = world_from_camera.rotation.act(&Vector3::z());
        let z = forward.dot(&(self.centroid() - world_from_camera.translation));
        let b = self.pose.rotation.inverse().act(&forward).component_mul(&self.semi_axes);
        ellipsoid::is_in_front(z, b.norm_squared())
    }
    /// Returns whether a point of the outer frame is inside the ellipsoid or on its surface.
    pub fn contains(&self, point: &Vector3<f64>) -> bool {
        self.pose.inverse_act(point).component_div(&self.semi_axes).norm_squared() <= 1.0
    }
}

/// Rotates about `up`, moves and scales the object at random: orientation factors are invariant to all of
/// these.
pub(crate) fn move_and_scale(quadric: &DualQuadric, up: &Vector3<f64>, random: Random<'_>) -> DualQuadric {
    let turn = So3::exp(&(up * random(3.0)));
    let moved = quadric.centroid() + Vector3::new(random(5.0), random(5.0), random(5.0));
    let pose = Se3::new(turn.compose(&quadric.pose.rotation), moved);
    DualQuadric { pose, semi_axes: quadric.semi_axes * random(2.0).exp() }
}

/// Storage order: the pose, then the semi-axes.
impl Quantity for DualQuadric {
    const SHAPE: Shape = Shape { name: "dual_quadric", size: 10 };
    type Of<T: Scalar> = DualQuadric<T>;
    #[inline]
    fn read<T: Scalar>(from: &[T]) -> DualQuadric<T> {
        DualQuadric { pose: Se3::read(from), semi_axes: Vector3::<f64>::read(&from[7..]) }
    }
    #[inline]
    fn write<T: Scalar>(x: &DualQuadric<T>, to: &mut [T]) {
        Se3::write(&x.pose, &mut to[..7]);
        Vector3::<f64>::write(&x.semi_axes, &mut to[7..]);
    }
}

/// Writes `(1.000, 0.000, 0.500) m, 90.000° about (0.000, 0.000, 1.000), semi-axes (0.100, 0.200, 0.300) m`.
impl fmt::Display for DualQuadric {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([a, b, c], decimals): ([f64; 3], usize) = (self.semi_axes.into(), f.precision().unwrap_or(3));
        self.pose.fmt(f)?;
        write!(f, ", semi-axes ({a:.decimals$}, {b:.decimals$}, {c:.decimals$}) m")
    }
}

impl Manifold for DualQuadric {
    type Dim = U9;
    type Of<T: Scalar> = DualQuadric<T>;
    const TANGENT: &'static [&'static str] = &["rx", "ry", "rz", "x", "y", "z", "log_a", "log_b", "log_c"];

    fn lift<T: Scalar>(&self) -> DualQuadric<T> {
        DualQuadric { pose: self.pose.lift(), semi_axes: self.semi_axes.lift() }
    }
    fn seed(&self) -> DualQuadric<JetOf<U9>> {
        let semi_axes = Vector3::from_fn(|i, _| {
            let s = self.semi_axes[i];
            let mut gradient = [0.0; 9];
            gradient[6 + i] = s;
            Jet::with_gradient(s, &gradient)
        });
        DualQuadric { pose: self.pose.seed_in(9, 0), semi_axes }
    }
    fn retract(&self, delta: &SVector<f64, 9>) -> Self {
        let xi = Vector6::from_fn(|i, _| delta[i]);
        let semi_axes = Vector3::from_fn(|i, _| semi_axes::step(self.semi_axes[i], delta[6 + i]));
        Self { pose: self.pose.retract(&xi), semi_axes }
    }
    fn local(&self, other: &Self) -> SVector<f64, 9> {
        let xi = self.pose.local(&other.pose);
        let ratio = other.semi_axes.component_div(&self.semi_axes);
        SVector::from_fn(|i, _| if i < 6 { xi[i] } else { ratio[i - 6].ln() })
    }
    fn position(&self) -> Option<[f64; 3]> {
        Some(self.pose.translation.into())
    }
    fn moved(&self, motion: Motion) -> Option<SVector<f64, 9>> {
        // the tangent of a semi-axis is its logarithm
        let growth = f64::from(motion == Motion::Scale);
        Some(self.pose.moved(motion)?.fixed_resize::<9, 1>(growth))
    }
    fn is_finite(&self) -> bool {
        self.pose.is_finite() && self.semi_axes.iter().all(|s| s.is_finite())
    }
}
register_manifold!("dual_quadric", DualQuadric);

impl From<Coordinates<3>> for Centre {
    fn from(x: Coordinates<3>) -> Self {
        Self(x.vector())
    }
}
impl From<Centre> for [f64; 3] {
    fn from(x: Centre) -> [f64; 3] {
        x.0.into()
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
impl From<Document> for DualQuadric {
    fn from(d: Document) -> Self {
        Self { pose: Se3::new(d.rotation.0, d.translation.0), semi_axes: d.semi_axes.vector() }
    }
}
impl From<DualQuadric> for Document {
    fn from(q: DualQuadric) -> Self {
        Self {
            translation: Centre(q.pose.translation),
            rotation: Xyzw(q.pose.rotation),
            semi_axes: SemiAxes::unchecked(q.semi_axes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_quadric, quadric_tangent, tilted};
    use manifactor_testing::{check, manifold_laws, strategies::direction};

    manifold_laws! { retract_and_local_are_inverse: (any_quadric(), any_quadric(), quadric_tangent()) }

    #[test]
    fn a_step_however_long_leaves_semi_axes_that_can_be_used() {
        for (step, expected) in [(1000.0, 1e9), (-1000.0, 1e-9), (f64::INFINITY, 1e9), (0.0, 0.5)] {
            let delta = SVector::from_fn(|i, _| if i == 8 { step } else { 0.0 });
            let moved = tilted(0.3).retract(&delta);
            assert_eq!(moved.semi_axes, Vector3::new(0.1, 0.15, expected));
            assert!(moved.is_finite() && moved.matrix().iter().all(|x| x.is_finite()));
        }
        let nan = tilted(0.3).retract(&SVector::repeat(f64::NAN));
        assert!(!nan.is_finite());
    }

    #[test]
    fn a_flat_ellipsoid_has_one_axis_below_a_fiftieth_of_the_longest() {
        let with = |thin: f64| DualQuadric { semi_axes: Vector3::new(thin, 0.5, 1.0), ..tilted(0.3) };
        assert!(with(0.019).is_flat() && !with(0.021).is_flat());
    }

    #[test]
    fn planes_that_touch_are_on_the_dual_quadric() {
        check((any_quadric(), direction()), |(quadric, normal)| {
            // Support point of the normal: centroid + B Bᵀ n / |Bᵀ n|.
            let b = quadric.pose.rotation.inverse().act(&normal).component_mul(&quadric.semi_axes);
            let reach = quadric.centroid().dot(&normal) + b.norm();
            let plane = normal.push(-reach);
            let value = plane.dot(&(quadric.matrix() * plane));
            assert!(value.abs() < 1e-11 * (1.0 + reach * reach), "{value}");
            Ok(())
        });
    }

    #[test]
    fn the_box_around_it_holds_its_points_and_no_more() {
        check((any_quadric(), direction()), |(quadric, u)| {
            let b = quadric.axes_aligned_box();
            let point = quadric.pose.act(&u.component_mul(&quadric.semi_axes));
            assert!(
                (point - b.centroid()).abs() <= b.dimensions() / 2.0 * (1.0 + 1e-12) + Vector3::repeat(1e-12)
            );
            // Q* of the plane of each side is zero, so each side is touched.
            for i in 0..3 {
                let plane = Vector3::ith(i, 1.0).push(-b.max[i]);
                assert!(plane.dot(&(quadric.matrix() * plane)).abs() < 1e-10 * (1.0 + b.max[i].powi(2)));
            }
            Ok(())
        });
    }

    #[test]
    fn points_are_inside_up_to_the_surface() {
        check((any_quadric(), direction(), 0.0..2.0f64), |(quadric, u, r)| {
            let point = quadric.pose.act(&(u.component_mul(&quadric.semi_axes) * r));
            if (r - 1.0).abs() > 1e-6 {
                assert_eq!(quadric.contains(&point), r < 1.0);
            }
            Ok(())
        });
    }

    #[test]
    fn documents_are_checked_when_read() {
        let read = |text: &str| serde_json::from_str::<DualQuadric>(text).map_err(|e| e.to_string());
        let good = r#"{"translation":[1.0,0.0,0.5],"rotation":[0.0,0.0,0.6,0.8],"semi_axes":[0.1,0.2,0.3]}"#;
        assert_eq!(serde_json::to_string(&read(good).unwrap()).unwrap(), good);
        for (from, to, says) in [
            ("0.1,", "0.0,", "semi-axes from 1e-9"),
            ("0.1,", "-0.1,", "semi-axes from 1e-9"),
            ("0.8", "0.9", "unit quaternion"),
            ("1.0", "null", "null"),
            ("\"rot", "\"rt", "unknown field"),
            (",0.3", "", "3"),
        ] {
            let error = read(&good.replace(from, to)).unwrap_err();
            assert!(error.contains(says), "{error}");
        }
    }
}
