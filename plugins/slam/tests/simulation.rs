//! The scenes of the simulated experiment, as they were settled before anything was tuned.
use manifactor_config::Document;
use manifactor_slam::experiment::{Experiment, Trial};
use manifactor_slam::sequence::Sequence;
use manifactor_slam::source::Folders;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/experiments/simulation")
}

fn experiment(name: &str) -> Experiment {
    Experiment::read(&Document::open(folder().join(name)).unwrap()).unwrap()
}

/// The scene of a trial.
fn scene<'a>(experiment: &Experiment, trial: &'a Trial) -> &'a str {
    let column = experiment.columns.iter().position(|column| column == "scene").unwrap();
    &trial.labels[column]
}

/// A line for each object: the scene, the object, its class, its place and the extents of the box around it, in mm.
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
        scenes
            .entry(label.parse::<u32>().unwrap())
            .or_insert_with(|| objects(label, &trial.settings.source.load(&Folders::default()).unwrap()));
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
