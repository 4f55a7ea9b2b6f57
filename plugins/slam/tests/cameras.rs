//! Several cameras on one body.
use crate::online::{both, run_of};
use manifactor_geometry::{Camera, CameraModel, KannalaBrandt, Se3, So3};
use manifactor_graph::Manifold;
use manifactor_quadric::DualQuadric;
use manifactor_slam::camera::Cameras;
use manifactor_slam::estimate::Estimate;
use manifactor_slam::mapping::Mapping;
use manifactor_slam::output::write_variant;
use manifactor_slam::record::VariantRecord;
use manifactor_slam::report::VariantReport;
use manifactor_slam::run::Run;
use manifactor_slam::run_document::RunDocument;
use manifactor_slam::sequence::{Detection, Sequence};
use manifactor_solve::Silent;
use nalgebra::{Matrix3, Matrix4, Vector3};
use serde_json::Value;
use std::path::Path;
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

/// Ellipsoids around a robot with a fisheye lens of 230° that looks ahead, the lines of its stream, and the boxes of each
/// ellipsoid.
fn fisheye_stream() -> (Vec<DualQuadric>, String, Vec<usize>) {
    let lens = KannalaBrandt::new(Camera::new([200.0, 200.0, 400.0, 400.0], 800, 800).unwrap(), [0.0; 4]);
    let object = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / 16.0;
        let place = Vector3::new(0.6 + 2.0 * angle.cos(), 2.0 * angle.sin(), 0.4 * (3.0 * angle).sin());
        let pose = Se3::new(So3::exp(&Vector3::new(0.3, 0.2, angle)), place);
        DualQuadric { pose, semi_axes: Vector3::new(0.15, 0.1, 0.2) }
    };
    let objects: Vec<DualQuadric> = (0..16).map(object).collect();
    // x right, y down, z ahead, which is x of the world
    let ahead = So3::from_matrix(&Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0));
    let (mut lines, mut boxes) = (String::new(), vec![0; objects.len()]);
    for i in 0..40 {
        let t = f64::from(i) / 40.0;
        let turn =
            ahead.compose(&So3::exp(&Vector3::new(0.05 * (9.0 * t).sin(), 0.2 * (5.0 * t).sin(), 0.0)));
        let place = Vector3::new(1.2 * t, 0.4 * (4.0 * t).sin(), 0.3 * (6.0 * t).cos());
        let pose = Se3::new(turn, place);
        let seen: Vec<String> = objects
            .iter()
            .enumerate()
            .filter_map(|(k, object)| {
                let [xmin, ymin, xmax, ymax] = outline(&lens, &pose, object)?;
                boxes[k] += 1;
                Some(format!(r#"{{"box":[{xmin},{ymin},{xmax},{ymax}],"class":"cup","object":{k}}}"#))
            })
            .collect();
        let pose = serde_json::to_string(&pose).unwrap();
        lines += &format!("{{\"timestamp\":{t},\"pose\":{pose},\"boxes\":[{}]}}\n", seen.join(","));
    }
    (objects, lines, boxes)
}

/// Returns the box around an ellipsoid in the image of a lens; `None` if the border cuts it.
fn outline(lens: &KannalaBrandt, pose: &Se3, object: &DualQuadric) -> Option<[f64; 4]> {
    let mut bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    for i in 0..=90 {
        for j in 0..180 {
            let [tilt, turn] = [f64::from(i), f64::from(j)].map(|k| (2.0 * k).to_radians());
            let ball = Vector3::new(tilt.sin() * turn.cos(), tilt.sin() * turn.sin(), tilt.cos());
            let point = pose.inverse_act(&object.pose.act(&ball.component_mul(&object.semi_axes)));
            let pixel = lens.sees(&point).then(|| lens.project(&point))?;
            for axis in [0, 1] {
                bounds[axis] = pixel[axis].min(bounds[axis]);
                bounds[axis + 2] = pixel[axis].max(bounds[axis + 2]);
            }
        }
    }
    let is_inside = bounds.iter().all(|side| (25.0..775.0).contains(side));
    is_inside.then_some(bounds)
}

/// Writes a stream, and returns its document.
fn fisheye_document(folder: &Path, lines: &str) -> String {
    let file = folder.join("frames.jsonl");
    std::fs::write(&file, lines).unwrap();
    format!(
        r#"
detections = {{ noise = {{ sigma = 1.0 }} }}
[source]
type = "json_lines"
file = "{}"
camera = {{ type = "kannala_brandt", fx = 200.0, fy = 200.0, cx = 400.0, cy = 400.0, width = 800, height = 800, distortion = [0.0, 0.0, 0.0, 0.0] }}
"#,
        file.display()
    )
}

#[test]
fn the_pose_of_a_camera_on_the_body_comes_from_a_file_of_kalibr() {
    let (_, lines, _) = fisheye_stream();
    let folder = tempfile::tempdir().unwrap();
    let document = fisheye_document(folder.path(), &lines);
    let matrix =
        "[[0.0, -1.0, 0.0, 0.05], [0.0, 0.0, -1.0, 0.1], [1.0, 0.0, 0.0, -0.2], [0.0, 0.0, 0.0, 1.0]]";
    let chain = folder.path().join("chain.yaml");
    let intrinsics = "camera_model: pinhole\n  distortion_model: equidistant\n  distortion_coeffs: [0, 0, 0, 0]\n  intrinsics: [200.0, 200.0, 400.0, 400.0]\n  resolution: [800, 800]";
    std::fs::write(&chain, format!("cam0:\n  T_cam_imu: {matrix}\n  {intrinsics}\n")).unwrap();
    let chain = chain.display();
    let camera = format!("source.camera={{ file = \"{chain}\" }}");
    let from_file = format!("source.body_from_camera={{ file = \"{chain}\" }}");
    let camera_from_body = Matrix4::from_row_slice(&[
        0.0, -1.0, 0.0, 0.05, 0.0, 0.0, -1.0, 0.1, 1.0, 0.0, 0.0, -0.2, 0.0, 0.0, 0.0, 1.0,
    ]);
    let pose = Se3::try_from_matrix(&camera_from_body).unwrap().inverse();
    let [x, y, z]: [f64; 3] = pose.translation.into();
    let q = pose.rotation.quaternion_xyzw();
    let given =
        format!("source.body_from_camera={{ translation = [{x:?}, {y:?}, {z:?}], rotation = {q:?} }}");
    let poses = |sets: &[&str]| -> Vec<Se3> {
        let sequence = sequence_of(&run_of(&document, sets));
        sequence.frames.iter().map(|frame| frame.world_from_camera).collect()
    };
    let (read, expected) = (poses(&[&camera, &from_file]), poses(&[&given]));
    assert!(read.len() == 40 && read.iter().zip(&expected).all(|(a, b)| a.local(b).norm() < 1e-12));
    assert!(read[0].local(&poses(&[])[0]).norm() > 0.1);
    // the body of the file is not the first camera
    let further = format!(
        "source.cameras.rear={{ camera = {{ file = \"{chain}\" }}, body_from_camera = {{ file = \"{chain}\" }} }}"
    );
    let refused = run_of(&document, &[&further]);
    let error = Run::new(&refused, None).sequence(&refused.variants[0]).unwrap_err().to_string();
    assert!(error.contains("give `source.body_from_camera` from it, too"), "{error}");
}

#[test]
fn a_fisheye_maps_what_is_beside_and_behind_it() {
    let (objects, lines, boxes) = fisheye_stream();
    let folder = tempfile::tempdir().unwrap();
    let run = run_of(&fisheye_document(folder.path(), &lines), &[]);
    let (estimate, _) = estimate(&run, sequence_of(&run));
    let landmarks = estimate.landmarks();
    let often: Vec<usize> = (0..objects.len()).filter(|k| boxes[*k] >= 10).collect();
    assert!(often.len() >= 9, "{boxes:?}");
    // 100° from the axis
    assert!(often.iter().any(|k| objects[*k].centroid().x < 0.2), "{boxes:?}");
    for k in often {
        let found = landmarks.iter().find(|landmark| landmark.object.id.0 == k as u32);
        let found = found.unwrap_or_else(|| panic!("object {k} of {boxes:?} is missing"));
        let error = (found.quadric.centroid() - objects[k].centroid()).norm();
        assert!(error < 0.05, "object {k}: {error} m");
    }
}

#[test]
fn boxes_that_a_table_does_not_hold_are_written_as_lines() {
    let (_, lines, _) = fisheye_stream();
    let folder = tempfile::tempdir().unwrap();
    let mut run = run_of(&fisheye_document(folder.path(), &lines), &["association.type=likelihood"]);
    run.output = folder.path().join("out");
    let variant = run.variants.remove(0);
    let (estimate, report) = Run::new(&run, None).run_variant(&variant, &mut Silent).unwrap();
    let written = write_variant(&run, &variant, &estimate, &report, &VariantRecord::new(&variant, &estimate));
    let written = written.unwrap();
    assert!(!written.join("detections.csv").exists());
    let lines = std::fs::read_to_string(written.join("detections.jsonl")).unwrap();
    let boxes = lines.matches("\"view\"").count();
    assert_eq!((lines.lines().count(), boxes), (40, estimate.sequence.detections.len()));
    // the outlines are those in the views
    let frames = std::fs::read_to_string(written.join("frames.jsonl")).unwrap();
    let frames: Vec<Value> = frames.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let side = |seen: &Value, name: &str, i: usize| seen[name][i].as_f64().unwrap();
    let all = frames.iter().flat_map(|frame| frame["boxes"].as_array().unwrap());
    let drawn: Vec<&Value> = all.filter(|seen| seen["projected"].is_array()).collect();
    assert!(drawn.len() > 300, "{} outlines", drawn.len());
    for seen in drawn {
        for i in 0..4 {
            let error = side(seen, "projected", i) - side(seen, "measured", i);
            assert!(error.abs() < 5.0, "{seen}");
        }
    }
}
