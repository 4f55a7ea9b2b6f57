//! Loop closures and corrected odometry in a stream.
use crate::online::{mapped, run_of, scene};
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::{Between, Coordinates, Position, Prior, Se3};
use manifactor_graph::{Factor, Graph, Noise};
use manifactor_slam::estimate::Estimate;
use manifactor_slam::online::{FrameReport, Mapper};
use manifactor_slam::pose_graph::{PoseFactor, PoseFactorKey, PoseGraphChanges};
use manifactor_slam::run::Run;
use manifactor_slam::run_document::RunDocument;
use manifactor_slam::sequence::{ObjectId, Observation, Sequence};
use manifactor_slam::settings::RunSettings;
use manifactor_slam::source::{format_line, parse};
use manifactor_slam::variance::StreamNoise;
use manifactor_solve::Silent;
use nalgebra::{Vector3, Vector6};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// A camera that walks around a table. Its odometry is trusted.
const TABLE: &str = r#"
semantics = "table_one"
source = { type = "simulated", scene = { objects = 8 }, trajectory = { frames = 80 } }
odometry = { noise = { sigma = 0.001 } }
detections = { loss = { type = "cauchy", scale = 2.8 } }
"#;

/// Turn of each step about the vertical axis of the camera in addition to the motion, in rad: 0.16 rad in 80 steps.
const DRIFT_RAD: f64 = 0.002;

/// Returns the true poses of all frames.
fn true_poses(sequence: &Sequence) -> Vec<Se3> {
    sequence.ground_truth.as_ref().unwrap().trajectory.iter().map(|stamped| stamped.pose).collect()
}

/// Returns the odometry with this drift: the motions of `poses`, each followed by a small turn.
fn drifted(poses: &[Se3]) -> Vec<Se3> {
    let turn = Se3::exp(&Vector6::new(0.0, DRIFT_RAD, 0.0, 0.0, 0.0, 0.0));
    let mut all = vec![poses[0]];
    for pair in poses.windows(2) {
        all.push(all[all.len() - 1].compose(&pair[0].between(&pair[1])).compose(&turn));
    }
    all
}

/// Returns the frames with this odometry.
fn with_odometry(sequence: &Sequence, poses: &[Se3]) -> Vec<Observation> {
    let mut frames: Vec<Observation> = sequence.observations().collect();
    for (observation, pose) in frames.iter_mut().zip(poses) {
        observation.frame.world_from_camera = *pose;
    }
    frames
}

/// Returns the sequence with these frames.
fn sequence_of(sequence: &Sequence, frames: Vec<Observation>) -> Sequence {
    let mut changed = sequence.header().into_sequence();
    frames.into_iter().for_each(|frame| changed.push(frame));
    changed
}

fn factor(id: &str, timestamps: &[f64], factor: impl Factor + 'static, sigma: f64) -> PoseFactor {
    PoseFactor {
        id: Some(id.into()),
        keys: timestamps.iter().map(|timestamp| PoseFactorKey::Timestamp(*timestamp)).collect(),
        factor: Arc::new(factor),
        noise: Noise::sigma(sigma).unwrap(),
        loss: None,
    }
}

fn at_point(point: Vector3<f64>) -> Coordinates<3> {
    Coordinates::try_from(point.as_slice().to_vec()).unwrap()
}

fn add_all(
    settings: &RunSettings,
    sequence: &Sequence,
    frames: &[Observation],
) -> (Mapper, Vec<FrameReport>) {
    let mut mapper = Mapper::new(sequence.header(), settings);
    let reports = frames.iter().map(|frame| mapper.add_frame(frame).unwrap()).collect();
    (mapper, reports)
}

/// Returns the largest distance between the centres of equal objects, in metres.
fn largest_distance(a: &BTreeMap<ObjectId, Vector3<f64>>, b: &BTreeMap<ObjectId, Vector3<f64>>) -> f64 {
    assert!(a.len() >= 6 && a.keys().eq(b.keys()), "{:?} {:?}", a.keys(), b.keys());
    a.iter().map(|(id, centre)| (centre - b[id]).norm()).fold(0.0, f64::max)
}

fn centres(mapper: &Mapper) -> BTreeMap<ObjectId, Vector3<f64>> {
    mapper.objects().map(|(measured, quadric)| (measured.id, quadric.centroid())).collect()
}

/// Returns the distance of the last pose from the true one, in metres.
fn last_error(mapper: &Mapper, truth: &[Se3]) -> f64 {
    let last = truth.len() - 1;
    (mapper.pose_of(last).unwrap().translation - truth[last].translation).norm()
}

#[test]
fn a_loop_closure_brings_the_last_pose_and_the_objects_to_their_places() {
    let (settings, sequence) = scene(TABLE);
    let truth = true_poses(&sequence);
    let exact = add_all(&settings, &sequence, &with_odometry(&sequence, &truth)).0;
    let frames = with_odometry(&sequence, &drifted(&truth));
    let (open, _) = add_all(&settings, &sequence, &frames);
    let mut closed_frames = frames.clone();
    let (first, last) = (frames[0].frame.timestamp, frames[79].frame.timestamp);
    let closure = factor("loop", &[first, last], Between { relative: truth[0].between(&truth[79]) }, 1e-4);
    closed_frames[79].pose_graph.factors.push(closure);
    let (closed, reports) = add_all(&settings, &sequence, &closed_frames);
    assert!(reports.iter().all(|report| report.refused.is_empty()));
    let (before, after) = (last_error(&open, &truth), last_error(&closed, &truth));
    assert!(after < 0.005 && after < 0.2 * before, "{after} m after {before} m");
    let [before, after] = [&open, &closed].map(|mapper| largest_distance(&centres(mapper), &centres(&exact)));
    assert!(after < 0.5 * before, "{after} m after {before} m");
}

#[test]
fn objects_follow_corrected_poses_in_the_same_update() {
    let (settings, sequence) = scene(TABLE);
    let truth = true_poses(&sequence);
    let (wrong, mut frames) = (drifted(&truth), with_odometry(&sequence, &truth));
    for (observation, pose) in frames.iter_mut().zip(&wrong).take(60) {
        observation.frame.world_from_camera = *pose;
    }
    let stamped = |i: usize| StampedPose { timestamp: sequence.frames[i].timestamp, pose: truth[i] };
    frames[60].pose_graph.corrected = (0..60).step_by(5).chain([59]).map(stamped).collect();
    let (mut corrected, reports) = add_all(&settings, &sequence, &frames[..61]);
    assert!(reports.iter().all(|report| report.refused.is_empty()), "{:?}", reports[60].refused);
    let (exact, _) = add_all(&settings, &sequence, &with_odometry(&sequence, &truth)[..61]);
    let apart = largest_distance(&centres(&corrected), &centres(&exact));
    assert!(apart < 0.01, "{apart} m from the map of exact odometry");
    assert!(last_error(&corrected, &truth[..61]) < 0.01);
    // the final map begins with the corrected odometry as well
    let mut accepted = sequence.header().into_sequence();
    frames[..61].iter().for_each(|frame| accepted.push(frame.clone()));
    let cost = corrected.smoother().cost();
    let estimate = corrected.finish(Arc::new(accepted), &mut Silent).unwrap();
    assert!(estimate.solution.outcome.final_cost <= cost * 1.01, "{cost}");
}

#[test]
fn a_factor_is_replaced_and_removed_by_its_id() {
    let (settings, sequence) = scene(TABLE);
    let frames: Vec<Observation> = sequence.observations().take(12).collect();
    let at = |i: usize| frames[i].frame.timestamp;
    let (plain, _) = add_all(&settings, &sequence, &frames);
    let far = Se3::exp(&Vector6::new(0.0, 0.0, 0.0, 3.0, 0.0, 0.0));
    let pose = plain.pose_of(4).unwrap();
    let wrong = factor("marker", &[at(4)], Prior { value: pose.compose(&far) }, 0.01);
    let right = factor(
        "marker",
        &[at(4)],
        Position { position: at_point(pose.translation), lever_arm: at_point(Vector3::zeros()) },
        0.01,
    );
    let mut changed = frames.clone();
    changed[6].pose_graph.factors.push(wrong.clone());
    let (moved, _) = add_all(&settings, &sequence, &changed);
    assert!((moved.pose_of(4).unwrap().translation - pose.translation).norm() > 0.01);
    changed[8].pose_graph.factors.push(right);
    let (mut replaced, _) = add_all(&settings, &sequence, &changed);
    let apart = (replaced.pose_of(4).unwrap().translation - pose.translation).norm();
    assert!(apart < 1e-4, "{apart} m");
    let named = |mapper: &mut Mapper| {
        let (graph, _) = mapper.smoother().graph();
        graph.factors().iter().filter(|entry| entry.name.as_deref() == Some("marker")).count()
    };
    assert_eq!(named(&mut replaced), 1);
    changed[9].pose_graph.removed.push("marker".into());
    let (mut removed, reports) = add_all(&settings, &sequence, &changed);
    assert_eq!((named(&mut removed), reports[9].refused.len()), (0, 0));
    changed[10].pose_graph.removed.push("marker".into());
    let (_, reports) = add_all(&settings, &sequence, &changed);
    assert_eq!(reports[10].refused, ["`marker` cannot be removed: there is no such factor"]);
}

#[test]
fn changes_that_do_not_fit_are_refused_and_the_frame_stays() {
    let (settings, sequence) = scene(TABLE);
    let frames: Vec<Observation> = sequence.observations().take(10).collect();
    let at = |i: usize| frames[i].frame.timestamp;
    let between = || Between { relative: Se3::identity() };
    let of_object =
        PoseFactor { keys: vec![PoseFactorKey::Key("q1".into())], ..factor("a", &[], between(), 1.0) };
    let unknown =
        PoseFactor { keys: vec![PoseFactorKey::Key("shelf".into())], ..factor("b", &[], between(), 1.0) };
    let skewed = PoseFactor {
        noise: Noise::sigmas(&[1.0, 2.0]).unwrap(),
        ..factor("c", &[at(0), at(5)], between(), 1.0)
    };
    let stamped = |timestamp| StampedPose { timestamp, pose: Se3::identity() };
    let faults = [
        (PoseGraphChanges { factors: vec![of_object], ..Default::default() }, "`q1` may not be named here"),
        (
            PoseGraphChanges { factors: vec![unknown], ..Default::default() },
            "connects 2 variables, got 1 keys",
        ),
        (PoseGraphChanges { factors: vec![skewed], ..Default::default() }, "the noise has 2"),
        (
            PoseGraphChanges {
                factors: vec![factor("d", &[at(1), 99.0], between(), 1.0)],
                ..Default::default()
            },
            "there is no frame at 99 s (the nearest is at",
        ),
        (
            PoseGraphChanges {
                factors: vec![factor("e", &[at(1), at(1)], between(), 1.0)],
                ..Default::default()
            },
            "names the variable `x1` twice",
        ),
        (
            PoseGraphChanges { factors: vec![factor("f", &[], between(), 1.0)], ..Default::default() },
            "`keys` is empty",
        ),
        (
            PoseGraphChanges { corrected: vec![stamped(-5.0)], ..Default::default() },
            "there is no frame at -5 s",
        ),
        (
            PoseGraphChanges { corrected: vec![stamped(f64::NAN)], ..Default::default() },
            "there is no frame at NaN s",
        ),
    ];
    let (mut plain, _) = add_all(&settings, &sequence, &frames);
    let expected = mapped(&mut plain);
    for (changes, words) in faults {
        let mut changed = frames.clone();
        changed[7].pose_graph = changes;
        let (mut mapper, reports) = add_all(&settings, &sequence, &changed);
        let refused = &reports[7].refused;
        assert!(refused.len() == 1 && refused[0].contains(words), "{words}: {refused:?}");
        assert_eq!(mapped(&mut mapper), expected, "{words}");
    }
}

#[test]
fn a_closure_to_a_pose_outside_of_the_window_counts_in_the_final_map() {
    let run = run_of(TABLE, &["online.window.poses=20"]);
    let settings = &run.variants[0].settings;
    let sequence = settings.source.load(&Default::default()).unwrap();
    let mut frames: Vec<Observation> = sequence.observations().collect();
    let relative = true_poses(&sequence)[0].between(&true_poses(&sequence)[79]);
    let (first, last) = (frames[0].frame.timestamp, frames[79].frame.timestamp);
    frames[79].pose_graph.factors.push(factor("loop", &[first, last], Between { relative }, 0.01));
    let (mapper, reports) = add_all(settings, &sequence, &frames);
    assert!(reports[79].refused[0].contains("the pose x0 has left the window"), "{:?}", reports[79].refused);
    let accepted = Arc::new(sequence_of(&sequence, frames));
    let estimate = mapper.finish(accepted, &mut Silent).unwrap();
    let entries = estimate.mapping.graph.factors();
    assert_eq!(entries.iter().filter(|entry| entry.name.as_deref() == Some("loop")).count(), 1);
}

#[test]
fn a_step_has_the_noise_of_its_frame() {
    let (settings, sequence) = scene(TABLE);
    let mut frames: Vec<Observation> = sequence.observations().take(5).collect();
    let noise = Noise::sigmas(&[0.1, 0.1, 0.1, 0.2, 0.2, 0.2]).unwrap();
    frames[3].frame.odometry_noise = Some(Arc::new(noise.clone()));
    let (mut mapper, _) = add_all(&settings, &sequence, &frames);
    let (graph, _) = mapper.smoother().graph();
    let of_step =
        |to: &str| graph.factors().iter().find(|e| e.keys.len() == 2 && e.keys[1].as_str() == to).unwrap();
    assert_eq!(of_step("x3").noise, noise);
    assert_eq!(of_step("x2").noise, settings.odometry.noise);
}

#[test]
fn a_step_with_its_own_noise_keeps_it_when_the_rest_is_estimated() {
    let text =
        TABLE.replace("frames = 80 }", "frames = 80 }, odometry = { rotation = 0.1, translation = 0.1 }");
    let run = run_of(&format!("{text}variance_components = {{ prefix_s = 2.0 }}"), &[]);
    let settings = &run.variants[0].settings;
    let sequence = settings.source.load(&Default::default()).unwrap();
    let noise = Noise::sigmas(&[0.1, 0.1, 0.1, 0.2, 0.2, 0.2]).unwrap();
    let noise_of_steps = |given: &[usize]| {
        let mut frames: Vec<Observation> = sequence.observations().collect();
        given.iter().for_each(|i| frames[*i].frame.odometry_noise = Some(Arc::new(noise.clone())));
        let (mut mapper, _) = add_all(settings, &sequence, &frames);
        let estimated = StreamNoise::estimate(sequence_of(&sequence, frames.clone()), settings, &mut Silent);
        mapper.set_noise(&estimated.unwrap().expect("there are enough objects")).unwrap();
        let (graph, _) = mapper.smoother().graph();
        let of_step = |graph: &Graph, to: &str| {
            let mut steps = graph.factors().iter().filter(|e| e.keys.len() == 2 && e.keys[1].as_str() == to);
            steps.next().unwrap().noise.clone()
        };
        let online = ["x3", "x4"].map(|to| of_step(&graph, to));
        let estimate = mapper.finish(Arc::new(sequence_of(&sequence, frames)), &mut Silent).unwrap();
        let last = ["x3", "x4"].map(|to| of_step(&estimate.mapping.graph, to));
        (online, last, estimate.components.last().unwrap().odometry)
    };
    let (online, last, odometry) = noise_of_steps(&[3]);
    assert!(online[0] == noise && last[0] == noise && odometry.is_some());
    assert!(online[1] != noise && last[1] != noise && last[1] != settings.odometry.noise);
    let all: Vec<usize> = (1..80).collect();
    let (online, last, odometry) = noise_of_steps(&all);
    assert!(online.iter().chain(&last).all(|of_step| *of_step == noise));
    assert_eq!(odometry, None, "there is nothing to estimate");
}

/// A document of TABLE with frames from a file, and more fields of its source.
fn document_of_lines(folder: &Path, lines: &[String], more: &str) -> RunDocument {
    std::fs::write(folder.join("frames.jsonl"), lines.join("\n")).unwrap();
    let camera = "{ fx = 320.0, fy = 320.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }";
    let source = format!(
        r#"source = {{ type = "json_lines", camera = {camera}, file = "frames.jsonl", up = [0, 0, 1]{more} }}"#
    );
    let lines = TABLE.lines().map(|line| if line.starts_with("source") { &source } else { line });
    let mut run = run_of(&lines.collect::<Vec<_>>().join("\n"), &[]);
    run.folder = folder.into();
    run
}

#[test]
fn images_between_poses_give_the_map_of_images_with_poses() {
    let (_, sequence) = scene(&TABLE.replace("frames = 80", "frames = 240, interval = 0.03"));
    let is_image = |i: usize| i % 3 == 1;
    let frames: Vec<(usize, Observation)> = sequence.observations().enumerate().collect();
    let exact: Vec<String> =
        frames.iter().filter(|(i, _)| is_image(*i)).map(|(_, frame)| format_line(frame)).collect();
    let split = |(i, frame): &(usize, Observation)| {
        let mut line: serde_json::Value = serde_json::from_str(&format_line(frame)).unwrap();
        let field = if is_image(*i) { "pose" } else { "boxes" };
        line.as_object_mut().unwrap().remove(field);
        line.to_string()
    };
    let mut apart: Vec<String> = frames.iter().map(split).collect();
    // no pose follows this image
    apart.push(r#"{"timestamp": 99.0, "boxes": [{"box": [1, 1, 9, 9]}]}"#.into());
    let map = |lines: &[String], more: &str| {
        let folder = tempfile::tempdir().unwrap();
        let run = document_of_lines(folder.path(), lines, more);
        let (estimate, report) = Run::new(&run, None).run_variant(&run.variants[0], &mut Silent).unwrap();
        let centres: BTreeMap<ObjectId, Vector3<f64>> =
            estimate.landmarks().iter().map(|l| (l.object.id, l.quadric.centroid())).collect();
        (estimate.sequence.frames.len(), centres, report.warnings)
    };
    let (count, expected, _) = map(&exact, "");
    let (found, centres, warnings) = map(&apart, ", max_pose_gap = 0.1");
    assert_eq!((count, found), (80, 80));
    let distance = largest_distance(&centres, &expected);
    assert!(distance < 0.01, "{distance} m");
    let text = warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ");
    assert!(text.contains("images without a pose are left out: 1, with 1 boxes"), "{text}");
}

/// Writes a document of lines with closures, corrections and a bad factor.
fn write_lines(folder: &Path) -> RunDocument {
    let (_, sequence) = scene(TABLE);
    let truth = true_poses(&sequence);
    let mut frames = with_odometry(&sequence, &drifted(&truth));
    let at = |i: usize| frames[i].frame.timestamp;
    let closure = factor("loop", &[at(0), at(40)], Between { relative: truth[0].between(&truth[40]) }, 0.01);
    let early = factor("early", &[at(0), 99.0], Between { relative: Se3::identity() }, 0.01);
    let corrected = StampedPose { timestamp: at(50), pose: truth[50] };
    frames[40].pose_graph.factors.extend([closure, early]);
    frames[60].pose_graph.corrected.push(corrected);
    frames[70].pose_graph.removed.push("loop".into());
    let lines: Vec<String> = frames.iter().map(format_line).collect();
    document_of_lines(folder, &lines, "")
}

#[test]
fn lines_give_the_same_graph_to_a_batch_and_a_stream_also_from_a_journal() {
    let folder = tempfile::tempdir().unwrap();
    let run = write_lines(folder.path());
    let variant = &run.variants[0];
    let batch = Run::new(&run, None).run_variant(variant, &mut Silent).unwrap().0;
    let stream = |journal: Option<&str>| {
        let mut run = Run::new(&run, None);
        if let Some(journal) = journal {
            run.journal_frames(folder.path().join(journal));
        }
        let mut reports = crate::online::CollectedReports::default();
        let (estimate, report) = run.run_variant_online(variant, &mut reports).unwrap();
        (estimate, report, reports)
    };
    let (estimate, report, reports) = stream(None);
    let names = |estimate: &Estimate| -> Vec<String> {
        let named = estimate.mapping.graph.factors().iter().filter_map(|entry| entry.name.clone());
        named.map(|name| name.to_string()).collect()
    };
    assert_eq!(names(&estimate), names(&batch));
    let refused: Vec<&String> = reports.reports().iter().flat_map(|report| &report.refused).collect();
    assert!(refused.len() == 1 && refused[0].contains("`early` is left out"), "{refused:?}");
    let warned = report.warnings.iter().any(|warning| warning.to_string().contains("`early` at"));
    assert!(warned, "{:?}", report.warnings);
    // a program that ended after any number of frames goes on with the same bits
    let text = |estimate: &Estimate| {
        let values = estimate.solution.values.iter();
        values
            .map(|(key, value)| format!("{key} {}", serde_json::to_string(value).unwrap()))
            .collect::<Vec<_>>()
    };
    let whole = stream(Some("whole.jsonl")).0;
    let journal = std::fs::read(folder.path().join("whole.jsonl")).unwrap();
    for share in [3, 5, 7] {
        let cut = format!("cut{share}.jsonl");
        std::fs::write(folder.path().join(&cut), &journal[..journal.len() * share / 8]).unwrap();
        assert_eq!(text(&stream(Some(&cut)).0), text(&whole));
    }
}

/// Faulty values of fields, with a word of the message.
const FAULTS: &[(&str, &str, &str)] = &[
    ("timestamp", "null", "f64"),
    ("timestamp", "\"1\"", "f64"),
    ("timestamp", "-7.0", "does not come after"),
    ("pose", "{}", "translation"),
    ("pose", "{\"translation\": [0, 0, null], \"rotation\": [0, 0, 0, 1]}", "f64"),
    ("pose", "{\"translation\": [0, 0, 0], \"rotation\": [0, 0, 0, 0]}", "quaternion"),
    ("pose", "7", "expected"),
    ("surprise", "1", "surprise"),
    ("odometry_noise", "{\"sigma\": 0}", "above zero"),
    ("odometry_noise", "{\"sigma\": NaN}", "null"),
    ("odometry_noise", "{\"sigmas\": [1, 1, 1]}", "the noise has 3"),
    ("odometry_noise", "{\"covariance\": [[1, 2], [2, 1]]}", "positive definite"),
    ("odometry_noise", "{\"covariance\": [[1, 0], [1, 1]]}", "symmetric"),
    ("odometry_noise", "{\"sigma\": 1, \"sigmas\": [1]}", "expected one of"),
    ("odometry_noise", "\"small\"", "odometry_noise"),
    ("factors", "7", "expected a list"),
    ("factors", "[null]", "factors 1"),
    ("factors", "[{}]", "keys"),
    ("factors", "[{\"keys\": [true], \"factor\": BETWEEN, \"noise\": {}}]", "the timestamp of a frame"),
    ("factors", "[{\"keys\": [], \"factor\": BETWEEN, \"noise\": {}}]", "`keys` is empty"),
    ("factors", "[{\"keys\": [0.0, 77.0], \"factor\": BETWEEN, \"noise\": {}}]", "no frame at 77 s"),
    ("factors", "[{\"keys\": [0.0, NaN], \"factor\": BETWEEN, \"noise\": {}}]", "the timestamp of a frame"),
    ("factors", "[{\"keys\": [0.0], \"factor\": BETWEEN, \"noise\": {}}]", "connects 2 variables"),
    ("factors", "[{\"keys\": [0.0, 0.0], \"factor\": BETWEEN, \"noise\": {}}]", "twice"),
    ("factors", "[{\"keys\": [0.0, \"q1\"], \"factor\": BETWEEN, \"noise\": {}}]", "may not be named here"),
    ("factors", "[{\"keys\": [0.0, \"door\"], \"factor\": BETWEEN, \"noise\": {}}]", "door"),
    ("factors", "[{\"keys\": [0.0, 0.1], \"factor\": {\"type\": \"closure\"}, \"noise\": {}}]", "closure"),
    (
        "factors",
        "[{\"keys\": [0.0, 0.1], \"factor\": {\"type\": \"between_se3\"}, \"noise\": {}}]",
        "relative",
    ),
    ("factors", "[{\"keys\": [0.0, 0.1], \"factor\": BETWEEN}]", "noise"),
    ("factors", "[{\"keys\": [0.0, 0.1], \"factor\": BETWEEN, \"noise\": {\"sigma\": -1}}]", "above zero"),
    (
        "factors",
        "[{\"keys\": [0.0, 0.1], \"factor\": BETWEEN, \"noise\": {\"sigmas\": [1, 1]}}]",
        "the noise has 2",
    ),
    (
        "factors",
        "[{\"keys\": [0.0, 0.1], \"factor\": BETWEEN, \"noise\": {}, \"loss\": {\"type\": \"hubert\"}}]",
        "hubert",
    ),
    ("factors", "[{\"id\": 7, \"keys\": [0.0, 0.1], \"factor\": BETWEEN, \"noise\": {}}]", "factors 1"),
    ("removed", "[\"nothing\"]", "no such factor"),
    ("removed", "[7]", "removed 1"),
    ("removed", "\"loop\"", "expected a list"),
    ("corrected", "[{\"timestamp\": 99.0, \"pose\": POSE}]", "no frame at 99 s"),
    ("corrected", "[{\"timestamp\": 0.0}]", "pose"),
    ("corrected", "[{\"timestamp\": NaN, \"pose\": POSE}]", "corrected 1"),
    ("corrected", "{}", "expected a list"),
];

#[test]
fn a_faulty_field_of_a_line_is_reported_and_the_frames_around_it_stay() {
    let (settings, sequence) = scene(TABLE);
    let lines: Vec<String> = sequence.observations().take(12).map(|frame| format_line(&frame)).collect();
    let pose = r#"{"translation": [0, 0, 0], "rotation": [0, 0, 0, 1]}"#;
    let between = format!(r#"{{"type": "between_se3", "relative": {pose}}}"#);
    for (place, (field, value, words)) in
        [3, 6, 10].into_iter().flat_map(|i| FAULTS.iter().map(move |f| (i, f)))
    {
        let value = value.replace("BETWEEN", &between).replace("POSE", pose);
        let mut line: serde_json::Map<String, serde_json::Value> =
            serde_json::from_str(&lines[place]).unwrap();
        line.insert((*field).into(), "REPLACED".into());
        let faulty = serde_json::to_string(&line).unwrap().replace("\"REPLACED\"", &value);
        let mut mapper = Mapper::new(sequence.header(), &settings);
        let (mut messages, mut accepted) = (vec![], 0);
        for (i, line) in lines.iter().enumerate() {
            let line = if i == place { &faulty } else { line };
            match parse(line.as_bytes(), &sequence.cameras).map(|frame| mapper.add_frame(&frame)) {
                Ok(Ok(report)) => {
                    accepted += 1;
                    messages.extend(report.refused);
                }
                Ok(Err(error)) => messages.push(error.to_string()),
                Err(error) => messages.push(error),
            }
        }
        assert!(messages.len() == 1 && messages[0].contains(words), "{field} {value}: {messages:?}");
        let is_whole = !["timestamp", "pose", "surprise"].contains(field);
        assert_eq!(accepted, if is_whole { 12 } else { 11 }, "{field} {value}");
    }
}
