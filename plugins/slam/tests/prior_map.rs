//! Runs that begin with the map of an earlier run.
use manifactor_config::{Document, Format};
use manifactor_geometry::Se3;
use manifactor_graph::Direction;
use manifactor_quadric::{BoundingBox, QuadricPrior};
use manifactor_slam::output::map_of;
use manifactor_slam::output::{write_variant, write_whole};
use manifactor_slam::prior_map::{PriorMap, PriorObject};
use manifactor_slam::record::VariantRecord;
use manifactor_slam::report::{PriorMapReport, VariantReport};
use manifactor_slam::run::{MappedFrame, MappedSequence, StreamEvent, StreamWatcher, estimate, online};
use manifactor_slam::run_document::RunDocument;
use manifactor_slam::sequence::{ObjectId, Sequence};
use manifactor_slam::settings::RunSettings;
use manifactor_slam::source::InputFolders;
use manifactor_solve::Silent;
use nalgebra::Vector3;
use std::ops::{ControlFlow, Range};
use std::path::Path;
use std::sync::Arc;

/// A table with objects of a few classes, and a detector with errors that gives no object numbers.
const TABLE: &str = r#"
semantics = "table_one"
association = { type = "likelihood" }
odometry = { noise = { sigma = 0.005 } }
detections = { noise = { sigma = 6.0 }, loss = { type = "cauchy", scale = 1.0 } }

[source]
type = "simulated"
seed = 1
scene = { objects = 12, seed = 6, classes = ["bottle", "book", "cup"], gap = 0.05, area = [1.6, 1.2] }
trajectory = { frames = 240, seed = 1 }
detector = { missed = 0.1, misclassified = 0.05, sigma_px = 3.0 }
"#;

/// A second walk around this table.
const AGAIN: [&str; 2] = ["source.seed=2", "source.trajectory.seed=2"];

pub(crate) fn settings(sets: &[&str]) -> RunSettings {
    let mut document = Document::parse("table.toml", TABLE, Format::Toml).unwrap();
    document.set(sets).unwrap();
    RunDocument::read(&document).unwrap().variants.remove(0).settings
}

pub(crate) fn sequence(settings: &RunSettings) -> Arc<Sequence> {
    Arc::new(settings.source.load(&InputFolders::default()).unwrap())
}

/// Returns some of the frames; the odometry begins at the first of them.
fn part_of_sequence(all: &Sequence, frames: Range<usize>) -> Arc<Sequence> {
    let (mut part, first) = (all.header().into_sequence(), all.frames[frames.start].world_from_camera);
    part.up = all.up.map(|up| Direction::new(first.rotation.inverse().act(&up)).unwrap());
    for mut observation in all.observations().skip(frames.start).take(frames.len()) {
        observation.frame.world_from_camera = first.between(&observation.frame.world_from_camera);
        part.push(observation);
    }
    Arc::new(part)
}

/// Maps a walk around the table and writes the map to a file.
fn mapped(folder: &Path, change: impl FnOnce(&mut Sequence)) -> PriorMap {
    let settings = settings(&[]);
    let mut sequence = Sequence::clone(&sequence(&settings));
    change(&mut sequence);
    let (estimate, _) = estimate("first", Arc::new(sequence), &settings, &mut Silent).unwrap();
    let map = map_of(&estimate, &settings).unwrap();
    write_whole(&folder.join("map.json"), serde_json::to_string(&map).unwrap()).unwrap();
    map
}

pub(crate) fn in_map(folder: &Path, more: &[&str]) -> RunSettings {
    let file = format!("prior_map.file={}", folder.join("map.json").display());
    settings(&[&AGAIN[..], more, &[&file]].concat())
}

/// Records the poses, the objects in the first frame, and the time of the relocalization.
#[derive(Default)]
pub(crate) struct RelocalizationLog {
    poses: Vec<Se3>,
    first: Vec<ObjectId>,
    at: Option<usize>,
}

impl StreamWatcher for RelocalizationLog {
    fn event(&mut self, event: StreamEvent<'_>) -> ControlFlow<()> {
        let StreamEvent::Frame(MappedFrame { report, .. }) = event else { return ControlFlow::Continue(()) };
        let report = report.unwrap();
        if self.poses.is_empty() {
            self.first = report.box_objects.iter().copied().flatten().collect();
        }
        self.poses.push(report.pose);
        self.at = self.at.or(report.located.as_ref().map(|_| report.frame));
        ControlFlow::Continue(())
    }
}

/// Returns the error of a pose in degrees and metres. The first run's map frame is the frame of the simulated
/// world.
fn off(sequence: &Sequence, frame: usize, pose: &Se3) -> [f64; 2] {
    let error = sequence.ground_truth.as_ref().unwrap().trajectory[frame].pose.between(pose);
    [error.rotation.log().norm().to_degrees(), error.translation.norm()]
}

pub(crate) fn warning_texts(report: &VariantReport) -> &PriorMapReport {
    report.prior_map.as_ref().unwrap()
}

#[test]
fn a_map_is_read_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let map = mapped(folder.path(), |_| {});
    assert!(map.objects.len() >= 11, "{}", map.objects.len());
    assert_eq!(PriorMap::read(&folder.path().join("map.json")).unwrap(), map);
    let seen = map.objects.iter().filter(|object| object.detection_counts.detection_rate() > 0.5).count();
    assert!(seen >= 10, "{:?}", map.objects.iter().map(|object| object.detection_counts).collect::<Vec<_>>());
}

#[test]
fn a_stream_that_begins_anywhere_finds_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let map = mapped(folder.path(), |_| {});
    let settings = in_map(folder.path(), &[]);
    let all = sequence(&settings);
    for start in [0, 90] {
        let stream = part_of_sequence(&all, start..240);
        let mut watch = RelocalizationLog::default();
        let (estimate, report) = online("again", stream.into(), &settings, &mut watch).unwrap();
        let at = watch.at.unwrap();
        let [deg, m] = off(&all, start + at, &watch.poses[at]);
        assert!(deg < 5.0 && m < 0.1, "{start}: {deg} {m}");
        let [deg, m] = off(&all, 239, &estimate.trajectory().last().unwrap().pose);
        assert!(deg < 3.0 && m < 0.15, "{start}, in the end: {deg} {m}");
        let prior = warning_texts(&report);
        assert!(prior.is_located && prior.found.as_ref().unwrap().frame == at);
        assert!(prior.seen.len() >= map.objects.len() - 2 && prior.added.len() <= 2, "{prior:?}");
        assert!(prior.gone.is_empty(), "{prior:?}");
    }
}

#[test]
fn a_batch_finds_the_same_place_as_a_stream() {
    let folder = tempfile::tempdir().unwrap();
    mapped(folder.path(), |_| {});
    let settings = in_map(folder.path(), &[]);
    let all = part_of_sequence(&sequence(&settings), 40..240);
    let mapped = MappedSequence::new(all.clone(), &settings, &mut Silent).unwrap();
    let (_, report) =
        online("stream", all.clone().into(), &settings, &mut RelocalizationLog::default()).unwrap();
    assert_eq!(mapped.found, warning_texts(&report).found);
    // counts of the first map are dropped: every object added since exists at the end, or was merged or
    // removed
    let known = begun(folder.path(), &warning_texts(&report).found.as_ref().unwrap().located.start, &[]);
    let (_, alone) = online("known", all.clone().into(), &known, &mut RelocalizationLog::default()).unwrap();
    let [found, alone] = [report.online.unwrap(), alone.online.unwrap()];
    assert_eq!(found.seconds.len(), all.frames.len());
    assert!(
        found.initialized.abs_diff(alone.initialized) <= 2,
        "{} and {}",
        found.initialized,
        alone.initialized
    );
    let (_, report) = estimate("batch", all, &settings, &mut Silent).unwrap();
    assert!(warning_texts(&report).seen.len() >= 10 && warning_texts(&report).gone.is_empty());
}

#[test]
fn a_place_that_is_known_is_not_looked_for() {
    let folder = tempfile::tempdir().unwrap();
    let map = mapped(folder.path(), |_| {});
    let all = sequence(&in_map(folder.path(), &["association.type=given"]));
    let first = all.frames[0].world_from_camera;
    let settings = begun(folder.path(), &first, &["association.type=likelihood"]);
    let mut watch = RelocalizationLog::default();
    let (_, report) = online("again", all.clone().into(), &settings, &mut watch).unwrap();
    let prior = warning_texts(&report);
    assert!(watch.at.is_none() && prior.found.is_none() && prior.is_located);
    let error = first.between(&watch.poses[0]);
    assert!(error.log().norm() < 1e-3, "{error:?}");
    let known = watch.first.iter().filter(|id| map.object(**id).is_some()).count();
    assert!(2 * known > watch.first.len(), "{:?} in the first frame", watch.first);
    assert!(prior.seen.len() >= 8 && prior.added.len() <= 2, "{prior:?}");
}

#[test]
fn another_table_is_not_taken_for_this_one() {
    let folder = tempfile::tempdir().unwrap();
    mapped(folder.path(), |_| {});
    for seed in [7, 8, 9] {
        let settings = in_map(folder.path(), &[&format!("source.scene.seed={seed}")]);
        let (estimate, report) =
            online("other", sequence(&settings).into(), &settings, &mut RelocalizationLog::default())
                .unwrap();
        let prior = warning_texts(&report);
        assert!(!prior.is_located && prior.seen.is_empty() && prior.added.is_empty());
        assert!(report.warnings.iter().any(|warning| warning.to_string().contains("not clear where in")));
        // the run has made a new map
        assert!(estimate.mapping.mapped().count() >= 8);
    }
}

#[test]
fn a_room_with_a_few_things_that_stand_as_in_the_map_is_not_taken_for_it() {
    let folder = tempfile::tempdir().unwrap();
    let map = mapped(folder.path(), |_| {});
    let settings = in_map(folder.path(), &[]);
    let all = sequence(&settings);
    // the layout of five objects fits among twelve; the remaining objects are missing
    let mut few = Sequence::clone(&all);
    few.detections.retain(|detection| detection.object.is_some_and(|id| id.0 <= 5));
    for (stream, is_located) in [(all, true), (Arc::new(few), false)] {
        let mut watch = RelocalizationLog::default();
        let (_, report) = online("stream", stream.into(), &settings, &mut watch).unwrap();
        assert_eq!(warning_texts(&report).is_located, is_located, "{:?} of {}", watch.at, map.objects.len());
    }
}

#[test]
fn removed_objects_are_reported_and_new_ones_are_added() {
    let folder = tempfile::tempdir().unwrap();
    let known = |id: u32| {
        move |detection: &manifactor_slam::sequence::Detection| detection.object != Some(ObjectId(id))
    };
    // each walk misses one object, each a different one
    let map = mapped(folder.path(), |sequence| sequence.detections.retain(known(2)));
    let settings = in_map(folder.path(), &[]);
    let mut second = Sequence::clone(&sequence(&settings));
    let gone = 4;
    let truth = second.ground_truth.clone().unwrap();
    let place = |id: u32| {
        truth.objects.iter().find(|object| object.id.0 == id).unwrap().world_from_object.translation
    };
    second.detections.retain(known(gone));
    let (estimate, report) =
        online("second", Arc::new(second).into(), &settings, &mut RelocalizationLog::default()).unwrap();
    let prior = warning_texts(&report);
    let near = |id: &ObjectId, map: &PriorMap, place: Vector3<f64>| {
        map.object(*id).is_some_and(|object| (object.quadric.centroid() - place).norm() < 0.1)
    };
    assert_eq!(prior.gone.len(), 1, "{prior:?}");
    assert!(near(&prior.gone[0], &map, place(gone)));
    let after = map_of(&estimate, &settings).unwrap();
    assert!(after.object(prior.gone[0]).is_none());
    assert!(prior.added.iter().any(|id| near(id, &after, place(2))), "{prior:?}");
    // an extended map has smaller covariances, and the opportunities and classes of both walks
    let id = prior.seen[0];
    let opportunities = |map: &PriorMap| map.object(id).unwrap().detection_counts.expected;
    assert!(opportunities(&after) > opportunities(&map));
    let spread = |map: &PriorMap, id: &ObjectId| map.object(*id).unwrap().covariance().determinant().ln();
    let better = prior.seen.iter().filter(|id| spread(&after, id) < spread(&map, id)).count();
    assert!(better + 1 >= prior.seen.len(), "{better} of {}", prior.seen.len());
}

/// Returns settings with a known start in the map: simulated walks begin at the first pose of their odometry.
pub(crate) fn begun(folder: &Path, first: &Se3, more: &[&str]) -> RunSettings {
    let rotation = format!("prior_map.start.rotation={:?}", first.rotation.quaternion_xyzw());
    let translation = format!("prior_map.start.translation={:?}", first.translation.as_slice());
    in_map(folder, &[more, &[&rotation, &translation]].concat())
}

#[test]
fn what_is_not_seen_again_does_not_fade() {
    let folder = tempfile::tempdir().unwrap();
    let mut map = mapped(folder.path(), |_| {});
    for _ in 0..2 {
        let all = sequence(&in_map(folder.path(), &[]));
        // with so few frames no object counts as gone
        let mut few = Sequence::clone(&all);
        few.frames.truncate(3);
        few.detections.clear();
        let settings = begun(folder.path(), &all.frames[0].world_from_camera, &[]);
        let (estimate, report) = estimate("again", Arc::new(few), &settings, &mut Silent).unwrap();
        assert!(
            warning_texts(&report).seen.is_empty() && warning_texts(&report).gone.is_empty(),
            "{:?}",
            warning_texts(&report)
        );
        let after = map_of(&estimate, &settings).unwrap();
        let known = |map: &PriorMap| -> Vec<_> {
            map.objects.iter().map(|o| (o.id, o.classes.clone(), o.quadric, o.covariance)).collect()
        };
        assert_eq!(known(&after), known(&map));
        write_whole(&folder.path().join("map.json"), serde_json::to_string(&after).unwrap()).unwrap();
        map = after;
    }
}

#[test]
fn an_older_map_does_not_stay_beside_results_without_one() {
    let folder = tempfile::tempdir().unwrap();
    let mut document = Document::parse("table.toml", TABLE, Format::Toml).unwrap();
    document.set(&["source.trajectory.frames=60"]).unwrap();
    let mut run = RunDocument::read(&document).unwrap();
    run.output = folder.path().to_owned();
    let variant = &run.variants[0];
    let (mut estimate, report) =
        estimate(&variant.name, sequence(&variant.settings), &variant.settings, &mut Silent).unwrap();
    let record = VariantRecord::new(variant, &estimate);
    let written = write_variant(&run, variant, &estimate, &report, &record).unwrap();
    assert!(written.join("map.json").is_file());
    // a graph with an unknown variable has no covariances
    let value = *estimate.landmarks()[0].quadric;
    estimate.mapping.graph.add(["nowhere"], QuadricPrior { value });
    write_variant(&run, variant, &estimate, &report, &record).unwrap();
    assert!(!written.join("map.json").exists() && written.join("objects.json").is_file());
}

/// Invalid frames before and after the relocalization.
#[test]
fn a_frame_that_is_left_out_counts_once_and_in_no_number() {
    let folder = tempfile::tempdir().unwrap();
    mapped(folder.path(), |_| {});
    let settings = in_map(folder.path(), &[]);
    let mut all = Sequence::clone(&part_of_sequence(&sequence(&settings), 40..240));
    all.frames[2].world_from_camera.translation.x = f64::NAN;
    let all = Arc::new(all);
    let mut watch = SkippedFrames(0, None);
    let (_, report) = online("stream", all.clone().into(), &settings, &mut watch).unwrap();
    let online = report.online.as_ref().unwrap();
    assert_eq!((online.refusals, online.refused.len(), watch.0), (1, 1, 1));
    let mapped = MappedSequence::new(all, &settings, &mut Silent);
    // a batch does not accept non-finite frames, so only the frame of the relocalization is compared
    let found = mapped.map(|mapped| mapped.found.unwrap().frame);
    assert_eq!(found.ok().or(watch.1), watch.1);
}

/// Counts skipped frames, and records the time of the relocalization.
struct SkippedFrames(usize, Option<usize>);

impl StreamWatcher for SkippedFrames {
    fn event(&mut self, event: StreamEvent<'_>) -> ControlFlow<()> {
        let StreamEvent::Frame(MappedFrame { report, .. }) = event else { return ControlFlow::Continue(()) };
        self.0 += usize::from(report.is_err());
        self.1 = self.1.or(report.ok().filter(|report| report.located.is_some()).map(|report| report.frame));
        ControlFlow::Continue(())
    }
}

#[test]
fn classes_of_a_map_are_called_as_the_run_calls_them() {
    let folder = tempfile::tempdir().unwrap();
    let map = mapped(folder.path(), |_| {});
    let plain = in_map(folder.path(), &[]);
    let other = in_map(folder.path(), &["aliases={ bottle = \"flask\" }"]);
    let count = |settings: &RunSettings, class: &str| {
        let map = &settings.prior_map.as_ref().unwrap().map;
        map.objects
            .iter()
            .filter(|object| object.classes.best().is_some_and(|best| best.name == class))
            .count()
    };
    assert_eq!(plain.prior_map.as_ref().unwrap().map.objects.len(), map.objects.len());
    let bottles = count(&plain, "bottle");
    assert!(bottles >= 2);
    assert_eq!((count(&other, "bottle"), count(&other, "flask")), (0, bottles));
}

#[test]
fn what_the_solver_has_rejected_says_nothing_in_the_map() {
    let table = TABLE.replace(", loss = { type = \"cauchy\", scale = 1.0 }", "");
    let mut document = Document::parse("table.toml", &table, Format::Toml).unwrap();
    document.set(&["association.type=given", "solver.type=gnc", "source.trajectory.frames=60"]).unwrap();
    let settings = RunDocument::read(&document).unwrap().variants.remove(0).settings;
    let mut sequence = Sequence::clone(&sequence(&settings));
    for detection in sequence.detections.iter_mut().step_by(9) {
        let b = detection.bounding_box;
        detection.bounding_box = BoundingBox { xmin: b.xmin - 60.0, xmax: b.xmax - 60.0, ..b };
    }
    let (estimate, _) = estimate("gnc", Arc::new(sequence), &settings, &mut Silent).unwrap();
    let rejected: Vec<usize> =
        (0..estimate.solution.weights.len()).filter(|i| estimate.solution.weights[*i] == 0.0).collect();
    assert!(rejected.len() > 5, "{rejected:?}");
    // must equal the estimate of a graph that never contained the rejected factors
    let mut without = estimate.clone();
    let mut place = 0;
    without.mapping.graph.factors_mut().retain(|_| {
        place += 1;
        !rejected.contains(&(place - 1))
    });
    without.solution.weights.retain(|weight| *weight != 0.0);
    let [map, without] = [&estimate, &without].map(|of| map_of(of, &settings).unwrap());
    for (a, b) in map.objects.iter().zip(&without.objects) {
        let (a, b) = (a.covariance(), b.covariance());
        assert!((a - b).norm() < 1e-6 * b.norm(), "{}", (a - b).norm() / b.norm());
    }
}

#[test]
fn what_is_too_far_away_to_be_seen_is_not_looked_at() {
    let folder = tempfile::tempdir().unwrap();
    let map = mapped(folder.path(), |_| {});
    assert!(map.objects.iter().all(|object| object.least_px.is_some_and(|size| size > 5.0)));
    // a map of objects that were only detected from nearby
    let near = map.objects.iter().map(|object| {
        let object = PriorObject { least_px: Some(1000.0), ..PriorObject::clone(object) };
        Arc::new(object)
    });
    let near = PriorMap::new(map.up, near.collect());
    let first = sequence(&in_map(folder.path(), &[])).frames[0].world_from_camera;
    for (map, is_gone) in [(&map, true), (&near, false)] {
        write_whole(&folder.path().join("map.json"), serde_json::to_string(map).unwrap()).unwrap();
        let settings = begun(folder.path(), &first, &[]);
        let mut blind = Sequence::clone(&sequence(&settings));
        blind.detections.clear();
        let (_, report) = estimate("blind", Arc::new(blind), &settings, &mut Silent).unwrap();
        assert_eq!(warning_texts(&report).gone.is_empty(), !is_gone, "{:?}", warning_texts(&report));
    }
}
