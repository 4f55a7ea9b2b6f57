//! The second stage: all objects from all boxes, with the poses of the first stage.
use crate::online::run_of;
use manifactor_slam::estimate::Estimate;
use manifactor_slam::mapping::{Rejection, Warning};
use manifactor_slam::report::VariantReport;
use manifactor_slam::run::{Run, estimate};
use manifactor_slam::sequence::Sequence;
use manifactor_solve::Silent;
use std::sync::Arc;

/// A desk whose objects leave the image, so that the first stage loses boxes and objects.
const DESK: &str = r#"
semantics = "resting"
detections = { loss = { type = "cauchy", scale = 2.8 } }
objects = { max_box_deviation_px = 15.0 }
[source]
type = "simulated"
seed = 3
scene = { objects = 14, area = [3.0, 2.2] }
trajectory = { frames = 60, radius = 1.9 }
"#;

/// Runs the desk with these settings, after a change of its sequence.
fn run(set: &[&str], change: impl Fn(&mut Sequence)) -> (Estimate, VariantReport) {
    let run = run_of(DESK, set);
    let mut sequence = Run::new(&run, None).sequence(&run.variants[0]).unwrap();
    change(Arc::make_mut(&mut sequence));
    estimate("desk", sequence, &run.variants[0].settings, &mut Silent).unwrap()
}

#[test]
fn all_objects_are_mapped_and_the_trajectory_stays() {
    let (first, before) = run(&["completion.enabled=false"], |_| {});
    let (complete, after) = run(&[], |_| {});
    let outcome = after.completion.expect("a second stage");
    assert_eq!((outcome.objects_before, outcome.boxes_before), (before.counts.objects, before.counts.boxes));
    assert_eq!((outcome.objects, outcome.boxes), (after.counts.objects, after.counts.boxes));
    assert!(before.counts.objects <= 8 && after.counts.objects >= 13, "{outcome:?}");
    assert!(outcome.boxes > 2 * outcome.boxes_before, "{outcome:?}");
    assert_eq!(first.trajectory(), complete.trajectory());
    assert_eq!(after.counts.cut, 0);
    // more objects, and no worse
    let volume = |report: &VariantReport| report.landmarks.unwrap().estimate.mean.volume;
    assert!(volume(&after) < volume(&before) + 0.05, "{} {}", volume(&after), volume(&before));
}

#[test]
fn an_object_whose_boxes_no_ellipsoid_explains_is_left_out_with_the_reason() {
    let (_, plain) = run(&[], |_| {});
    let widest = plain.objects.iter().max_by_key(|own| own.object.boxes).unwrap().object.id;
    let (_, mixed) = run(&[], |sequence| {
        for detection in sequence.detections.iter_mut().filter(|own| own.object == Some(widest)) {
            // as of three objects in a column
            let shift = 100.0 * (detection.frame % 3) as f64;
            detection.bounding_box.ymin += shift - 100.0;
            detection.bounding_box.ymax += shift - 100.0;
        }
    });
    let own = mixed.objects.iter().find(|own| own.object.id == widest).unwrap();
    assert!(matches!(own.object.rejected, Some(Rejection::Misfit { .. })), "{:?}", own.object.rejected);
    let warned = mixed.warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n");
    assert!(warned.contains("they show several objects"), "{warned}");
}

#[test]
fn poses_that_contradict_the_boxes_are_a_warning() {
    let (_, report) = run(&["odometry.noise.sigma=1e-6"], |sequence| {
        // the camera seems to turn the other way
        for frame in &mut sequence.frames {
            let rotation = &mut frame.world_from_camera.rotation;
            *rotation = rotation.inverse();
        }
    });
    let is_suspected =
        |warning: &Warning| matches!(warning, Warning::PosesMisfit { .. } | Warning::NoObjects { .. });
    assert!(report.warnings.iter().any(is_suspected), "{:?}", report.warnings);
}
