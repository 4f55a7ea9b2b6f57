//! Several cameras on one body.
use crate::online::{both, run_of};
use manifactor_geometry::{Se3, So3};
use manifactor_quadric::DualQuadric;
use manifactor_slam::camera::Cameras;
use manifactor_slam::estimate::Estimate;
use manifactor_slam::mapping::Mapping;
use manifactor_slam::report::VariantReport;
use manifactor_slam::run::Run;
use manifactor_slam::run_document::RunDocument;
use manifactor_slam::sequence::{Detection, Sequence};
use manifactor_solve::Silent;
use nalgebra::Vector3;
use std::sync::Arc;

/// A robot that drives a circle among objects, with a camera that looks ahead and down to the centre, and one that looks
/// away from it.
const ROOM: &str = r#"
semantics = "table_one"
detections = { loss = { type = "cauchy", scale = 2.8 } }

[source]
type = "simulated"
scene = { objects = 24, area = [7.0, 7.0] }
trajectory = { frames = 160, sweep = 360.0, radius = 1.5 }
detector = { wrong_object = 0.0 }

[source.cameras.rear]
camera = { fx = 400.0, fy = 400.0, cx = 400.0, cy = 300.0, width = 800, height = 600 }
body_from_camera = { translation = [0.1, 0.05, -0.2], rotation = [0.0, 0.8090169943749475, 0.5877852522924731, 0.0] }
"#;

fn sequence_of(run: &RunDocument) -> Sequence {
    Arc::unwrap_or_clone(Run::new(run, None).sequence(&run.variants[0]).unwrap())
}

/// Returns the estimate and the warnings of a sequence.
fn estimate(run: &RunDocument, sequence: Sequence) -> (Estimate, Vec<String>) {
    let settings = &run.variants[0].settings;
    let mapping = Mapping::new(&sequence, settings).unwrap();
    let estimate = Estimate::new(Arc::new(sequence), mapping, settings, &mut Silent).unwrap();
    let estimate = estimate.check_extrinsics(settings, &mut Silent).unwrap();
    let report = VariantReport::new("", &estimate, settings, 0.0);
    let warnings = report.warnings.iter().map(ToString::to_string).collect();
    (estimate, warnings)
}

/// Returns the largest distance between the estimated and the true centre of an object, in metres.
fn largest_error(estimate: &Estimate) -> f64 {
    let error = |quadric: &DualQuadric, truth: &Se3| (quadric.centroid() - truth.translation).norm();
    let landmarks = estimate.landmarks();
    let errors = landmarks.iter().filter_map(|l| Some(error(l.quadric, &l.truth?.world_from_object)));
    errors.fold(0.0, f64::max)
}

#[test]
fn both_cameras_map_the_room_in_batch_and_stream() {
    let run = run_of(ROOM, &[]);
    let (online, batch, _) = both(&run, &run.variants[0], None);
    assert!(online.counts.objects >= 21 && batch.counts.objects >= 21);
    let mut sequence = sequence_of(&run);
    let (of_both, warnings) = estimate(&run, sequence.clone());
    assert!(warnings.iter().all(|warning| !warning.contains("turned")), "{warnings:?}");
    // the poses are those of the first camera, the boxes of the second one
    sequence.detections.retain(|detection| detection.camera.name == "rear");
    let (of_rear, _) = estimate(&run, sequence);
    for (estimate, objects, limit) in [(of_both, 22, 0.2), (of_rear, 12, 0.4)] {
        let (found, error) = (estimate.landmarks().len(), largest_error(&estimate));
        assert!(found >= objects && error < limit, "{found} objects, {error} m");
    }
}

#[test]
fn association_knows_the_cameras() {
    let run = run_of(ROOM, &["association.type=likelihood"]);
    let (online, batch, _) = both(&run, &run.variants[0], None);
    for report in [online, batch] {
        let scores = report.association.unwrap().in_the_end.unwrap();
        assert!(scores.f1 > 0.99 && scores.objects == 24, "{scores:?}");
    }
}

#[test]
fn a_wrong_pose_of_a_camera_is_reported() {
    let run = run_of(ROOM, &[]);
    let mut sequence = sequence_of(&run);
    let rear = sequence.cameras.named(Some("rear")).unwrap().clone();
    let turn = So3::exp(&Vector3::new(0.0, 5_f64.to_radians(), 0.0));
    let given = rear.first_from_camera.unwrap();
    let mut cameras = Cameras::new(sequence.cameras.first().model);
    let turned = Se3::new(given.rotation.compose(&turn), given.translation);
    cameras.add("rear", rear.model, turned).unwrap();
    let wrong = |detection: Detection| {
        let name = Some(detection.camera.name.as_str()).filter(|name| !name.is_empty());
        Detection { camera: cameras.named(name).unwrap().clone(), ..detection.clone() }
    };
    sequence.detections = sequence.detections.drain(..).map(wrong).collect();
    sequence.cameras = cameras.clone();
    let (_, warnings) = estimate(&run, sequence);
    let reported = warnings.iter().find(|warning| warning.contains("`rear`")).cloned();
    let reported = reported.unwrap_or_else(|| panic!("{warnings:?}"));
    assert!(reported.contains("`source.cameras.rear.body_from_camera`"), "{reported}");
}
