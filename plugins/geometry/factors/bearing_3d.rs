//! Direction from a pose in space to a point.
use super::bearing_range_3d::{arc, has_arc};
use crate::{Point3, Se3};
use manifactor_graph::prelude::*;

/// A pose in space measures a point in the direction `direction`, at an unknown distance.
///
/// Two rows: the arc from the measured direction to the direction of the point, in radians along two axes perpendicular
/// to the measured direction. The axes are those of `bearing_range_se3`; with an equal σ they do not matter. It suits cameras
/// of any field of view, as it has no image. Not defined within a nanometre of the pose, and within 1e-6 radians of the
/// opposite direction, as the arc has no direction there.
///
/// ```toml
/// [[factors]]
/// keys = ["x0", "l0"]
/// factor = { type = "bearing_se3", direction = [1.0, 0.0, 0.2] }
/// noise = { sigma = 0.002 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bearing3 {
    /// Measured direction in the frame of the pose, of any length but zero.
    pub direction: Direction,
}

impl Residual for Bearing3 {
    type Variables = (Se3, Point3);
    type Dim = U2;

    fn residual<T: Scalar>(&self, (x, p): Lifted<Self::Variables, T>) -> Vector2<T> {
        let seen = x.inverse_act(&p);
        arc(&self.direction, &seen, seen.norm_squared().sqrt())
    }
    fn is_defined(&self, (x, p): Refs<'_, Self::Variables>) -> bool {
        has_arc(&self.direction, &x.inverse_act(p))
    }
}
register_factor!("bearing_se3", Bearing3);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_point3, any_se3};
    use manifactor_testing::strategies::{direction, rotation_vector};
    use manifactor_testing::{check, invariance_law, jacobian_laws};
    use proptest::prelude::*;

    fn any_measurement() -> impl Strategy<Value = Bearing3> {
        direction().prop_map(|z| Bearing3 { direction: Direction::new(z.into_inner()).unwrap() })
    }

    // The point is drawn by its arc from the measured direction: zero, tiny, any, nearly opposite.
    jacobian_laws! {
        jacobians_agree: (any_measurement(), any_se3(), rotation_vector(), 0.1..10.0).prop_map(|(factor, x, arc, distance)| {
            let seen = crate::So3::exp(&arc).act(&factor.direction) * distance;
            (factor, x, Point3::new(x.act(&seen)))
        })
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
    fn the_distance_does_not_matter() {
        let factor = Bearing3 { direction: Direction::new(Vector3::new(1.0, 0.0, 1.0)).unwrap() };
        let at =
            |distance: f64| factor.residual::<f64>((Se3::identity(), Vector3::new(0.0, 1.0, 1.0) * distance));
        assert!((at(0.1) - at(1e6)).norm() < 1e-12);
        assert!((at(1.0).norm() - std::f64::consts::FRAC_PI_3).abs() < 1e-12);
    }
}
