//! The associations by overlap can be named in documents, and the likelihood of this project is better.
#![allow(missing_docs, clippy::unwrap_used)]
use manifactor::config::{Document, Format};
use manifactor::prelude::*;
use manifactor::slam::metrics::IdentityScores;
use manifactor::slam::output::map_of;
use manifactor::slam::output::write_whole;
use manifactor::slam::report::VariantReport;
use manifactor::slam::run::{Run, estimate};
use manifactor::slam::run_document::RunDocument;
use manifactor::slam::settings::RunSettings;
use manifactor::slam::source::InputFolders;
use manifactor_bench as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A desk with objects of three classes, seen by an imperfect detector.
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

/// A table with objects of a few classes, and a walk around it.
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

fn settings(text: &str, sets: &[&str]) -> RunSettings {
    let mut document = Document::parse("run.toml", text, Format::Toml).unwrap();
    document.set(sets).unwrap();
    RunDocument::read(&document).unwrap().variants.remove(0).settings
}

fn report(settings: &RunSettings) -> VariantReport {
    let sequence = settings.source.load(&InputFolders::default()).unwrap();
    estimate("run", Arc::new(sequence), settings, &mut Silent).unwrap().1
}

fn scores(report: &VariantReport) -> IdentityScores {
    report.association.as_ref().unwrap().in_the_end.unwrap()
}

#[test]
fn the_likelihood_does_better_than_overlap() {
    let by = |name: &str| scores(&report(&settings(DESK, &[&format!("association.type={name}")]))).f1;
    let (likelihood, iou, projection) = (by("likelihood"), by("iou"), by("projection"));
    assert!(likelihood > iou + 0.05 && likelihood > projection + 0.05, "{likelihood} {iou} {projection}");
    assert!(iou > 0.3 && projection > 0.3, "{iou} {projection}");
}

#[test]
fn objects_of_a_prior_map_are_found_again_by_their_outlines() {
    let folder = tempfile::tempdir().unwrap();
    let first = settings(TABLE, &[]);
    let sequence = Arc::new(first.source.load(&InputFolders::default()).unwrap());
    let (mapped, _) = estimate("first", sequence, &first, &mut Silent).unwrap();
    let file = folder.path().join("map.json");
    let map = map_of(&mapped, &first).unwrap();
    write_whole(&file, serde_json::to_string(&map).unwrap()).unwrap();
    let again = ["source.seed=2", "source.trajectory.seed=2"];
    let start =
        settings(TABLE, &again).source.load(&InputFolders::default()).unwrap().frames[0].world_from_camera;
    let file = format!("prior_map.file={}", file.display());
    let rotation = format!("prior_map.start.rotation={:?}", start.rotation.quaternion_xyzw());
    let translation = format!("prior_map.start.translation={:?}", start.translation.as_slice());
    for association in ["iou", "projection"] {
        let by = format!("association.type={association}");
        let sets = [&again[..], &[&file, &rotation, &translation, &by]].concat();
        let report = report(&settings(TABLE, &sets));
        let prior = report.prior_map.as_ref().unwrap();
        assert!(prior.seen.len() >= 8 && prior.added.len() <= 2, "{association} {prior:?}");
    }
}

#[test]
fn real_boxes_are_confused_by_overlap() {
    let Some(data) = std::env::var_os("MANIFACTOR_DATA").map(PathBuf::from) else { return };
    let desk = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tum/fr1_desk.toml");
    for association in ["iou", "projection"] {
        let mut document = Document::open(&desk).unwrap();
        document.set(&[format!("association={{ type = '{association}' }}")]).unwrap();
        let run = RunDocument::read(&document).unwrap();
        let variant = run.variants.iter().find(|v| v.name == "Q C").unwrap();
        let (_, report) = Run::new(&run, Some(data.clone())).run_variant(variant, &mut Silent).unwrap();
        let found = scores(&report);
        assert!(found.f1 > 0.5 && found.f1 < 0.8, "{association}: {found:?}");
    }
}
