//! Planes as variables.
use crate::S2;
use manifactor_graph::prelude::*;

/// A plane in Hessian normal form, S² × R: the points x with n · x = offset.
///
/// Tangent (a, b, offset): the normal n steps like an `s2`, the offset is additive. n points to the side on
/// which objects stand; (n, offset) and (-n, -offset) contain the same points, with opposite sides.
///
/// ```toml
/// [values]
/// table = { type = "plane", normal = [0.0, 0.0, 1.0], offset = 0.7 }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// Normal, pointing to the side on which objects stand; of any length but zero.
    pub normal: Direction,
    /// Distance from the origin along the normal, in metres.
    pub offset: f64,
}

/// A plane over a generic scalar.
#[derive(Debug, Clone, Copy)]
pub struct PlaneOf<T: Scalar> {
    /// Unit normal.
    pub normal: Vector3<T>,
    /// Distance from the origin along the normal.
    pub offset: T,
}

impl<T: Scalar> PlaneOf<T> {
    /// Returns the height of a point above the plane; negative below it.
    pub fn height(&self, point: &Vector3<T>) -> T {
        self.normal.dot(point) - self.offset
    }
}

impl Manifold for Plane {
    type Dim = U3;
    type Of<T: Scalar> = PlaneOf<T>;
    const TANGENT: &'static [&'static str] = &["a", "b", "offset"];

    fn lift<T: Scalar>(&self) -> PlaneOf<T> {
        PlaneOf { normal: self.normal.map(T::from), offset: T::from(self.offset) }
    }
    fn seed(&self) -> PlaneOf<JetOf<U3>> {
        let basis = S2::new(self.normal).basis();
        let normal =
            Vector3::from_fn(|i, _| Jet::with_gradient(self.normal[i], &[basis[(i, 0)], basis[(i, 1)], 0.0]));
        PlaneOf { normal, offset: Jet::with_gradient(self.offset, &[0.0, 0.0, 1.0]) }
    }
    fn retract(&self, delta: &Vector3<f64>) -> Self {
        let normal = S2::new(self.normal).retract(&Vector2::new(delta.x, delta.y)).direction;
        Self { normal, offset: self.offset + delta.z }
    }
    fn local(&self, other: &Self) -> Vector3<f64> {
        S2::new(self.normal).local(&S2::new(other.normal)).push(other.offset - self.offset)
    }
    fn is_finite(&self) -> bool {
        self.offset.is_finite() && self.normal.iter().all(|x| x.is_finite())
    }
}
register_manifold!("plane", Plane);

/// A prior on a plane: r = (n - n₀, offset - offset₀), in radians and metres.
///
/// Four rows: the difference of the unit normals, of length 2 sin(θ/2) for an angle θ, and the difference of
/// the offsets. A plane with the opposite normal is a different plane: the cost has its maximum there, and
/// its derivative vanishes. Smooth and defined everywhere.
///
/// ```toml
/// [[factors]]
/// keys   = ["table"]
/// factor = { type = "prior_plane", value = { normal = [0.0, 0.0, 1.0], offset = 0.7 } }
/// noise  = { sigmas = [0.02, 0.02, 0.02, 0.1] }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlanePrior {
    /// Expected plane.
    pub value: Plane,
}

impl Residual for PlanePrior {
    type Variables = (Plane,);
    type Dim = nalgebra::U4;

    fn residual<T: Scalar>(&self, (plane,): Lifted<Self::Variables, T>) -> nalgebra::Vector4<T> {
        let expected = self.value.lift::<T>();
        (plane.normal - expected.normal).push(plane.offset - expected.offset)
    }
}
register_factor!("prior_plane", PlanePrior);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::any_plane;
    use manifactor_testing::strategies::vector;
    use manifactor_testing::{factor_laws, manifold_laws};

    manifold_laws! { retract_and_local_are_inverse: (any_plane(), any_plane(), vector::<3>(1.8)) }
    factor_laws! { prior_plane }

    #[test]
    fn points_of_the_plane_are_at_no_height() {
        let table = Plane { normal: Direction::new(Vector3::new(0.0, 3.0, 4.0)).unwrap(), offset: 2.0 };
        let plane = table.lift::<f64>();
        assert!(plane.height(&Vector3::new(7.0, 1.2, 1.6)).abs() < 1e-12);
        assert!((plane.height(&Vector3::new(0.0, 1.8, 2.4)) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_plane_turned_over_costs_the_most() {
        let prior = |normal: Vector3<f64>, offset| {
            let value = Plane { normal: Direction::new(Vector3::z()).unwrap(), offset: 0.7 };
            let plane = Plane { normal: Direction::new(normal).unwrap(), offset };
            PlanePrior { value }.residual::<f64>((plane.lift(),)).norm()
        };
        assert_eq!(prior(Vector3::z(), 0.7), 0.0);
        // The plane through the same points, seen from below.
        assert!((prior(-Vector3::z(), -0.7) - 2.0_f64.hypot(1.4)).abs() < 1e-12);
        assert!((prior(-Vector3::z(), 0.7) - 2.0).abs() < 1e-12);
        assert!((prior(Vector3::x(), 0.7) - 2.0_f64.sqrt()).abs() < 1e-12);
    }
}
