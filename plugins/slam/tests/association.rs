//! Data association of boxes without known objects.
use crate::prior_map::RelocalizationLog;
use crate::tum::{data, document};
use manifactor_config::{Document, Format};
use manifactor_graph::checked::Positive;
use manifactor_slam::association::{
    Association, Associator, Corrections, FrameDetections, GivenAssociation, LikelihoodAssociation,
};
use manifactor_slam::association::{DetectionMove, MapEstimate, ObjectMerge};
use manifactor_slam::class::ClassAliases;
use manifactor_slam::fusion::FusedClass;
use manifactor_slam::mapping::Warning;
use manifactor_slam::measurement::{DepthMeasurement, Quantities};
use manifactor_slam::measurements::ObjectMeasurements;
use manifactor_slam::metrics::IdentityScores;
use manifactor_slam::online::Mapper;
use manifactor_slam::prior_map::PriorObject;
use manifactor_slam::recording;
use manifactor_slam::report::VariantReport;
use manifactor_slam::run::{self, Run};
use manifactor_slam::run_document::RunDocument;
use manifactor_slam::sequence::{Detection, ObjectId, Sequence, UnusedInput};
use manifactor_slam::settings::RunSettings;
use manifactor_slam::source::InputFolders;
use manifactor_solve::Silent;
use std::collections::BTreeSet;
use std::sync::Arc;

/// A desk with objects of three classes, and a detector with errors.
const DESK: &str = r#"
semantics = []
association = { type = "likelihood" }
odometry = { noise = { sigma = 0.003 } }
detections = { noise = { sigma = 5.0 }, loss = { type = "cauchy", scale = 2.0 } }

[source]
type = "simulated"
scene = { objects = 10, classes = ["bottle", "cup", "book"] }
trajectory = { frames = 150 }
detector = { missed = 0.1, confused = 0.1, sigma_px = 3.0, sigma_of_size = 0.02, noise_lasts_s = 0.5, false_boxes = 0.1 }
"#;

fn scene(sets: &[&str]) -> (RunSettings, Arc<Sequence>) {
    let mut document = Document::parse("desk.toml", DESK, Format::Toml).unwrap();
    document.set(sets).unwrap();
    let settings = RunDocument::read(&document).unwrap().variants.remove(0).settings;
    let sequence = settings.source.load(&InputFolders::default()).unwrap();
    (settings, Arc::new(sequence))
}

fn by(settings: &RunSettings, association: impl Association + 'static) -> RunSettings {
    RunSettings { association: Arc::new(association), ..settings.clone() }
}

fn estimate(settings: &RunSettings, sequence: &Arc<Sequence>) -> VariantReport {
    run::estimate("desk", sequence.clone(), settings, &mut Silent).unwrap().1
}

fn scores(report: &VariantReport) -> IdentityScores {
    report.association.as_ref().unwrap().in_the_end.unwrap()
}

/// Returns the objects that this association assigns to all boxes as they arrive.
fn names(settings: &RunSettings, sequence: &Sequence) -> Vec<Option<ObjectId>> {
    let mut mapper = Mapper::new(sequence.header(), settings);
    sequence.observations().flat_map(|frame| mapper.add_frame(&frame).unwrap().box_objects).collect()
}

#[test]
fn objects_without_names_are_mapped_as_those_with_names() {
    let (settings, sequence) = scene(&[]);
    let found = estimate(&settings, &sequence);
    let known = estimate(&by(&settings, GivenAssociation {}), &sequence);
    let score = scores(&found);
    assert!(score.f1 > 0.97 && score.objects <= 15, "{score:?}");
    assert_eq!(score.true_objects, 10);
    assert!(known.association.is_none());
    let ate = |report: &VariantReport| report.trajectory[0].estimate.ate.rmse;
    assert!(ate(&found) < 1.1 * ate(&known), "{} {}", ate(&found), ate(&known));
    assert!(found.counts.objects >= known.counts.objects, "{:?} {:?}", found.counts, known.counts);
}

#[test]
fn names_of_the_source_make_no_difference() {
    let (settings, sequence) = scene(&[]);
    let mut nameless = Sequence::clone(&sequence);
    nameless.detections.iter_mut().for_each(|detection| detection.object = None);
    let found = names(&settings, &sequence);
    assert_eq!(found, names(&settings, &nameless));
    assert_eq!(found, names(&settings, &sequence));
    let report = estimate(&settings, &Arc::new(nameless));
    assert_eq!(report.association.unwrap().in_the_end, None);
    assert!(report.counts.objects >= 9);
}

#[test]
fn true_objects_are_compared_whatever_their_ids() {
    let (settings, sequence) = scene(&[]);
    let mut renamed = Sequence::clone(&sequence);
    let other = |id: ObjectId| ObjectId(40 - id.0);
    renamed.detections.iter_mut().for_each(|detection| detection.object = detection.object.map(other));
    renamed.ground_truth.as_mut().unwrap().objects.iter_mut().for_each(|truth| truth.id = other(truth.id));
    let compared = |sequence: &Arc<Sequence>| {
        let landmarks = estimate(&settings, sequence).landmarks.unwrap();
        (landmarks.objects, landmarks.estimate.rmse.position)
    };
    let found = compared(&Arc::new(renamed));
    assert_eq!(found, compared(&sequence));
    let known = estimate(&by(&settings, GivenAssociation {}), &sequence).landmarks.unwrap();
    assert!(found.0 + 1 >= known.objects, "{found:?} of {}", known.objects);
    assert!(found.1 < 1.5 * known.estimate.rmse.position, "{found:?} {}", known.estimate.rmse.position);
    // without the ids of the source, nothing can be compared
    let mut nameless = Sequence::clone(&sequence);
    nameless.detections.iter_mut().for_each(|detection| detection.object = None);
    let report = estimate(&settings, &Arc::new(nameless));
    assert!(report.landmarks.is_none());
    let is_told = |warning: &&Warning| {
        warning.to_string().contains("10 true objects are not compared")
            && !warning.to_string().contains("  ")
    };
    assert_eq!(report.warnings.iter().filter(is_told).count(), 1, "{:?}", report.warnings);
}

#[test]
fn a_row_that_is_there_twice_makes_no_second_object() {
    let (_, sequence) = scene(&[]);
    let folder = tempfile::tempdir().unwrap();
    recording::write(&sequence, folder.path()).unwrap();
    let file = folder.path().join("detections.csv");
    let text = std::fs::read_to_string(&file).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    std::fs::write(&file, format!("{header}\n{rows}{rows}")).unwrap();
    let recorded =
        format!("source={{ type = 'recorded', folder = {:?}, camera = 'freiburg1' }}", folder.path());
    let (_, again) = scene(&[&recorded]);
    assert_eq!(again.detections.len(), sequence.detections.len());
    assert_eq!(again.unused.iter().map(UnusedInput::boxes).sum::<usize>(), sequence.detections.len());
}

#[test]
fn an_eye_that_is_shut_for_a_while_knows_the_objects_again() {
    let (settings, sequence) = scene(&[]);
    let mut shut = Sequence::clone(&sequence);
    shut.detections.retain(|detection| !(50..90).contains(&detection.frame));
    let score = scores(&estimate(&settings, &Arc::new(shut)));
    assert!(score.f1 > 0.95 && score.objects <= 15, "{score:?}");
}

#[test]
fn a_detector_gone_mad_is_borne() {
    let (settings, sequence) = scene(&["source.detector.false_boxes=250", "source.trajectory.frames=40"]);
    assert!(sequence.detections.len() > 10_000);
    let mut mapper = Mapper::new(sequence.header(), &settings);
    let mut named = BTreeSet::new();
    for frame in sequence.observations() {
        let report = mapper.add_frame(&frame).unwrap();
        // the number of boxes per frame is limited
        assert!(report.box_objects.iter().flatten().count() <= 200);
        named.extend(report.box_objects.into_iter().flatten());
    }
    let all = mapper.measurements();
    assert!(all.objects.len() < 1000 && all.objects.len() < named.len(), "{}", all.objects.len());
}

/// Assigns wrong objects in every second frame, and corrects them later.
#[derive(Debug, Clone, serde::Serialize)]
struct WrongEverySecondFrame {
    found_out_at: usize,
    /// If true, the correction merges objects. Otherwise it moves boxes that had the next object until then.
    merges: bool,
    #[serde(skip)]
    wrong: Vec<DetectionMove>,
}

const OTHER: u32 = 1000;

impl WrongEverySecondFrame {
    fn new(merges: bool) -> Self {
        Self { found_out_at: 120, merges, wrong: vec![] }
    }
}

#[typetag::serialize(name = "twofold")]
impl Association for WrongEverySecondFrame {
    fn create_associator(&self, _: &ClassAliases, _: &[Arc<PriorObject>]) -> Box<dyn Associator> {
        Box::new(self.clone())
    }
}

impl Associator for WrongEverySecondFrame {
    fn associate(&self, image: &FrameDetections<'_>, _: &dyn MapEstimate) -> Vec<Option<ObjectId>> {
        let is_wrong = image.frame % 2 == 1 && image.frame <= self.found_out_at;
        let other = |ObjectId(id)| ObjectId(if self.merges { id + OTHER } else { id % 10 + 1 });
        let name = |id| if is_wrong { other(id) } else { id };
        image.detections.iter().map(|detection: &Detection| detection.object.map(name)).collect()
    }

    fn learn_from_frame(
        &mut self,
        image: &FrameDetections<'_>,
        names: &[Option<ObjectId>],
        _: &dyn MapEstimate,
    ) -> Corrections {
        for (place, (detection, name)) in image.detections.iter().zip(names).enumerate() {
            if let (Some(into), Some(from)) = (detection.object, *name)
                && into != from
            {
                let detection = Detection { frame: image.frame, ..detection.clone() };
                self.wrong.push(DetectionMove { frame: image.frame, index: place, from, into, detection });
            }
        }
        if image.frame != self.found_out_at {
            return Corrections::default();
        }
        let merge = |id| ObjectMerge { from: ObjectId(id + OTHER), into: ObjectId(id) };
        match self.merges {
            true => Corrections { merged: (0..20).map(merge).collect(), ..Corrections::default() },
            false => Corrections { moved: std::mem::take(&mut self.wrong), ..Corrections::default() },
        }
    }
}

/// Maps with `WrongEverySecondFrame` and checks that the final map equals the map with the right objects.
/// Returns the largest number of objects on the way.
fn corrections_now(merges: bool) -> usize {
    let (settings, sequence) = scene(&[]);
    let (given, twofold) =
        (by(&settings, GivenAssociation {}), by(&settings, WrongEverySecondFrame::new(merges)));
    let mut mapper = Mapper::new(sequence.header(), &twofold);
    let mut most = 0;
    for frame in sequence.observations() {
        let report = mapper.add_frame(&frame).unwrap();
        assert_eq!(report.refused, Vec::<String>::new());
        most = most.max(mapper.mapped_objects());
        let (moved, merged) = (!report.moved.is_empty(), !report.merged.is_empty());
        // the correction takes effect with the next frame
        assert_eq!((merged, moved), (merges && report.frame == 121, !merges && report.frame == 121));
    }
    let mut expected = Mapper::new(sequence.header(), &given);
    sequence.observations().for_each(|frame| drop(expected.add_frame(&frame).unwrap()));
    let boxes = |mapper: &Mapper| {
        let all = &mapper.measurements().objects;
        let views = |object: &ObjectMeasurements| {
            (object.id, object.detections, object.class(), object.views.clone())
        };
        all.iter().map(views).collect::<Vec<_>>()
    };
    let close = |(a, b): (&Option<FusedClass>, &Option<FusedClass>)| {
        let [a, b] = [a, b].map(|class| class.as_ref().unwrap());
        assert!(a.name == b.name && (a.share - b.share).abs() < 1e-9, "{a:?} {b:?}");
    };
    for (found, known) in boxes(&mapper).iter().zip(&boxes(&expected)) {
        assert_eq!((found.0, found.1, &found.3), (known.0, known.1, &known.3));
        close((&found.2, &known.2));
    }
    assert_eq!(mapper.measurements().boxes(), expected.measurements().boxes());
    let there = |mapper: &Mapper| mapper.objects().map(|(measured, _)| measured.id).collect::<Vec<_>>();
    assert_eq!(there(&mapper), there(&expected));
    let factors = |mapper: &mut Mapper| mapper.smoother().graph().0.factors().len();
    assert_eq!(factors(&mut mapper), factors(&mut expected));
    // updates without changes lead to the minimum
    let [cost, least] = [mapper, expected].map(|mut mapper| {
        (0..20).for_each(|_| _ = mapper.smoother().update().unwrap());
        mapper.smoother().cost()
    });
    assert!((cost - least).abs() < 0.01 * least, "{cost} {least}");
    most
}

#[test]
fn objects_that_turn_out_to_be_one_become_one_in_the_map() {
    let most = corrections_now(true);
    assert!(most > 15, "each object is there twice for a while: {most}");
}

#[test]
fn boxes_that_turn_out_to_show_another_object_are_its_in_the_map() {
    corrections_now(false);
}

#[test]
fn what_is_associated_wrongly_in_a_crowd_is_mended_while_frames_come_and_when_no_other_comes() {
    let crowd =
        ["source.scene.classes=[\"bottle\"]", "source.scene.area=[1.2,1.2]", "source.trajectory.frames=250"];
    let (settings, sequence) = scene(&crowd);
    let never = by(
        &settings,
        LikelihoodAssociation { second_look_s: Positive::literal(1e9), ..LikelihoodAssociation::default() },
    );
    let moved = |settings: &RunSettings| {
        let mut mapper = Mapper::new(sequence.header(), settings);
        let come =
            sequence.observations().map(|frame| mapper.add_frame(&frame).unwrap().moved.len()).sum::<usize>();
        let settled = mapper.finish_association();
        assert_eq!(settled.refused, Vec::<String>::new());
        assert!(mapper.finish_association().moved.is_empty(), "all boxes have been assigned");
        (come, settled.moved.len())
    };
    let (with, without) = (moved(&settings), moved(&never));
    assert!(with.0 > 10 && with.0 > without.0 && without.1 > with.1, "{with:?} {without:?}");
    for settings in [settings, never] {
        let stream = Arc::clone(&sequence).into();
        let found = run::online("crowd", stream, &settings, &mut RelocalizationLog::default());
        let report = found.unwrap().1.association.unwrap();
        let (then, now) = (report.at_the_time.unwrap().f1, report.in_the_end.unwrap().f1);
        assert!(now > then, "{now} {then}");
    }
}

#[test]
fn what_the_last_frame_teaches_is_corrected_in_the_end() {
    let (settings, sequence) = scene(&[]);
    let twofold =
        WrongEverySecondFrame { found_out_at: sequence.frames.len() - 1, ..WrongEverySecondFrame::new(true) };
    let mut mapper = Mapper::new(sequence.header(), &by(&settings, twofold));
    sequence.observations().for_each(|frame| drop(mapper.add_frame(&frame).unwrap()));
    let both = mapper.mapped_objects();
    assert!(!mapper.finish_association().merged.is_empty());
    assert!(mapper.mapped_objects() < both && mapper.objects().all(|(measured, _)| measured.id.0 < OTHER));
}

#[test]
fn real_boxes_without_names_are_put_to_their_objects() {
    let Some(data) = data() else { return };
    let run = document("fr1_desk.toml", &["association={ type = 'likelihood' }"]);
    let variant = run.variants.iter().find(|v| v.name == "Q C").unwrap();
    let (_, report) = Run::new(&run, Some(data)).run_variant(variant, &mut Silent).unwrap();
    let (likelihood, ate) = (scores(&report), report.trajectory[0].estimate.ate.rmse);
    assert!(likelihood.f1 > 0.9 && likelihood.objects < 39, "{likelihood:?}");
    assert_eq!((likelihood.true_objects, likelihood.boxes), (26, 2177));
    assert!(ate < 0.0165, "{ate}");
}

#[test]
fn depths_place_objects_at_once_and_tell_what_moves() {
    let with = ["source.detector.depth_error=0.02", "objects.birth_parallax_deg=0"];
    let initialiser = ["objects.initialiser={type=\"depth\",thickness=0.0}"];
    let (without, sequence) = scene(&[]);
    let (settings, measured) = scene(&[&with[..], &initialiser].concat());
    // both sequences have equal boxes
    assert!(
        sequence.detections.iter().zip(&measured.detections).all(|(a, b)| a.bounding_box == b.bounding_box)
    );
    let (f1, f1_without) =
        (scores(&estimate(&settings, &measured)).f1, scores(&estimate(&without, &sequence)).f1);
    assert!(f1 > f1_without - 0.01, "{f1} {f1_without}");
    let initialized = |settings: &RunSettings, sequence: &Sequence| {
        let mut mapper = Mapper::new(sequence.header(), settings);
        sequence
            .observations()
            .take(20)
            .map(|frame| mapper.add_frame(&frame).unwrap().initialized.len())
            .sum::<usize>()
    };
    let (early, late) = (initialized(&settings, &measured), initialized(&without, &sequence));
    assert!(early > late + 5, "{early} {late}");
    let mut moved = Sequence::clone(&measured);
    let id = moved.detections[0].object.unwrap();
    for detection in moved.detections.iter_mut().filter(|detection| detection.object == Some(id)) {
        if let Some(depth) = detection.quantities.depth() {
            let depth = Positive::new(depth + 0.01 * detection.frame as f64).unwrap();
            detection.quantities = Quantities::one(DepthMeasurement(depth));
        }
    }
    let report = estimate(&by(&settings, GivenAssociation {}), &Arc::new(moved));
    let rejected: Vec<_> = report.objects.iter().filter(|object| object.rejected_because.is_some()).collect();
    assert_eq!(rejected.iter().map(|object| object.object.id).collect::<Vec<_>>(), [id]);
    assert!(rejected[0].rejected_because.as_ref().unwrap().starts_with("it moves at"), "{rejected:?}");
}
