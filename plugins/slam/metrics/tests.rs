use super::*;
use manifactor_geometry::{Se3, So3};
use manifactor_graph::Manifold;
use nalgebra::{Vector3, Vector6};
use proptest::prelude::*;

fn pose(xi: [f64; 6]) -> Se3 {
    Se3::identity().retract(&Vector6::from(xi))
}

fn pairs(truth: &[[f64; 6]], estimate: impl Fn(&Se3) -> Se3) -> Vec<PosePair> {
    let pair = |(i, xi): (usize, &[f64; 6])| {
        let truth = pose(*xi);
        PosePair { timestamp: i as f64, truth, estimate: estimate(&truth) }
    };
    truth.iter().enumerate().map(pair).collect()
}

fn poses() -> impl Strategy<Value = Vec<[f64; 6]>> {
    prop::collection::vec(prop::array::uniform6(-2.0..2.0f64), 5..20)
}

proptest! {
    #[test]
    fn a_moved_and_scaled_copy_aligns_without_error(
        truth in poses(), by in prop::array::uniform6(-3.0..3.0f64), scale in 0.1..10.0f64,
    ) {
        let by = pose(by);
        let moved = pairs(&truth, |x| Se3::new(by.rotation.compose(&x.rotation), by.act(&(x.translation * scale))));
        let (similarity, aligned) = align(&moved, Alignment::Sim3).unwrap();
        prop_assert!((similarity.scale * scale - 1.0).abs() < 1e-9);
        prop_assert!(absolute_error(&aligned).unwrap().max < 1e-9);
        prop_assert!(relative_error(&aligned, 1, Pairing::All).unwrap().translation.max < 1e-9);
    }

    #[test]
    fn no_other_rigid_alignment_is_better(
        truth in poses(), noise in prop::collection::vec(prop::array::uniform3(-0.5..0.5f64), 20),
        step in prop::array::uniform6(-0.1..0.1f64),
    ) {
        let mut noisy = pairs(&truth, |x| *x);
        for (pair, n) in noisy.iter_mut().zip(noise) {
            pair.estimate.translation += Vector3::from(n);
        }
        let (_, best) = align(&noisy, Alignment::Se3).unwrap();
        let turned: Vec<_> =
            best.iter().map(|p| PosePair { estimate: pose(step).compose(&p.estimate), ..*p }).collect();
        let error = |pairs: &[PosePair]| absolute_error(pairs).unwrap().rmse;
        prop_assert!(error(&best) <= error(&turned) * (1.0 + 1e-12));
    }

    #[test]
    fn relative_errors_do_not_depend_on_the_frame(truth in poses(), by in prop::array::uniform6(-3.0..3.0f64)) {
        let noisy = pairs(&truth, |x| x.compose(&pose([0.01, 0.0, 0.02, 0.1 * x.translation.x, 0.0, 0.0])));
        let moved: Vec<_> =
            noisy.iter().map(|p| PosePair { estimate: pose(by).compose(&p.estimate), ..*p }).collect();
        let (a, b) = (relative_error(&noisy, 2, Pairing::Consecutive), relative_error(&moved, 2, Pairing::Consecutive));
        let (a, b) = (a.unwrap(), b.unwrap());
        prop_assert!((a.translation.rmse - b.translation.rmse).abs() < 1e-12);
        prop_assert!((a.rotation.max - b.rotation.max).abs() < 1e-7);
    }
}

#[test]
fn alignment_by_the_first_pose_leaves_no_error_there() {
    let truth = [[0.1; 6], [0.2; 6], [0.5; 6]];
    let moved = pairs(&truth, |x| pose([1.0, 2.0, 0.5, 3.0, 1.0, 2.0]).compose(x));
    let (_, aligned) = align(&moved, Alignment::FirstPose).unwrap();
    assert!(absolute_error(&aligned).unwrap().max < 1e-12);
}

#[test]
fn a_mirror_image_is_not_taken_for_a_rotation() {
    let truth = [[0., 0., 0., 1., 0., 0.], [0., 0., 0., 0., 1., 0.], [0., 0., 0., 0., 0., 1.], [0.; 6]];
    let mirrored = pairs(&truth, |x| {
        Se3::new(So3::identity(), x.translation.component_mul(&Vector3::new(1.0, 1.0, -1.0)))
    });
    let (similarity, aligned) = align(&mirrored, Alignment::Se3).unwrap();
    assert!((similarity.rotation.matrix().determinant() - 1.0).abs() < 1e-12);
    assert!(absolute_error(&aligned).unwrap().rmse > 0.1);
}

#[test]
fn positions_on_a_line_cannot_be_aligned_by_fit() {
    let line: Vec<[f64; 6]> = (0..5).map(|i| [0.0, 0.0, 0.0, f64::from(i), 0.0, 0.0]).collect();
    assert_eq!(align(&pairs(&line, |x| *x), Alignment::Se3).unwrap_err(), MetricsError::Degenerate);
    assert_eq!(align(&pairs(&line[..1], |x| *x), Alignment::Sim3).unwrap_err(), MetricsError::Degenerate);
    assert!(align(&pairs(&line, |x| *x), Alignment::FirstPose).is_ok());
    assert!(align(&[], Alignment::None).is_err());
}

#[test]
fn a_relative_error_needs_more_poses_than_its_step() {
    let few = pairs(&[[0.0; 6], [0.1; 6]], |x| *x);
    assert_eq!(relative_error(&few, 1, Pairing::Consecutive).unwrap().translation.count, 1);
    let needed = |delta| relative_error(&few, delta, Pairing::All).unwrap_err().to_string();
    assert!(needed(2).ends_with("at least 3 matched poses, got 2"));
    assert!(needed(0).ends_with("at least 2 matched poses, got 2"));
}
