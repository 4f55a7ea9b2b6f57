//! Published sequences in `MANIFACTOR_DATA/tum`: every file loads completely.
use manifactor_formats::{accelerometer, detections, timestamps, tum};
use std::path::PathBuf;

fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("MANIFACTOR_DATA").map(|root| PathBuf::from(root).join("tum"));
    if folder.is_none() {
        eprintln!("skipped: MANIFACTOR_DATA does not name a folder with published data");
    }
    folder
}

#[test]
fn detections_load_with_the_published_counts() {
    let Some(folder) = folder() else { return };
    // Sequence, number of boxes, number of objects.
    for (sequence, boxes, objects) in [
        ("freiburg1_desk", 2348, 26),
        ("freiburg1_desk2", 2109, 38),
        ("freiburg2_desk", 14298, 41),
        ("freiburg3_long_office_household", 16948, 54),
    ] {
        let file = format!("rgbd_dataset_{sequence}/detections_yolov3_associated.csv");
        let rows = detections::read(folder.join(file)).unwrap();
        let mut keys: Vec<_> = rows.iter().filter_map(|r| r.object_key.filter(|k| *k != 0)).collect();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!((rows.len(), keys.len()), (boxes, objects), "{sequence}");
    }
}

#[test]
fn trajectories_load_and_their_irregular_lines_are_reported() {
    let Some(folder) = folder() else { return };
    // File, number of poses, moved lines, dropped lines.
    let cases: [(&str, usize, &[usize], &[usize]); 5] = [
        ("freiburg1_desk/groundtruth.txt", 2335, &[], &[]),
        ("freiburg2_desk/groundtruth.txt", 20956, &[], &[10863]),
        ("freiburg3_long_office_household/groundtruth.txt", 8710, &[], &[]),
        ("freiburg1_desk/trajectories/dvo_vo.txt", 573, &[573], &[]),
        ("freiburg2_desk/trajectories/orbslam2_based_zzhfro.txt", 2893, &[], &[]),
    ];
    for (file, poses, moved, dropped) in cases {
        let trajectory = tum::read(folder.join(format!("rgbd_dataset_{file}"))).unwrap();
        assert_eq!(trajectory.poses.len(), poses, "{file}");
        assert_eq!((&trajectory.moved[..], &trajectory.dropped[..]), (moved, dropped), "{file}");
    }
}

#[test]
fn image_lists_and_accelerations_load() {
    let Some(folder) = folder() else { return };
    let desk = folder.join("rgbd_dataset_freiburg1_desk");
    let images = timestamps::read(desk.join("rgb.txt")).unwrap();
    assert_eq!((images.len(), images[0].file.as_str()), (613, "rgb/1305031452.791720.png"));
    let readings = accelerometer::read(desk.join("accelerometer.txt")).unwrap();
    let mean = readings.iter().map(|r| r.acceleration.norm()).sum::<f64>() / readings.len() as f64;
    assert!((mean - 9.81).abs() < 0.3, "gravity is {mean} m/s²");
}
