//! An object lies flat.
use crate::DualQuadric;
use crate::shapes::turned;
use manifactor_graph::{Direction, Lift, Lifted, Residual, Scalar, register_factor, register_invariance};
use nalgebra::{U1, Vector1};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The major semi-axis m of an object is horizontal: r = 0 - |m · up|   (Jablonsky et al., eq. 7).
///
/// Turning about `up`, about m, moving and growing leave it unchanged. Where m is exactly horizontal,
/// |·| has a kink, its square has none: the derivative taken there is that of m · up > 0, and it is
/// not zero. Where m is vertical, the derivative vanishes. m is the longest semi-axis at the current
/// estimate, the first of equals: where another becomes the longest, the residual jumps. It is defined
/// everywhere.
///
/// ```toml
/// [[factors]]
/// keys   = ["q0"]
/// factor = { type = "horizontal_orientation", up = [0.0, 0.0, 1.0] }
/// noise  = { sigma = 0.1 }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HorizontalOrientation {
    /// The world's up, of any length but zero; z, where nothing is said.
    #[serde(default)]
    pub up: Direction,
}

impl Residual for HorizontalOrientation {
    type Variables = (DualQuadric,);
    type Dim = U1;

    fn residual<T: Scalar>(&self, (quadric,): Lifted<Self::Variables, T>) -> Vector1<T> {
        let c = quadric.major_axis().dot(&self.up.lift());
        Vector1::new(if c < T::zero() { c } else { -c })
    }
}
register_factor!("horizontal_orientation", HorizontalOrientation);
register_invariance!(
    HorizontalOrientation,
    "turning about up, moving and growing",
    |factor, (quadric,), random| { (turned(quadric, &factor.up, random),) }
);

/// The major semi-axis m of an object is horizontal: r = m · up, the sine of its elevation.
///
/// `horizontal_orientation` without the absolute value: its square is the same, the sign of m does not
/// matter, and the residual has no kink. σ is in radians, near the horizontal. The jump between axes of
/// equal length is the same.
///
/// ```toml
/// [[factors]]
/// keys   = ["q0"]
/// factor = { type = "horizontal_orientation_smooth" }
/// noise  = { sigma = 0.1 }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HorizontalOrientationSmooth {
    /// The world's up, of any length but zero; z, where nothing is said.
    #[serde(default)]
    pub up: Direction,
}

impl Residual for HorizontalOrientationSmooth {
    type Variables = (DualQuadric,);
    type Dim = U1;

    fn residual<T: Scalar>(&self, (quadric,): Lifted<Self::Variables, T>) -> Vector1<T> {
        Vector1::new(quadric.major_axis().dot(&self.up.lift()))
    }
}
register_factor!("horizontal_orientation_smooth", HorizontalOrientationSmooth);
register_invariance!(
    HorizontalOrientationSmooth,
    "turning about up, moving and growing",
    |factor, (quadric,), random| { (turned(quadric, &factor.up, random),) }
);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_quadric, tilted, unequal_quadric};
    use manifactor_geometry::{Se3, So3};
    use manifactor_graph::Factor;
    use manifactor_testing::{check, invariance_law, jacobian_laws, strategies::direction};
    use nalgebra::Vector3;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    fn up() -> impl Strategy<Value = Direction> {
        direction().prop_map(|v| Direction::new(v.into_inner()).unwrap())
    }
    /// Off the kink of |m · up|.
    fn leaning() -> impl Strategy<Value = (Direction, DualQuadric)> {
        (up(), unequal_quadric()).prop_filter("at the kink", |(up, q)| q.major_axis().dot(up).abs() > 1e-4)
    }
    fn any_tilt() -> impl Strategy<Value = f64> {
        prop_oneof![Just(0.0), 1e-9..1e-6, 0.0..1.5f64, Just(FRAC_PI_2 - 1e-3), Just(FRAC_PI_2 + 1e-3)]
    }

    jacobian_laws! {
        the_paper_s_jacobian_is_right: leaning().prop_map(|(up, q)| (HorizontalOrientation { up }, q));
        the_smooth_jacobian_is_right: (up(), unequal_quadric())
            .prop_map(|(up, q)| (HorizontalOrientationSmooth { up }, q));
        the_smooth_jacobian_is_right_at_any_tilt:
            any_tilt().prop_map(|tilt| (HorizontalOrientationSmooth::default(), tilted(tilt)));
    }

    #[test]
    fn both_forms_have_the_same_square() {
        check((up(), any_quadric()), |(up, quadric)| {
            let paper = HorizontalOrientation { up }.residual::<f64>((quadric,))[0];
            let smooth = HorizontalOrientationSmooth { up }.residual::<f64>((quadric,))[0];
            assert!(paper <= 0.0 && (paper.abs() - smooth.abs()).abs() < 1e-15);
            Ok(())
        });
    }

    #[test]
    fn yaw_and_roll_about_the_long_axis_are_free() {
        check((any_quadric(), -3.0..3.0, -3.0..3.0), |(quadric, yaw, roll)| {
            let about = |axis: Vector3<f64>, angle: f64| So3::exp(&(axis * angle));
            let turn = about(Vector3::z(), yaw).compose(&about(quadric.major_axis(), roll));
            let rotation = turn.compose(&quadric.pose.rotation);
            let moved = DualQuadric { pose: Se3::new(rotation, Vector3::x()), ..quadric };
            invariance_law(&HorizontalOrientationSmooth::default(), &[&quadric], &[&moved])
        });
    }

    #[test]
    fn the_kink_has_the_derivative_of_one_side() {
        let flat = DualQuadric { pose: Se3::identity(), semi_axes: Vector3::new(0.3, 0.2, 0.1) };
        let kink = Factor::erased(&HorizontalOrientation::default()).linearize(&[&flat]).unwrap();
        assert_eq!(kink.residual[0], 0.0);
        let smooth = Factor::erased(&HorizontalOrientationSmooth::default()).linearize(&[&flat]).unwrap();
        // the x axis rises as the object turns about -y
        assert_eq!(smooth.jacobians[0][(0, 1)], -1.0);
        assert_eq!(kink.jacobians[0], -&smooth.jacobians[0]);
    }

    #[test]
    fn equal_semi_axes_and_an_upright_one_stay_finite() {
        let round = DualQuadric { semi_axes: Vector3::repeat(0.2), ..tilted(0.4) };
        for quadric in [round, tilted(0.0), tilted(FRAC_PI_2)] {
            let l = Factor::erased(&HorizontalOrientation::default()).linearize(&[&quadric]).unwrap();
            assert!(l.residual.iter().chain(l.jacobians[0].iter()).all(|x| x.is_finite()));
        }
    }
}
