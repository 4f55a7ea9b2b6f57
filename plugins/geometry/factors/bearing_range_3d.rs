//! Direction and range from a pose in space to a point.
//!
//! With u = q/‖q‖, q = Rᵀ(p - t), and b₁, b₂ perpendicular to the measured direction z, the error of
//! direction is the arc from z to u: (b₁·u, b₂·u) θ/sin θ, θ the angle between z and u.
use crate::factors::range::NEAREST;
use crate::groups::atan2;
use crate::{Point3, Se3};
use manifactor_graph::prelude::*;

/// A pose in space measures a point at the distance `range` in the direction `direction`.
///
/// Three rows: the arc from the measured direction to the direction of the point, in radians along two axes
/// perpendicular to the measured direction, and the range residual in metres. If both rows of the arc have an
/// equal σ, the choice of the axes does not matter. The first axis is as close as possible to the
/// coordinate axis of the pose that is farthest from the measured direction. Not defined within a nanometre of the pose, and
/// within 1e-6 radians of the opposite direction, as the arc has no direction there.
///
/// ```toml
/// [[factors]]
/// keys = ["x0", "l0"]
/// factor = { type = "bearing_range_se3", direction = [1.0, 0.0, 0.2], range = 1.5 }
/// noise = { sigmas = [0.02, 0.02, 0.1] }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BearingRange3 {
    /// Measured direction in the frame of the pose, of any length but zero.
    pub direction: Direction,
    /// Measured distance, in metres.
    pub range: Positive,
}

impl BearingRange3 {
    /// Returns the measured position of the point in the frame of the pose.
    pub fn measured(&self) -> Vector3<f64> {
        *self.direction * self.range.get()
    }
}

/// Returns two axes perpendicular to a direction and to each other.
fn basis(z: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let first = z.cross(&Vector3::ith(z.iamin(), 1.0)).cross(z).normalize();
    [first, z.cross(&first)]
}

/// Returns the arc from a unit vector `z` to the direction of a vector of length `distance`, in radians along the two axes
/// perpendicular to `z`.
pub(super) fn arc<T: Scalar>(z: &Vector3<f64>, vector: &Vector3<T>, distance: T) -> Vector2<T> {
    let [a, b] = basis(z).map(|axis| axis.lift::<T>().dot(vector) / distance);
    let cos = z.lift::<T>().dot(vector) / distance;
    let sin2 = a * a + b * b;
    // θ/sin θ. At zero, where the sine has no derivative, its series.
    let scale = if sin2 < T::from(1e-8) && cos > T::zero() {
        T::one() + sin2 / 6.0 + sin2 * sin2 * 0.075
    } else {
        let sin = sin2.sqrt();
        atan2(sin, cos) / sin
    };
    Vector2::new(a * scale, b * scale)
}

/// Returns whether there is an arc from a unit vector to a vector: not to zero, and not to the opposite direction.
pub(super) fn has_arc(z: &Vector3<f64>, vector: &Vector3<f64>) -> bool {
    let distance = vector.norm();
    let opposite = vector.dot(z) < 0.0 && vector.cross(z).norm() < 1e-6 * distance;
    distance >= NEAREST && !opposite
}

impl Residual for BearingRange3 {
    type Variables = (Se3, Point3);
    type Dim = U3;

    fn residual<T: Scalar>(&self, (x, p): Lifted<Self::Variables, T>) -> Vector3<T> {
        let seen = x.inverse_act(&p);
        let distance = seen.norm_squared().sqrt();
        let arc = arc(&self.direction, &seen, distance);
        Vector3::new(arc.x, arc.y, distance - self.range.get())
    }
    fn is_defined(&self, (x, p): Refs<'_, Self::Variables>) -> bool {
        has_arc(&self.direction, &x.inverse_act(p))
    }
}
register_factor!("bearing_range_se3", BearingRange3);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_point3, any_se3};
    use manifactor_testing::strategies::{direction, rotation_vector};
    use manifactor_testing::{JacobianLaw, check, invariance_law, jacobian_laws};
    use proptest::prelude::*;

    fn any_measurement() -> impl Strategy<Value = BearingRange3> {
        (direction(), 0.01..10.0).prop_map(|(z, range)| measured(z.into_inner(), range))
    }
    fn measured(z: Vector3<f64>, range: f64) -> BearingRange3 {
        BearingRange3 { direction: Direction::new(z).unwrap(), range: Positive::literal(range) }
    }

    // The point is drawn by its arc from the measured direction: zero, tiny, any, nearly opposite.
    jacobian_laws! {
        jacobians_agree: (any_measurement(), any_se3(), rotation_vector()).prop_map(|(factor, x, arc)| {
            let seen = crate::So3::exp(&arc).act(&factor.direction) * factor.range.get();
            (factor, x, Point3::new(x.act(&seen)))
        })
    }

    #[test]
    fn jacobians_agree_next_to_distance_zero() {
        check(
            (any_measurement(), direction(), prop_oneof![Just(2e-9), 1e-6..1e-3]),
            |(factor, u, distance)| {
                let law = JacobianLaw { step: 1e-2 * distance, ..JacobianLaw::default() };
                law.check(&factor, &[&Se3::identity(), &Point3::new(u.into_inner() * distance)])
            },
        );
    }

    #[test]
    fn moving_pose_and_point_together_changes_nothing() {
        check((any_measurement(), any_se3(), any_point3(), any_se3()), |(factor, x, p, m)| {
            let near = (*p - x.translation).norm() < 1e-3;
            let moved = Point3::new(m.act(&p));
            if near { Ok(()) } else { invariance_law(&factor, &[&x, &p], &[&m.compose(&x), &moved]) }
        });
    }

    #[test]
    fn the_arc_is_as_long_as_the_angle() {
        let r = measured(Vector3::z(), 1.0).residual::<f64>((Se3::identity(), Vector3::new(2.0, 0.0, 0.0)));
        assert!((r.xy().norm() - std::f64::consts::FRAC_PI_2).abs() < 1e-15 && r.z == 1.0);
    }

    #[test]
    fn the_opposite_direction_and_distance_zero_are_not_defined() {
        let factor = measured(Vector3::z(), 1.0);
        let defined = |p: [f64; 3]| factor.is_defined((&Se3::identity(), &Point3::new(p)));
        assert!(!defined([0.0, 0.0, -3.0]) && !defined([0.0; 3]));
        assert!(defined([0.0, 0.0, 3.0]) && defined([1e-5, 0.0, -3.0]));
    }
}
