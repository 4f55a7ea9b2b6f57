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
/// Quadrics away from the kink of |m · up|.
fn leaning() -> impl Strategy<Value = (Direction, DualQuadric)> {
    (up(), unequal_quadric()).prop_filter("at the kink", |(up, q)| q.major_axis().dot(up).abs() > 1e-4)
}
/// Tilts of zero, of almost zero, of any size, and of nearly a right angle.
fn any_tilt() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), 1e-9..1e-6, 0.0..1.5f64, Just(FRAC_PI_2 - 1e-4), Just(FRAC_PI_2 + 1e-3), Just(3.0)]
}

jacobian_laws! {
    the_paper_s_jacobian_is_right: leaning().prop_map(|(up, q)| (VerticalOrientation { up: up.into() }, q));
    the_smooth_jacobian_is_right: (up(), unequal_quadric())
        .prop_map(|(up, q)| (VerticalOrientationSmooth { up: up.into() }, q));
    the_paper_s_jacobian_is_right_at_any_tilt:
        any_tilt().prop_map(|tilt| (VerticalOrientation::default(), tilted(tilt)));
    the_smooth_jacobian_is_right_at_any_tilt:
        any_tilt().prop_map(|tilt| (VerticalOrientationSmooth::default(), tilted(tilt)));
    the_paper_s_jacobian_of_a_lying_one_is_right: leaning().prop_map(|(up, q)| (HorizontalOrientation { up: up.into() }, q));
    the_smooth_jacobian_of_a_lying_one_is_right: (up(), unequal_quadric())
        .prop_map(|(up, q)| (HorizontalOrientationSmooth { up: up.into() }, q));
    the_smooth_jacobian_of_a_lying_one_is_right_at_any_tilt:
        any_tilt().prop_map(|tilt| (HorizontalOrientationSmooth::default(), tilted(tilt)));
}

#[test]
fn yaw_position_and_size_are_free() {
    let moves = (any_quadric(), -3.0..3.0, -5.0..5.0, 0.1..10.0);
    check(moves, |(quadric, yaw, x, size)| {
        let turn = Se3::new(So3::exp(&Vector3::new(0.0, 0.0, yaw)), Vector3::new(x, 1.0, -x));
        let moved = DualQuadric { pose: turn.compose(&quadric.pose), semi_axes: quadric.semi_axes * size };
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
    for factor in [&VerticalOrientation::default() as &dyn Factor, &VerticalOrientationSmooth::default()] {
        assert_eq!(factor.erased().is_defined(&[&round]), Some(true));
        let l = factor.erased().linearize(&[&round]).unwrap();
        assert!(l.residual.iter().chain(l.jacobians[0].iter()).all(|x| x.is_finite()));
        // A different axis leads as soon as it is longer: the residual jumps, but stays finite.
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

#[test]
fn both_forms_have_the_same_square() {
    check((up(), any_quadric()), |(up, quadric)| {
        let paper = HorizontalOrientation { up: up.into() }.residual::<f64>((quadric,))[0];
        let smooth = HorizontalOrientationSmooth { up: up.into() }.residual::<f64>((quadric,))[0];
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
    // The x axis rises as the object turns about -y.
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
