//! Scenes of the simulated experiment, as fixed before any tuning.
use manifactor_config::{Document, Format};
use manifactor_slam::experiment::{Experiment, Trial};
use manifactor_slam::run::Run;
use manifactor_slam::run_document::RunDocument;
use manifactor_slam::sequence::Sequence;
use manifactor_slam::source::InputFolders;
use manifactor_solve::Silent;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/experiments/simulation")
}

fn experiment(name: &str) -> Experiment {
    Experiment::read(&Document::open(folder().join(name)).unwrap()).unwrap()
}

/// Returns the scene of a trial.
fn scene<'a>(experiment: &Experiment, trial: &'a Trial) -> &'a str {
    let column = experiment.columns.iter().position(|column| column == "scene").unwrap();
    &trial.labels[column]
}

/// Returns a line for each object: scene, object, class, place and extents of its box, in mm.
fn objects(scene: &str, sequence: &Sequence) -> String {
    let mut text = String::new();
    for object in &sequence.ground_truth.as_ref().unwrap().objects {
        let (centre, extents) = (object.bounding_box.centroid(), object.bounding_box.dimensions());
        let mm = |x: f64| (x * 1000.0).round();
        let numbers: Vec<String> = centre.iter().chain(extents.iter()).map(|x| mm(*x).to_string()).collect();
        writeln!(text, "{scene},{},{},{}", object.id, object.class, numbers.join(",")).unwrap();
    }
    text
}

#[test]
fn the_scenes_are_those_that_were_settled() {
    let experiment = experiment("simulation.toml");
    assert_eq!(experiment.trials.iter().filter(|t| t.labels.last().unwrap() == "QuadricSLAM").count(), 250);
    let mut scenes = BTreeMap::new();
    for trial in &experiment.trials {
        let label = scene(&experiment, trial);
        scenes.entry(label.parse::<u32>().unwrap()).or_insert_with(|| {
            objects(label, &trial.settings.source.load(&InputFolders::default()).unwrap())
        });
    }
    assert_eq!(scenes.len(), 10);
    let header = "scene,object,class,x_mm,y_mm,z_mm,width_mm,depth_mm,height_mm\n".to_owned();
    let found: String = std::iter::once(header).chain(scenes.into_values()).collect();
    let file = folder().join("scenes.csv");
    if std::env::var_os("MANIFACTOR_WRITE_SCENES").is_some() {
        std::fs::write(&file, &found).unwrap();
    }
    assert!(found == std::fs::read_to_string(&file).unwrap(), "the scenes differ from {}", file.display());
}

#[test]
fn nothing_is_tuned_on_the_scenes_that_are_reported() {
    let seeds = |name: &str| -> Vec<u64> {
        let experiment = experiment(name);
        experiment.trials.iter().map(|trial| scene(&experiment, trial).parse().unwrap()).collect()
    };
    let reported = seeds("simulation.toml");
    assert!(seeds("tuning.toml").iter().all(|scene| !reported.contains(scene)));
}

#[test]
fn errors_are_as_large_as_covariances_say_where_the_noise_is_known() {
    // an even circle: all motions are equal, and their noise is a share of them
    let (frames, share) = (60, 0.05);
    let turn = 300f64.to_radians() / f64::from(frames - 1);
    let step = 2.0 * 2.2 * (turn / 2.0).sin();
    let [turn, step] = [turn, step].map(|motion| share * motion / 3f64.sqrt());
    let consistency = |seed: u64| {
        let text = format!(
            "
            source = {{ type = 'simulated', seed = {seed}, scene = {{ seed = {seed}, objects = 8, classes = ['sports ball'] }},
                       trajectory = {{ frames = {frames}, waves = [0.0, 0.0], wander = 0.0 }},
                       odometry = {{ translation = {share}, rotation = {share} }} }}
            prior = {{ noise = {{ sigma = 0.0001 }} }}
            odometry = {{ noise = {{ sigmas = [{turn}, {turn}, {turn}, {step}, {step}, {step}] }} }}
            detections = {{ noise = {{ sigma = 2.0 }} }}"
        );
        let document = Document::parse("run.toml", text, Format::Toml).unwrap();
        let run = RunDocument::read(&document).unwrap();
        let (_, report) = Run::new(&run, None).run_variant(&run.variants[0], &mut Silent).unwrap();
        report.consistency.unwrap()
    };
    let all: Vec<_> = (1..=8).map(consistency).collect();
    let mean = |of: &dyn Fn(usize) -> f64| (0..all.len()).map(of).sum::<f64>() / all.len() as f64;
    let (poses, objects) = (mean(&|i| all[i].poses.unwrap()), mean(&|i| all[i].objects.unwrap()));
    assert!((0.7..1.4).contains(&poses) && (0.7..1.4).contains(&objects), "{poses} {objects} {all:?}");
}

#[test]
fn ellipses_of_outlines_replace_boxes_unless_the_border_cuts_them() {
    let text = r#"
source = { type = "simulated", scene = { objects = 8 }, trajectory = { frames = 60 } }
odometry = { noise = { sigma = 0.005 } }
detections = { noise = { sigma = 2.0 }, ellipse_error = 1.0, border_px = 0.5, cut_sides = "mask" }
variants = [{ name = "ellipses", set = { source = { detector = { ellipse_error = 1.0 } } } }, { name = "boxes" }]
"#;
    let document = RunDocument::read(&Document::parse("run.toml", text, Format::Toml).unwrap()).unwrap();
    let mut run = Run::new(&document, None);
    let mut counts = vec![];
    for variant in &document.variants {
        let (estimate, _) = run.run_variant(variant, &mut Silent).unwrap();
        let of = |name: &str| {
            let factors = estimate.mapping.graph.factors();
            factors.iter().filter(|entry| entry.factor.typetag_name() == name).count()
        };
        let termination = estimate.solution.outcome.termination;
        assert!(termination.is_converged(), "{termination:?}");
        counts.push([of("conic_distance"), of("bounding_box")]);
    }
    let [[ellipses, cut], [none, boxes]] = counts[..] else { panic!("{counts:?}") };
    assert!(ellipses > 200 && cut > 0 && none == 0, "{counts:?}");
    assert!(boxes.abs_diff(ellipses + cut) <= boxes / 10, "{counts:?}");
}
