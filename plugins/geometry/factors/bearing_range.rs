//! Bearing and range from a planar pose to a point: r = (atan2(q) - β, ‖q‖ - d), q = Rᵀ(p - t).
//!
//! The bearing residual jumps if the point is opposite to the measured direction. A point within a nanometre
//! of the pose has no bearing, so the factor is not defined there.
use crate::factors::range::NEAREST;
use crate::groups::{Angle, atan2};
use crate::{Point2, Se2, So2, wrap};
use manifactor_graph::prelude::*;

/// A pose in the plane measures a point at the distance `range` in the direction `bearing`: r = (atan2(q) -
/// β, ‖q‖ - d), q = Rᵀ(p - t).
///
/// Two rows: the bearing residual in radians, wrapped to -π..π, and the range residual in metres. The bearing
/// residual jumps if the point is opposite to the measured direction. Not defined within a nanometre of the
/// pose, as there is no bearing; the factor is inactive there.
///
/// ```toml
/// [[factors]]
/// keys = ["x0", "l0"]
/// factor = { type = "bearing_range_se2", bearing = 0.5, range = 1.5 }
/// noise = { sigmas = [0.02, 0.1] }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BearingRange2 {
    bearing: Angle,
    /// A finite number above zero.
    range: Positive,
}

impl BearingRange2 {
    /// Creates the factor from the measured bearing, in radians counter-clockwise from the pose's x axis, and
    /// the distance in metres.
    pub fn new(bearing: So2, range: Positive) -> Self {
        Self { bearing: Angle(bearing), range }
    }
    /// Returns the measured position of the point in the frame of the pose.
    pub fn measured(&self) -> Vector2<f64> {
        self.bearing.0.act(&Vector2::new(self.range.get(), 0.0))
    }
}

impl Residual for BearingRange2 {
    type Variables = (Se2, Point2);
    type Dim = U2;
    const ROWS: &'static [&'static str] = &["bearing", "range"];

    fn residual<T: Scalar>(&self, (x, p): Lifted<Self::Variables, T>) -> Vector2<T> {
        let seen = x.inverse_act(&p);
        let bearing = atan2(seen.y, seen.x) - self.bearing.0.angle();
        Vector2::new(wrap(bearing), seen.norm_squared().sqrt() - self.range.get())
    }
    fn is_defined(&self, (x, p): Refs<'_, Self::Variables>) -> bool {
        (**p - x.translation).norm() >= NEAREST
    }
}
register_factor!("bearing_range_se2", BearingRange2);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_point2, any_se2, any_so2};
    use manifactor_testing::{JacobianLaw, check, invariance_law};
    use proptest::prelude::*;
    use std::f64::consts::PI;

    fn any_measurement() -> impl Strategy<Value = BearingRange2> {
        (any_so2(), 0.01..10.0).prop_map(|(b, r)| BearingRange2::new(b, Positive::literal(r)))
    }

    #[test]
    fn jacobians_agree() {
        check((any_measurement(), any_se2(), any_point2()), |(factor, x, p)| {
            let distance = (*p - x.translation).norm();
            let law = JacobianLaw { step: 1e-2 * distance.min(1.0), ..JacobianLaw::default() };
            // Close to distance zero and far from the origin, the finite differences have no accurate digits
            // left.
            if (NEAREST..1e-3).contains(&distance) { Ok(()) } else { law.check(&factor, &[&x, &p]) }
        });
    }

    #[test]
    fn jacobians_agree_next_to_distance_zero_and_next_to_the_jump() {
        let distance = prop_oneof![Just(2e-9), Just(1e-6), 1e-5..1e-3];
        let off = prop_oneof![Just(PI - 1e-4), Just(1e-4 - PI), Just(0.0), -3.0..3.0];
        check((any_measurement(), off, distance), |(factor, off, distance)| {
            let bearing = factor.bearing.0.angle() + off;
            let p = Point2::new([distance * bearing.cos(), distance * bearing.sin()]);
            let law = JacobianLaw { step: distance * 1e-2, ..JacobianLaw::default() };
            law.check(&factor, &[&Se2::identity(), &p])
        });
    }

    #[test]
    fn moving_pose_and_point_together_changes_nothing() {
        check((any_measurement(), any_se2(), any_point2(), any_se2()), |(factor, x, p, m)| {
            let away_from_the_jump = factor.residual::<f64>((x, *p)).x.abs() < 3.1;
            let moved = [m.compose(&x), x];
            let point = Point2::new(m.act(&p));
            if (*p - x.translation).norm() < 1e-3 || !away_from_the_jump {
                return Ok(());
            }
            invariance_law(&factor, &[&x, &p], &[&moved[0], &point])
        });
    }

    #[test]
    fn jacobians_agree_on_the_axes_of_the_pose() {
        for p in [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]] {
            let factor = BearingRange2::new(So2::exp(0.3), Positive::literal(1.0));
            JacobianLaw::default().check(&factor, &[&Se2::identity(), &Point2::new(p)]).unwrap();
        }
    }

    #[test]
    fn a_point_to_the_left_has_a_bearing_of_a_quarter_turn() {
        let factor = BearingRange2::new(So2::exp(0.5), Positive::literal(1.0));
        let r = factor.residual::<f64>((Se2::identity(), Vector2::new(0.0, 2.0)));
        assert!((r - Vector2::new(PI / 2.0 - 0.5, 1.0)).norm() < 1e-15);
        assert!(!factor.is_defined((&Se2::identity(), &Point2::new([0.0, 0.0]))));
    }
}
