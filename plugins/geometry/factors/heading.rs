//! Heading of a pose, as a compass or a satellite receiver with two antennas measures it.
use crate::groups::{Angle, atan2};
use crate::{Se3, So2};
use manifactor_graph::prelude::*;

/// Smallest horizontal length of the axis of a pose, of which the length is one, that has a heading.
const SMALLEST_HORIZONTAL: f64 = 1e-6;

/// An axis of the pose has the heading h: the angle about `up` from the direction `zero` to the axis a = R `axis`, both projected
/// to the horizontal plane.
///
/// One row, atan2(up · (zero × a), zero · a) - h in radians, counter-clockwise seen from above and wrapped to
/// -π..π, where it jumps. With the defaults it is the yaw of a robot. If x of the map points to the east, a compass, clockwise
/// from the north, measures π/2 - h. Invariant to moving the pose, and to raising or lowering the axis. Not defined if the
/// axis or `zero` is vertical within 1e-6 radians.
///
/// ```toml
/// [[factors]]
/// keys = ["x0"]
/// factor = { type = "heading_se3", heading = 1.2 }
/// noise = { sigma = 0.05 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Heading {
    /// Measured heading h, counter-clockwise. Unit: radians.
    heading: Angle,
    /// Axis of the pose, in its own frame. Default: x, which is forward on a robot; a camera looks along z.
    #[serde(default = "x")]
    pub axis: Direction,
    /// World direction with heading zero. Default: x.
    #[serde(default = "x")]
    pub zero: Direction,
    /// The world's up direction. Default: z.
    #[serde(default)]
    pub up: Up,
}

fn x() -> Direction {
    Direction::X
}

impl Heading {
    /// Creates the factor for the x axis of the pose, from the heading in radians counter-clockwise from the
    /// world's x axis, with z up.
    pub fn new(heading: So2) -> Self {
        Self { heading: Angle(heading), axis: Direction::X, zero: Direction::X, up: Up::default() }
    }

    /// Returns the horizontal coordinates of a direction: along `zero`, and to the left of it. Their length is at most one.
    fn horizontal<T: Scalar>(&self, direction: &Vector3<T>) -> Vector2<T> {
        let left = self.up.cross(&self.zero);
        // `zero` need not be horizontal
        let forward = left.cross(&self.up);
        Vector2::new(forward.lift::<T>().dot(direction), left.lift::<T>().dot(direction))
    }
}

impl Residual for Heading {
    type Variables = (Se3,);
    type Dim = U1;
    const ROWS: &'static [&'static str] = &["heading"];

    fn residual<T: Scalar>(&self, (pose,): Lifted<Self::Variables, T>) -> Vector1<T> {
        let axis = self.horizontal(&pose.rotation.act(&self.axis.lift()));
        let (sin, cos) = self.heading.0.angle().sin_cos();
        Vector1::new(atan2(axis.y * cos - axis.x * sin, axis.x * cos + axis.y * sin))
    }
    fn is_defined(&self, (pose,): Refs<'_, Self::Variables>) -> bool {
        self.horizontal(&pose.rotation.act(&self.axis)).norm() >= SMALLEST_HORIZONTAL
    }
}
register_factor!("heading_se3", Heading, up);
register_invariance!(Heading, "moving the pose, and turning it about its axis", |factor, (pose,), random| {
    let turn = crate::So3::exp(&(*factor.axis * random(3.0)));
    let translation = Vector3::new(random(5.0), random(5.0), random(5.0));
    (Se3::new(pose.rotation.compose(&turn), translation),)
});

#[cfg(test)]
mod tests {
    use super::*;
    use crate::So3;
    use manifactor_testing::factor_laws;
    use std::f64::consts::FRAC_PI_2;

    factor_laws! { heading_se3 }

    fn turned(yaw: f64) -> Se3 {
        Se3::new(So3::exp(&(Vector3::z() * yaw)), Vector3::new(1.0, 2.0, 3.0))
    }

    #[test]
    fn the_residual_is_the_error_of_the_yaw() {
        let residual =
            |heading: f64, yaw: f64| Heading::new(So2::exp(heading)).residual::<f64>((turned(yaw),)).x;
        assert!((residual(1.0, 1.3) - 0.3).abs() < 1e-12);
        assert!((residual(3.1, -3.1) - (std::f64::consts::TAU - 6.2)).abs() < 1e-12, "across the jump");
        let mut pitched = turned(1.3);
        pitched.rotation = pitched.rotation.compose(&So3::exp(&(Vector3::y() * 0.7)));
        let r = Heading::new(So2::exp(1.0)).residual::<f64>((pitched,)).x;
        assert!((r - 0.3).abs() < 1e-12, "tilting the axis changes nothing: {r}");
    }

    #[test]
    fn a_camera_in_a_map_with_y_down_has_a_heading() {
        let mut factor = Heading::new(So2::exp(FRAC_PI_2));
        factor.axis = Direction::Z;
        factor.zero = Direction::new(Vector3::z()).unwrap();
        factor.up = Direction::new(-Vector3::y()).unwrap().into();
        // seen from above, a quarter to the left of z is -x
        let left = Se3::new(So3::exp(&(Vector3::y() * -FRAC_PI_2)), Vector3::zeros());
        assert!((left.rotation.act(&Vector3::z()) + Vector3::x()).norm() < 1e-12);
        assert!(factor.residual::<f64>((left,)).x.abs() < 1e-12);
    }

    #[test]
    fn a_vertical_axis_has_no_heading() {
        let factor = Heading::new(So2::exp(0.0));
        let up = Se3::new(So3::exp(&(Vector3::y() * -FRAC_PI_2)), Vector3::zeros());
        assert!(!factor.is_defined((&up,)) && factor.is_defined((&turned(1.0),)));
    }
}
