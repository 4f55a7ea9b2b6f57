//! The TUM RGB-D sequences of the paper, read where `MANIFACTOR_DATA` says that they lie.
//!
//! Settings and reference: gtsam-quadrics 0.3.0 with GTSAM's Levenberg-Marquardt on the same input.
#![allow(missing_docs, clippy::unwrap_used)]
use manifactor_config::Document;
use manifactor_quadric as _;
use manifactor_slam::mapping::Mapping;
use manifactor_slam::run::Run;
use manifactor_slam::run_document::RunDocument;
use std::path::{Path, PathBuf};

/// Where the data lie; `None`, said aloud, where nobody said.
fn data() -> Option<PathBuf> {
    let data = std::env::var_os("MANIFACTOR_DATA").map(PathBuf::from);
    if data.is_none() {
        eprintln!("skipped: set MANIFACTOR_DATA to the folder of the TUM RGB-D sequences to run this test");
    }
    data
}

fn document(config: &str, sets: &[&str]) -> RunDocument {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tum");
    let mut document = Document::open(folder.join(config)).unwrap();
    document.set(sets).unwrap();
    RunDocument::read(&document).unwrap()
}

/// Objects and boxes of a config's first variant.
fn counts(data: &Path, config: &str, odometry: &str) -> (usize, usize) {
    let run = document(config, &[&format!("source.odometry = 'trajectories/{odometry}.txt'")]);
    let variant = &run.variants[0];
    let sequence = Run::new(&run, Some(data.to_owned())).sequence(variant).unwrap();
    let mapping = Mapping::new(&sequence, &variant.settings).unwrap();
    (mapping.mapped().count(), mapping.mapped().map(|object| object.boxes).sum())
}

#[test]
fn the_same_objects_and_boxes_pass_the_filters_as_in_the_reference() {
    let Some(data) = data() else { return };
    let (fr1, fr2, fr3) = ("fr1_desk.toml", "fr2_desk.toml", "fr3_long_office_household.toml");
    assert_eq!(counts(&data, fr1, "orbslam2_rgbd_a_duanyongli"), (15, 598));
    assert_eq!(counts(&data, fr1, "dvo_vo"), (15, 597));
    assert_eq!(counts(&data, fr1, "opencv_rgbdicp_frame_to_frame_vo"), (14, 594));
    assert_eq!(counts(&data, fr2, "orbslam2_based_zzhfro"), (29, 7402));
    assert_eq!(counts(&data, fr3, "dxslam_drifting_gpetrak"), (42, 9707));
}
