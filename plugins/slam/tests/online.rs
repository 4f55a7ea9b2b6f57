//! Online mapping, compared with the batch solve.
use crate::tum::{data, document};
use manifactor_config::{Document, Format};
use manifactor_geometry::Se3;
use manifactor_quadric::BoundingBox;
use manifactor_slam::mapping::Mapping;
use manifactor_slam::online::{FrameError, FrameReport, Mapper};
use manifactor_slam::report::VariantReport;
use manifactor_slam::run::{MappedFrame, Run, StreamEvent, StreamWatcher};
use manifactor_slam::run_document::{RunDocument, RunVariant};
use manifactor_slam::sequence::{
    Acceleration, ClassScores, Detection, Frame, ObjectId, Observation, Sequence,
};
use manifactor_slam::settings::{CutSides, RunSettings};
use manifactor_slam::source::InputFolders;
use manifactor_solve::Silent;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Collects the reports of all frames.
#[derive(Default)]
pub(crate) struct CollectedReports(Vec<FrameReport>);

impl CollectedReports {
    pub(crate) fn reports(&self) -> &[FrameReport] {
        &self.0
    }
}

impl StreamWatcher for CollectedReports {
    fn event(&mut self, event: StreamEvent<'_>) -> ControlFlow<()> {
        let StreamEvent::Frame(MappedFrame { report, .. }) = event else { return ControlFlow::Continue(()) };
        self.0.push(report.unwrap().clone());
        ControlFlow::Continue(())
    }
}

/// Checks the map after each frame, and after the last.
#[derive(Default)]
struct MapChecks {
    frames: usize,
    ends: usize,
    iterations: usize,
}

impl StreamWatcher for MapChecks {
    fn event(&mut self, event: StreamEvent<'_>) -> ControlFlow<()> {
        let MappedFrame { report, observation, mapper, .. } = match event {
            StreamEvent::Frame(frame) => frame,
            StreamEvent::LastFrame { mapper } => {
                assert!(mapper.pose_of(0).is_some() && mapper.up().is_some());
                self.ends += 1;
                return ControlFlow::Continue(());
            }
            StreamEvent::Iteration(_) => {
                self.iterations += 1;
                return ControlFlow::Continue(());
            }
            _ => return ControlFlow::Continue(()),
        };
        let (report, observation) = (report.unwrap(), observation.unwrap());
        assert_eq!(report.box_objects.len(), observation.detections.len());
        assert_eq!(mapper.objects().count(), mapper.mapped_objects());
        assert_eq!(mapper.pose_of(report.frame), Some(report.pose));
        assert_eq!(mapper.pose_of(report.frame + 1), None);
        // odometry drifts away from the estimate, frame by frame
        let apart = (mapper.odometry(observation).unwrap().translation - report.pose.translation).norm();
        assert!(apart < if report.frame == 0 { 1e-9 } else { 1.0 }, "{apart} m at frame {}", report.frame);
        self.frames += 1;
        ControlFlow::Continue(())
    }
}

#[test]
fn the_map_can_be_looked_at_after_each_frame_and_has_all_poses_with_a_window() {
    let document = run_of(DESK, &["online.window.poses=20"]);
    let mut looking = MapChecks::default();
    let mut run = Run::new(&document, None);
    run.run_variant_online(&document.variants[0], &mut looking).unwrap();
    assert_eq!((looking.frames, looking.ends), (80, 1));
    assert!(looking.iterations > 0, "the final solve");
}

/// A desk, and a camera that moves around it.
const DESK: &str = r#"
semantics = "table_one"
source = { type = "simulated", scene = { objects = 8 }, trajectory = { frames = 80 } }
odometry = { noise = { sigma = 0.01 } }
detections = { loss = { type = "cauchy", scale = 2.8 } }
"#;

pub(crate) fn run_of(text: &str, sets: &[&str]) -> RunDocument {
    let mut document = Document::parse("desk.toml", text, Format::Toml).unwrap();
    document.set(sets).unwrap();
    RunDocument::read(&document).unwrap()
}

pub(crate) fn both(
    run: &RunDocument,
    variant: &RunVariant,
    data: Option<PathBuf>,
) -> (VariantReport, VariantReport, CollectedReports) {
    let (mut kept, mut run) = (CollectedReports::default(), Run::new(run, data));
    let (_, online) = run.run_variant_online(variant, &mut kept).unwrap();
    // a stream adds a weak prior for the shape of all objects
    let batch = RunVariant { settings: variant.settings.clone().for_stream(), ..variant.clone() };
    let (_, batch) = run.run_variant(&batch, &mut Silent).unwrap();
    (online, batch, kept)
}

/// Returns the settings of a document without variants, and its sequence.
pub(crate) fn scene(text: &str) -> (RunSettings, Sequence) {
    let settings = run_of(text, &[]).variants.remove(0).settings;
    let sequence = settings.source.load(&InputFolders::default()).unwrap();
    (settings, sequence)
}

/// Returns the estimate after these frames as text with all digits.
pub(crate) fn mapped(mapper: &mut Mapper) -> String {
    let values = mapper.smoother().estimates();
    values.iter().map(|(key, value)| format!("{key} {}\n", serde_json::to_string(value).unwrap())).collect()
}

fn add_all_frames(settings: &RunSettings, sequence: &Sequence) -> Mapper {
    let mut mapper = Mapper::new(sequence.header(), settings);
    for observation in sequence.observations() {
        mapper.add_frame(&observation).unwrap();
    }
    mapper
}

#[test]
fn a_map_that_grew_ends_as_the_batch_does() {
    let run = run_of(DESK, &[]);
    let (online, batch, kept) = both(&run, &run.variants[0], None);
    assert_eq!((online.counts, online.counts.frames), (batch.counts, 80));
    let (found, expected) = (online.solve.final_cost, batch.solve.final_cost);
    assert!(found <= expected * (1.0 + 1e-3), "{found} {expected}");
    let stream = online.online.unwrap();
    let initialized: usize = kept.0.iter().map(|frame| frame.initialized.len()).sum();
    assert_eq!(
        (stream.initialized, stream.objects, stream.refusals),
        (initialized, initialized - stream.removed, 0)
    );
    assert!(initialized >= 4, "objects come before the end: {initialized} of {}", online.counts.objects);
    // the live estimate differs from the final one, but not by much
    let (live, end) = (stream.trajectory[0].estimate.ate.rmse, online.trajectory[0].estimate.ate.rmse);
    assert!(live < 4.0 * end.max(0.01), "{live} {end}");
}

#[test]
fn the_same_frames_give_the_same_bits() {
    let (settings, sequence) = scene(DESK);
    let (mut one, mut other) = (add_all_frames(&settings, &sequence), add_all_frames(&settings, &sequence));
    assert_eq!(mapped(&mut one), mapped(&mut other));
}

#[test]
fn a_frame_that_cannot_be_taken_leaves_no_trace() {
    let (settings, sequence) = scene(DESK);
    let mut expected = add_all_frames(&settings, &sequence);
    let mut mapper = Mapper::new(sequence.header(), &settings);
    for (i, observation) in sequence.observations().enumerate() {
        let mut bad = observation.clone();
        bad.frame.world_from_camera.translation.x = f64::NAN;
        assert!(matches!(mapper.add_frame(&bad), Err(FrameError::NotFinite { .. })));
        mapper.add_frame(&observation).unwrap();
        let error = mapper.add_frame(&observation).unwrap_err();
        assert!(matches!(error, FrameError::Timestamp { .. }), "{error}");
        if i == 0 {
            assert!(error.to_string().contains("does not come after the one before"), "{error}");
        }
    }
    assert_eq!(mapped(&mut mapper), mapped(&mut expected));
}

#[test]
fn a_rule_without_up_is_refused_at_the_first_frame() {
    let (settings, mut sequence) = scene(DESK);
    sequence.up = None;
    let mut mapper = Mapper::new(sequence.header(), &settings);
    let first: Observation = sequence.observations().next().unwrap();
    let error = mapper.add_frame(&first).unwrap_err().to_string();
    assert!(error.contains("set `[gravity]`"), "{error}");
}

#[test]
fn an_object_of_several_things_is_removed_again_and_does_not_come_back() {
    let (settings, mut sequence) = scene(DESK);
    let mut objects: Vec<ObjectId> = sequence.detections.iter().filter_map(|d| d.object).collect();
    objects.sort_unstable();
    objects.dedup();
    // from the middle on, one number stands for two objects
    let (one, other) = (objects[0], objects[1]);
    for detection in sequence.detections.iter_mut().filter(|d| d.frame > 40 && d.object == Some(other)) {
        detection.object = Some(one);
        let bounds = detection.bounding_box.bounds();
        detection.bounding_box.xmax = bounds[0] + 4.0 * (bounds[2] - bounds[0]);
    }
    let mut mapper = Mapper::new(sequence.header(), &settings);
    let (mut initialized, mut removed) = (vec![], vec![]);
    for observation in sequence.observations() {
        let report = mapper.add_frame(&observation).unwrap();
        assert_eq!(report.refused, Vec::<String>::new());
        initialized.extend(report.initialized);
        removed.extend(report.removed);
    }
    let key = format!("q{one}");
    assert_eq!(initialized.iter().filter(|added| added.as_str() == key).count(), 1, "{initialized:?}");
    assert!(removed.iter().any(|gone| gone.as_str() == key), "{removed:?}");
    assert!(mapper.smoother().estimate(&key).is_none());
}

#[test]
fn an_object_whose_class_changes_gets_the_factors_of_the_other() {
    let (settings, mut sequence) = scene(DESK);
    let upright = |class: &str| ["bottle", "cup", "vase", "chair"].contains(&class);
    let id =
        sequence.detections.iter().find(|d| d.scores.best().is_some_and(|b| upright(b.0))).unwrap().object;
    for detection in sequence.detections.iter_mut().filter(|d| d.object == id) {
        let (class, score) = if detection.frame < 40 { ("cup", 0.3) } else { ("book", 0.9) };
        detection.scores = ClassScores::single(class, score);
    }
    let mut mapper = Mapper::new(sequence.header(), &settings);
    let revised: usize = sequence.observations().map(|o| mapper.add_frame(&o).unwrap().revised.len()).sum();
    assert!(revised >= 1);
    let (graph, _) = mapper.smoother().graph();
    let key = format!("q{}", id.unwrap());
    let rules = graph.factors().iter().filter(|f| f.keys.len() == 1 && f.keys[0].as_str() == key);
    let rules: Vec<&str> = rules.map(|f| f.factor.typetag_name()).collect();
    assert_eq!(rules, ["horizontal_orientation", "shape_prior"]);
}

#[test]
fn a_window_keeps_objects_and_lets_poses_go() {
    for window in ["{ poses = 12 }", "{ seconds = 1.0 }"] {
        let (settings, sequence) = scene(&format!("{DESK}\n[online]\nwindow = {window}"));
        let mut mapper = Mapper::new(sequence.header(), &settings);
        for observation in sequence.observations() {
            let report = mapper.add_frame(&observation).unwrap();
            assert_eq!(report.refused, Vec::<String>::new(), "{window}");
        }
        let keys = mapper.smoother().estimates();
        let poses = keys.iter().filter(|(key, _)| key.as_str().starts_with('x')).count();
        assert!((2..40).contains(&poses), "{window}: {poses}");
        assert_eq!(keys.len() - poses, mapper.mapped_objects());
        // the batch at the end has all frames again
        let estimate = mapper.finish(sequence.clone().into(), &mut Silent).unwrap();
        assert_eq!(estimate.trajectory().len(), 80);
    }
}

#[test]
fn rejected_boxes_are_reported_and_the_pose_is_accepted() {
    let (mut settings, sequence) = scene(DESK);
    settings.detections.cut_sides = CutSides::Keep;
    let mut mapper = add_all_frames(&settings, &sequence);
    let mapped = mapper.mapped_objects();
    let keys = mapper.smoother().estimates();
    let id = keys.iter().find_map(|(key, _)| key.as_str().strip_prefix('q')?.parse().ok()).unwrap();
    let mut frame = sequence.frames.last().unwrap().clone();
    frame.timestamp += 1.0;
    // its square is infinite
    let bounding_box = BoundingBox { xmin: 1e200, ymin: 1e200, xmax: 2e200, ymax: 2e200 };
    let (camera, scores) = (sequence.cameras.first().clone(), ClassScores::single("cup", 0.5));
    let far = Detection { object: Some(ObjectId(id)), ..Detection::new(camera, bounding_box, scores) };
    let measured = mapper.measurements().clone();
    let taken = mapper.add_frame(&Observation { detections: vec![far], ..Observation::new(frame) }).unwrap();
    assert!(taken.refused.len() == 1 && taken.refused[0].starts_with("the boxes at"), "{:?}", taken.refused);
    assert_eq!(taken.box_objects, [None], "they are of no object");
    assert_eq!(*mapper.measurements(), measured);
    assert_eq!((taken.frame, mapper.mapped_objects()), (80, mapped));
    assert!(mapper.smoother().estimate("x80").is_some());
}

#[test]
fn a_pose_that_cannot_be_taken_is_an_error_and_the_stream_goes_on() {
    let (settings, sequence) = scene(DESK);
    let mut mapper = add_all_frames(&settings, &sequence);
    let last = sequence.observations().last().unwrap();
    let mut frame = last.frame.clone();
    frame.timestamp += 1.0;
    // the jump of the camera is too large to be squared
    frame.world_from_camera = Se3::new(frame.world_from_camera.rotation, nalgebra::Vector3::repeat(1e200));
    let detections: Vec<Detection> = last.detections;
    let taken = mapper.add_frame(&Observation { detections, ..Observation::new(frame) });
    assert!(matches!(taken, Err(FrameError::Update(_))), "{taken:?}");
    // the stream continues from the frame before
    let mut next = sequence.frames.last().unwrap().clone();
    next.timestamp += 2.0;
    let taken = mapper.add_frame(&Observation::new(next)).unwrap();
    assert_eq!((taken.frame, taken.refused.len()), (80, 0));
}

#[test]
fn a_pose_that_overflows_leaves_nothing_behind_in_the_smoother() {
    let (settings, sequence) = scene(DESK);
    let mut mapper = add_all_frames(&settings, &sequence);
    let mut frame = sequence.frames.last().unwrap().clone();
    let start = frame.timestamp;
    frame.world_from_camera.translation = nalgebra::Vector3::repeat(f64::MAX);
    let observation =
        |frame: &Frame, seconds: f64| Observation::new(Frame { timestamp: start + seconds, ..frame.clone() });
    let taken = mapper.add_frame(&observation(&frame, 2.0));
    assert!(matches!(taken, Err(FrameError::NotFinite { .. })), "{taken:?}");
    mapper.smoother().save().unwrap();
    // its timestamp is ignored
    mapper.add_frame(&observation(sequence.frames.last().unwrap(), 1.0)).unwrap();
}

#[test]
fn a_frame_that_is_refused_does_not_say_which_way_is_up() {
    let text = format!("{DESK}\n[gravity]\ntype = \"accelerometer\"\n");
    let (settings, sequence) = scene(&text);
    let (up, sideways) = (nalgebra::Vector3::new(0.0, -9.8, 0.0), nalgebra::Vector3::new(9.8, 0.0, 0.0));
    let mut pushed = sequence.header().into_sequence();
    for mut observation in sequence.observations() {
        let timestamp = observation.frame.timestamp;
        observation.accelerometer = vec![Acceleration { timestamp, acceleration: up }];
        pushed.push(observation);
    }
    let mut expected = add_all_frames(&settings, &pushed);
    let mut mapper = Mapper::new(pushed.header(), &settings);
    for observation in pushed.observations() {
        mapper.add_frame(&observation).unwrap();
        let mut bad = observation.clone();
        bad.frame.timestamp += 1e-3;
        bad.frame.world_from_camera.translation = nalgebra::Vector3::repeat(1e200);
        bad.accelerometer = vec![Acceleration { timestamp: bad.frame.timestamp, acceleration: sideways }];
        mapper.add_frame(&bad).unwrap_err();
    }
    assert_eq!(mapped(&mut mapper), mapped(&mut expected));
}

#[test]
fn up_that_is_felt_is_settled_as_in_a_batch() {
    let Some(data) = data() else { return };
    let sets =
        ["gravity = { type = 'accelerometer', window = 5.0, camera_from_sensor = [0.0, 0.0, 1.0, 0.0] }"];
    let run = document("fr1_desk.toml", &sets);
    let variant = run.variants.iter().find(|v| v.name == "Q+O C").unwrap();
    let sequence = Run::new(&run, Some(data.clone())).sequence(variant).unwrap();
    let batch = Mapping::new(&sequence, &variant.settings).unwrap();
    let (online, _, kept) = both(&run, variant, Some(data));
    assert_eq!(online.up.unwrap(), batch.frame.up.unwrap());
    assert!(kept.0.iter().all(|frame| frame.refused.is_empty()));
}

#[test]
fn a_desk_of_real_boxes_is_mapped_as_they_come() {
    let Some(data) = data() else { return };
    assert!(Path::new(&data).is_dir());
    for name in ["Q C", "Q+O C"] {
        let run = document("fr1_desk.toml", &[]);
        let variant = run.variants.iter().find(|v| v.name == name).unwrap();
        let (online, batch, _) = both(&run, variant, Some(data.clone()));
        assert_eq!((online.counts.objects, online.counts.boxes), (15, 598), "{name}");
        let (found, expected) = (online.solve.final_cost, batch.solve.final_cost);
        assert!(found <= expected * 1.01, "{name}: {found} {expected}");
        let stream = online.online.unwrap();
        assert_eq!((stream.refusals, stream.solved_batch), (0, 0), "{name}");
        assert!(stream.removed > 0, "boxes of several things: {name}");
        let live = stream.trajectory[0].estimate.ate.rmse;
        assert!(live < 0.025, "{name}: {live}");
    }
}

fn root() -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the settings that `docs/association.md` recommends for streams.
fn recommended() -> RunSettings {
    let page = std::fs::read_to_string(root().join("docs/association.md")).unwrap();
    let mut blocks = page.split("```toml\n").skip(1).filter_map(|block| block.split("```").next());
    let block = blocks.find(|block| block.contains("json_lines")).unwrap();
    run_of(block, &[]).variants.remove(0).settings
}

#[test]
fn no_object_collapses_or_runs_away_while_a_stream_comes() {
    let settings = recommended();
    let mut without = settings.clone();
    without.semantics.retain(|rule| rule.factor.factor_type() != "shape_prior");
    assert_eq!(without.semantics.len() + 1, settings.semantics.len());
    // a weak one is the default
    [settings, without.for_stream()].iter().for_each(keeps_shapes);
}

fn keeps_shapes(settings: &RunSettings) {
    let desk = std::fs::read_to_string(root().join("examples/desk/desk.toml")).unwrap();
    let (_, sequence) = scene(&desk);
    let sequence = Sequence {
        // no object numbers from the source
        detections: sequence.detections.iter().map(|d| Detection { object: None, ..d.clone() }).collect(),
        ..sequence
    };
    let mut mapper = Mapper::new(sequence.header(), settings);
    let mut most = 0;
    for observation in sequence.observations() {
        let report = mapper.add_frame(&observation).unwrap();
        for (measured, quadric) in mapper.objects() {
            let (least, largest) = (quadric.semi_axes.min(), quadric.semi_axes.max());
            assert!(
                least > 0.005 && largest < 2.0,
                "frame {}, {}: {}",
                report.frame,
                measured.id,
                quadric.semi_axes
            );
        }
        most = most.max(mapper.mapped_objects());
    }
    assert!(most >= 15, "{most} objects of 18");
}
