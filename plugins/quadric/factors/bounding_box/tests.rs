use super::*;
use crate::testing::{any_camera, any_semi_axes, any_view, quadric_tangent};
use manifactor_geometry::So3;
use manifactor_geometry::testing::{any_se3, any_so3};
use manifactor_graph::{Factor, Manifold};
use manifactor_testing::{JacobianLaw, LawError, check, invariance_law};
use nalgebra::{SVector, Vector2, Vector3, Vector6};
use proptest::prelude::*;
use std::f64::consts::FRAC_PI_2;

fn factor(camera: Camera, model: BoxModel) -> BoundingBoxFactor {
    let bounding_box = BoundingBox::new([100.0, 80.0, 300.0, 200.0]).unwrap();
    BoundingBoxFactor { bounding_box, camera, model }
}

fn camera() -> Camera {
    Camera::new([525.0, 525.0, 320.0, 240.0], 640, 480).unwrap()
}

/// A ball, given in the frame of a camera at the origin.
fn ball(centre: [f64; 3], radius: f64) -> DualQuadric {
    DualQuadric { pose: Se3::new(So3::identity(), centre.into()), semi_axes: Vector3::repeat(radius) }
}

/// Kind of each side: 0 if the end of the outline is visible, 1 if it is cut off, 2 if the side is the
/// border.
fn what_ends(factor: &BoundingBoxFactor, pose: &Se3, quadric: &DualQuadric) -> Option<[u8; 4]> {
    let sides = factor.sides(&Ellipsoid::in_camera_frame(pose, quadric))?;
    Some(sides.map(|side| match side {
        Side::Touched { slope: 0.0, .. } => 0,
        Side::Touched { .. } => 1,
        Side::Border(_) => 2,
    }))
}

/// Returns whether steps of this length change the kind of a side, so that finite differences would cross a
/// kink.
fn near_a_kink(factor: &BoundingBoxFactor, pose: &Se3, quadric: &DualQuadric, step: f64) -> bool {
    let here = what_ends(factor, pose, quadric);
    [step, -step].into_iter().any(|h| {
        (0..6).any(|i| what_ends(factor, &pose.retract(&(Vector6::ith(i, h))), quadric) != here)
            || (0..9).any(|i| what_ends(factor, pose, &quadric.retract(&SVector::ith(i, h))) != here)
    })
}

fn jacobian_law(model: BoxModel) {
    check(any_view(), |(camera, pose, quadric)| {
        let factor = factor(camera, model);
        let mut law = JacobianLaw { step: 1e-3, ..JacobianLaw::default() };
        // Differences of huge numbers have few accurate digits.
        let outline = Ellipsoid::in_camera_frame(&pose, &quadric).outline(&camera);
        let digits_lost = 1.0 + outline.xx.max(outline.yy).sqrt() / 300.0;
        law.analytic *= digits_lost;
        law.numeric *= digits_lost;
        if near_a_kink(&factor, &pose, &quadric, law.step) {
            law.numeric = f64::INFINITY;
        }
        law.check(&factor, &[&pose, &quadric])
    });
}

#[test]
fn the_jacobian_of_the_standard_model_is_right() {
    jacobian_law(BoxModel::Standard);
}

#[test]
fn the_jacobian_of_the_truncated_model_is_right() {
    jacobian_law(BoxModel::Truncated);
}

#[test]
fn moving_the_world_changes_nothing() {
    check((any_view(), any_se3()), |((camera, pose, quadric), motion)| {
        let moved = DualQuadric { pose: motion.compose(&quadric.pose), ..quadric };
        let factor = factor(camera, BoxModel::Truncated);
        match invariance_law(&factor, &[&pose, &quadric], &[&motion.compose(&pose), &moved]) {
            Ok(()) | Err(LawError::NotDefined { .. }) => Ok(()),
            // Rounding in poses is magnified by the focal length, and more so close to the camera.
            Err(_) if !well_in_front(&pose, &quadric) => Ok(()),
            broken => broken,
        }
    });
}

fn well_in_front(pose: &Se3, quadric: &DualQuadric) -> bool {
    let seen = Ellipsoid::in_camera_frame(pose, quadric);
    seen.axes.row(2).norm() < 0.9 * seen.centroid.z && seen.axes.column_iter().all(|a| a.norm() > 0.05)
}

#[test]
fn the_box_holds_the_projected_points_and_no_more() {
    check(any_view(), |(camera, pose, quadric)| {
        let predicted = factor(camera, BoxModel::Standard).predict(&pose, &quadric).unwrap();
        let [mut low, mut high] = [Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY)];
        for i in 0..=60 {
            for j in 0..120 {
                let (lat, lon) = (f64::from(i) * 0.05236 - FRAC_PI_2, f64::from(j) * 0.05236);
                let u = Vector3::new(lat.cos() * lon.cos(), lat.cos() * lon.sin(), lat.sin());
                let point = pose.inverse_act(&quadric.pose.act(&u.component_mul(&quadric.semi_axes)));
                let pixel = camera.matrix() * point;
                let pixel = pixel.xy() / pixel.z;
                (low, high) = (low.inf(&pixel), high.sup(&pixel));
            }
        }
        let [xmin, ymin, xmax, ymax] = predicted.bounds();
        let slack = 1e-6 * (1.0 + high.amax().max(low.amax()));
        assert!(
            low.x >= xmin - slack
                && low.y >= ymin - slack
                && high.x <= xmax + slack
                && high.y <= ymax + slack
        );
        if well_in_front(&pose, &quadric) {
            let size = predicted.width().max(predicted.height());
            assert!(low.x - xmin < 0.05 * size && xmax - high.x < 0.05 * size);
            assert!(low.y - ymin < 0.05 * size && ymax - high.y < 0.05 * size);
        }
        Ok(())
    });
}

#[test]
fn an_object_off_the_front_has_no_box() {
    for (what, quadric) in [
        ("behind", ball([0.0, 0.0, -3.0], 0.5)),
        ("around", ball([0.1, 0.0, 0.2], 0.5)),
        ("around, its centre behind", ball([0.1, 0.0, -0.2], 0.5)),
        ("across the camera's plane", ball([3.0, 0.0, 0.2], 0.5)),
        ("touching the camera's plane", ball([0.0, 0.0, 0.5], 0.5)),
        ("beside, as far as can be", ball([1e9, 0.0, 0.0], 1e9)),
    ] {
        for model in [BoxModel::Standard, BoxModel::Truncated] {
            let factor = factor(camera(), model);
            let x = (&Se3::identity(), &quadric);
            assert!(!factor.is_defined(x), "{what}");
            assert_eq!(factor.predict(x.0, x.1), None, "{what}");
            let l = Factor::erased(&factor).linearize(&[x.0, x.1]).unwrap();
            let numbers = l.residual.iter().chain(l.jacobians.iter().flatten());
            assert!(numbers.copied().all(|n| n == 0.0), "{what}");
            assert_eq!(Factor::erased(&factor).autodiff(&[x.0, x.1]).unwrap(), l, "{what}");
        }
    }
}

#[test]
fn just_in_front_is_finite() {
    // The nearest point is at a millionth of the distance.
    let quadric = ball([0.0, 0.0, 1.0], 1.0 - 1e-6);
    let factor = factor(camera(), BoxModel::Standard);
    assert!(factor.is_defined((&Se3::identity(), &quadric)));
    let l = Factor::erased(&factor).linearize(&[&Se3::identity(), &quadric]).unwrap();
    assert!(l.residual.iter().chain(l.jacobians.iter().flatten()).all(|x| x.is_finite()));
}

#[test]
fn whether_it_is_defined_is_decided_alike_everywhere() {
    let anywhere = (any_camera(), any_se3(), any_so3(), any_semi_axes(), prop::array::uniform3(-4.0..4.0f64));
    check(anywhere, |(camera, pose, rotation, semi_axes, at)| {
        let object = pose.compose(&Se3::new(rotation, at.into()));
        let quadric = DualQuadric { pose: object, semi_axes };
        let factor = factor(camera, BoxModel::Standard);
        let defined = factor.is_defined((&pose, &quadric));
        assert_eq!(defined, factor.predict(&pose, &quadric).is_some());
        assert_eq!(defined, Ellipsoid::in_camera_frame(&pose, &quadric).is_in_front());
        if defined {
            assert!(Ellipsoid::in_camera_frame(&pose, &quadric).dual_conic(&camera).0[(2, 2)] < 0.0);
            assert!(!quadric.contains(&pose.translation));
        }
        Ok(())
    });
}

#[test]
fn a_box_cut_by_the_border_does_not_pull() {
    // The right side of the ball is far outside the image.
    let quadric = ball([3.0, 0.0, 5.0], 1.0);
    let pose = Se3::identity();
    let mut factor = factor(camera(), BoxModel::Truncated);
    factor.bounding_box = factor.predict(&pose, &quadric).unwrap();
    assert_eq!(factor.bounding_box.xmax, 640.0);
    let l = Factor::erased(&factor).linearize(&[&pose, &quadric]).unwrap();
    assert!(l.residual.iter().all(|r| r.abs() < 1e-12));
    for block in &l.jacobians {
        assert!(block.row(2).iter().all(|x| *x == 0.0));
        assert!(block.row(0).norm() > 1.0 && block.row(1).norm() > 1.0);
    }
    let standard = BoundingBoxFactor { model: BoxModel::Standard, ..factor };
    assert!(standard.residual::<f64>((pose, quadric))[2] > 100.0);
}

#[test]
fn a_side_at_the_border_stops_there() {
    let (pose, quadric) = (Se3::identity(), ball([0.4, 0.0, 2.0], 0.3));
    let whole = factor(camera(), BoxModel::Standard).predict(&pose, &quadric).unwrap();
    // Focal length that puts the right end of the outline this far outside the border.
    let focal = |off: f64| 525.0 * (320.0 + off) / (whole.xmax - 320.0);
    for (off, moves) in [(-1e-9, true), (1e-9, false)] {
        let factor = factor(Camera { fx: focal(off), ..camera() }, BoxModel::Truncated);
        let bound = factor.predict(&pose, &quadric).unwrap().xmax;
        assert!(bound <= 640.0 && bound > 640.0 - 2e-9);
        let analytic = Factor::erased(&factor).linearize(&[&pose, &quadric]).unwrap();
        let automatic = Factor::erased(&factor).autodiff(&[&pose, &quadric]).unwrap();
        for (a, b) in analytic.jacobians.iter().zip(&automatic.jacobians) {
            assert_eq!(a.row(2).norm() > 0.0, moves);
            assert!((a - b).amax() < 1e-9 * a.amax());
        }
    }
}

#[test]
fn an_object_that_leaves_the_image_leaves_the_truncated_factor() {
    let (pose, factor) = (Se3::identity(), factor(camera(), BoxModel::Truncated));
    // The image ends at x/z = 320/525. Moves sideways until less than a pixel is left.
    let mut last = 640.0;
    let mut seen = true;
    for step in 0..2000 {
        let quadric = ball([1.0 + f64::from(step) * 5e-4, 0.0, 2.0], 0.3);
        let defined = factor.is_defined((&pose, &quadric));
        assert!(seen || !defined, "it comes back");
        seen = defined;
        if let Some(b) = factor.predict(&pose, &quadric) {
            assert!(b.width() >= MIN_VISIBLE_PX && b.height() >= MIN_VISIBLE_PX);
            last = b.width();
            let l = Factor::erased(&factor).linearize(&[&pose, &quadric]).unwrap();
            assert!(l.jacobians.iter().flatten().all(|x| x.is_finite()));
        }
    }
    assert!(!seen && last < 2.0, "{last} px of it were left");
    // A speck that is completely inside counts, although it is smaller than a pixel.
    assert!(factor.is_defined((&pose, &ball([0.0, 0.0, 10.0], 0.001))));
}

#[test]
fn an_object_that_fills_the_image_is_held_by_nothing() {
    let factor = factor(camera(), BoxModel::Truncated);
    let quadric = DualQuadric { semi_axes: Vector3::new(4.0, 4.0, 1.0), ..ball([0.0, 0.0, 3.0], 1.0) };
    assert_eq!(factor.predict(&Se3::identity(), &quadric).unwrap().bounds(), [0.0, 0.0, 640.0, 480.0]);
    let l = Factor::erased(&factor).linearize(&[&Se3::identity(), &quadric]).unwrap();
    assert!(l.jacobians.iter().flatten().all(|x| *x == 0.0));
}

#[test]
fn truncation_of_an_object_inside_of_the_image_changes_nothing() {
    let (pose, quadric) = (Se3::identity(), ball([0.1, -0.2, 3.0], 0.3));
    let of = |model| Factor::erased(&factor(camera(), model)).linearize(&[&pose, &quadric]).unwrap();
    assert_eq!(of(BoxModel::Standard), of(BoxModel::Truncated));
}

#[test]
fn equal_semi_axes_and_huge_steps_stay_finite() {
    check((any_view(), quadric_tangent()), |((camera, pose, quadric), delta)| {
        for quadric in [
            DualQuadric { semi_axes: Vector3::repeat(quadric.semi_axes.x), ..quadric },
            quadric.retract(&(delta * 500.0)),
        ] {
            for model in [BoxModel::Standard, BoxModel::Truncated] {
                let l = Factor::erased(&factor(camera, model)).linearize(&[&pose, &quadric]).unwrap();
                let finite = l.residual.iter().chain(l.jacobians.iter().flatten()).all(|x| x.is_finite());
                assert!(finite, "{quadric:?} {l:?}");
            }
        }
        Ok(())
    });
}

#[test]
fn documents_are_checked_when_read() {
    let read = |text: &str| serde_json::from_str::<BoundingBoxFactor>(text).map_err(|e| e.to_string());
    let text = serde_json::to_string(&factor(camera(), BoxModel::Truncated)).unwrap();
    assert_eq!(read(&text).unwrap(), factor(camera(), BoxModel::Truncated));
    assert!(
        read(&text.replace("truncated", "cut")).unwrap_err().contains("expected `standard` or `truncated`")
    );
    assert!(read(&text.replace("100.0,80.0", "400.0,80.0")).unwrap_err().contains("xmin ≤ xmax"));
    assert!(read(&text.replace("\"box\"", "\"bbox\"")).unwrap_err().contains("unknown field"));
}
