//! An object stands upright.
use crate::DualQuadric;
use crate::shapes::turned;
use manifactor_graph::{Direction, Lift, Lifted, Residual, Scalar, register_factor, register_invariance};
use nalgebra::{U1, U3, Vector1, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The major semi-axis m of an object is vertical: r = 1 - |m · up|   (Jablonsky et al., eq. 7).
///
/// Turning about `up`, moving, growing and turning upside down leave it unchanged. Its derivative
/// vanishes where m is vertical, so the last digits come slowly there;
/// `vertical_orientation_smooth` has no such place. Where m is exactly horizontal, |·| has a kink;
/// the derivative is that of m · up > 0. m is the longest semi-axis at the current estimate, the first
/// of equals: where another becomes the longest, the residual jumps to the angle of that axis, and a
/// nearly round object is pulled by whichever axis leads. It is defined everywhere.
///
/// ```toml
/// [[factors]]
/// keys   = ["q0"]
/// factor = { type = "vertical_orientation", up = [0.0, 0.0, 1.0] }
/// noise  = { sigma = 0.1 }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VerticalOrientation {
    /// The world's up, of any length but zero; z, where nothing is said.
    #[serde(default)]
    pub up: Direction,
}

impl Residual for VerticalOrientation {
    type Variables = (DualQuadric,);
    type Dim = U1;

    fn residual<T: Scalar>(&self, (quadric,): Lifted<Self::Variables, T>) -> Vector1<T> {
        let c = quadric.major_axis().dot(&self.up.lift());
        Vector1::new(T::one() - if c < T::zero() { -c } else { c })
    }
}
register_factor!("vertical_orientation", VerticalOrientation);
register_invariance!(
    VerticalOrientation,
    "turning about up, moving and growing",
    |factor, (quadric,), random| { (turned(quadric, &factor.up, random),) }
);

/// The major semi-axis m of an object is vertical: r = m × up, of length sin(tilt).
///
/// The components of m perpendicular to `up`, turned by a quarter about it: `vertical_orientation`
/// without its kink and without its flat place, so that Gauss-Newton converges at its usual speed.
/// σ is in radians of tilt, near the vertical. The jump between axes of equal length is the same.
/// A horizontal m is a maximum, where the derivative of the cost vanishes.
///
/// ```toml
/// [[factors]]
/// keys   = ["q0"]
/// factor = { type = "vertical_orientation_smooth" }
/// noise  = { sigma = 0.1 }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VerticalOrientationSmooth {
    /// The world's up, of any length but zero; z, where nothing is said.
    #[serde(default)]
    pub up: Direction,
}

impl Residual for VerticalOrientationSmooth {
    type Variables = (DualQuadric,);
    type Dim = U3;

    fn residual<T: Scalar>(&self, (quadric,): Lifted<Self::Variables, T>) -> Vector3<T> {
        quadric.major_axis().cross(&self.up.lift())
    }
}
register_factor!("vertical_orientation_smooth", VerticalOrientationSmooth);
register_invariance!(
    VerticalOrientationSmooth,
    "moving, growing and turning about the axis",
    |_, (quadric,), random| { (turned(quadric, &quadric.major_axis(), random),) }
);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_quadric, tilted, unequal_quadric};
    use manifactor_geometry::{Se3, So3};
    use manifactor_graph::{Factor, Manifold};
    use manifactor_testing::{check, invariance_law, jacobian_laws, strategies::direction};
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    fn up() -> impl Strategy<Value = Direction> {
        direction().prop_map(|v| Direction::new(v.into_inner()).unwrap())
    }
    /// Off the kink of |m · up|.
    fn leaning() -> impl Strategy<Value = (Direction, DualQuadric)> {
        (up(), unequal_quadric()).prop_filter("at the kink", |(up, q)| q.major_axis().dot(up).abs() > 1e-4)
    }
    /// Tilts of 0 and of next to nothing, of any size, of nearly a right angle.
    fn any_tilt() -> impl Strategy<Value = f64> {
        prop_oneof![Just(0.0), 1e-9..1e-6, 0.0..1.5f64, Just(FRAC_PI_2 - 1e-4), Just(3.0)]
    }

    jacobian_laws! {
        the_paper_s_jacobian_is_right: leaning().prop_map(|(up, q)| (VerticalOrientation { up }, q));
        the_smooth_jacobian_is_right: (up(), unequal_quadric())
            .prop_map(|(up, q)| (VerticalOrientationSmooth { up }, q));
        the_paper_s_jacobian_is_right_at_any_tilt:
            any_tilt().prop_map(|tilt| (VerticalOrientation::default(), tilted(tilt)));
        the_smooth_jacobian_is_right_at_any_tilt:
            any_tilt().prop_map(|tilt| (VerticalOrientationSmooth::default(), tilted(tilt)));
    }

    #[test]
    fn yaw_position_and_size_are_free() {
        let moves = (any_quadric(), -3.0..3.0, -5.0..5.0, 0.1..10.0);
        check(moves, |(quadric, yaw, x, size)| {
            let turn = Se3::new(So3::exp(&Vector3::new(0.0, 0.0, yaw)), Vector3::new(x, 1.0, -x));
            let moved =
                DualQuadric { pose: turn.compose(&quadric.pose), semi_axes: quadric.semi_axes * size };
            invariance_law(&VerticalOrientation::default(), &[&quadric], &[&moved])
        });
    }

    #[test]
    fn the_error_of_a_tilt_is_known() {
        for tilt in [0.0f64, 1e-8, 0.3, FRAC_PI_2, 2.0] {
            let quadric = tilted(tilt);
            let paper = VerticalOrientation::default().residual::<f64>((quadric,));
            assert!((paper[0] - (1.0 - tilt.cos().abs())).abs() < 1e-12);
            let smooth = VerticalOrientationSmooth::default().residual::<f64>((quadric,));
            assert!((smooth.norm() - tilt.sin()).abs() < 1e-12);
        }
    }

    #[test]
    fn equal_semi_axes_take_the_first_and_stay_finite() {
        let round = DualQuadric { semi_axes: Vector3::repeat(0.2), ..tilted(0.4) };
        assert_eq!(round.major_axis(), round.pose.rotation.act(&Vector3::x()));
        for factor in [&VerticalOrientation::default() as &dyn Factor, &VerticalOrientationSmooth::default()]
        {
            assert_eq!(factor.erased().is_defined(&[&round]), Some(true));
            let l = factor.erased().linearize(&[&round]).unwrap();
            assert!(l.residual.iter().chain(l.jacobians[0].iter()).all(|x| x.is_finite()));
            // the others lead as soon as they are longer: a jump, and nothing worse
            let step = nalgebra::SVector::<f64, 9>::from_fn(|i, _| if i == 8 { 1e-9 } else { 0.0 });
            let other = factor.erased().residual(&[&round.retract(&step)]).unwrap();
            assert!(other.iter().all(|x| x.is_finite()));
        }
    }

    #[test]
    fn up_is_checked_and_may_be_left_out() {
        let read = |text: &str| serde_json::from_str::<VerticalOrientation>(text);
        assert_eq!(read("{}").unwrap(), VerticalOrientation::default());
        assert_eq!(read(r#"{"up": [0, 0, 9.8]}"#).unwrap(), VerticalOrientation::default());
        assert!(read(r#"{"up": [0, 0, 0]}"#).is_err() && read(r#"{"upp": [0, 0, 1]}"#).is_err());
    }
}
