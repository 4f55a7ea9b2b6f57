//! A sequence as files: the input of [`RecordedFiles`](crate::source::RecordedFiles).
use crate::measurement::Measurement;
use crate::sequence::{Detection, Sequence};
use manifactor_formats::FormatError;
use manifactor_formats::detections::{self, DetectionRow};
use manifactor_formats::tum::{self, StampedPose};
use manifactor_formats::whole::write_whole;
use serde_json::json;
use std::io;
use std::path::Path;

/// File of the true objects.
pub(crate) const OBJECTS_FILE: &str = "objects.json";

/// Writes `odometry.txt` and `detections.csv` into a folder, `detections_NAME.csv` for each further camera, and with ground truth also `groundtruth.txt` and
/// `objects.json`. Creates the folder if it does not exist.
///
/// # Errors
/// If a file cannot be written.
pub fn write(sequence: &Sequence, folder: &Path) -> Result<(), FormatError> {
    let io = |path: &Path| {
        let path = path.to_owned();
        move |source| FormatError::Io { path, source }
    };
    std::fs::create_dir_all(folder).map_err(io(folder))?;
    let odometry = sequence.frames.iter();
    let odometry: Vec<_> =
        odometry.map(|f| StampedPose { timestamp: f.timestamp, pose: f.world_from_camera }).collect();
    tum::write(folder.join("odometry.txt"), &odometry)?;
    write_detections(sequence, &folder.join("detections"))?;
    if let Some(truth) = &sequence.ground_truth {
        tum::write(folder.join("groundtruth.txt"), &truth.trajectory)?;
        let path = folder.join(OBJECTS_FILE);
        write_whole(&path, format!("{:#}\n", json!(truth.objects)).as_bytes()).map_err(io(&path))?;
    }
    Ok(())
}

/// Writes only the boxes, with the objects that they show: `STEM.csv`, and `STEM_NAME.csv` for each further camera.
///
/// # Errors
/// If a file cannot be written.
pub fn write_detections(sequence: &Sequence, stem: &Path) -> Result<(), FormatError> {
    if let Some(field) = missing_column(sequence) {
        return Err(no_column(stem, field));
    }
    for camera in sequence.cameras.iter() {
        let own = sequence.detections.iter().filter(|detection| detection.camera.index == camera.index);
        let rows: Vec<_> = own.filter_map(|detection| row(sequence, detection)).collect();
        let mut file = stem.as_os_str().to_owned();
        file.push(if camera.index == 0 { ".csv".into() } else { format!("_{}.csv", camera.name) });
        detections::write(file, &rows)?;
    }
    Ok(())
}

/// Returns a field of the boxes that a table does not have; JSON lines have all.
pub fn missing_column(sequence: &Sequence) -> Option<&'static str> {
    let other = |detection: &Detection| {
        let names = detection.quantities.iter().map(Measurement::name).find(|name| *name != "depth");
        let ellipse = detection.ellipse.map(|_| "ellipse");
        ellipse.or(detection.camera.lens_from_view.map(|_| "view")).or(names)
    };
    sequence.detections.iter().find_map(other)
}

/// Returns the error of detections with a field that a table does not have.
fn no_column(stem: &Path, field: &str) -> FormatError {
    let message = format!("detections with `{field}` have no column here: use JSON lines");
    FormatError::Io { path: stem.to_owned(), source: io::Error::new(io::ErrorKind::Unsupported, message) }
}

fn row(sequence: &Sequence, detection: &Detection) -> Option<DetectionRow> {
    let (class, score) = detection.scores.best().unwrap_or_default();
    let all: Vec<_> = detection.scores.iter().map(|(class, score)| format!("{class}:{score}")).collect();
    let [xmin, ymin, xmax, ymax] = detection.bounding_box.bounds();
    Some(DetectionRow {
        frame_idx: Some(detection.frame as u64),
        timestamp: sequence.frames.get(detection.frame)?.timestamp,
        frame_idx_as_published: None,
        object_key: detection.object.map(|id| id.0),
        class_id: None,
        class_name: class.to_owned(),
        score,
        xmin,
        ymin,
        xmax,
        ymax,
        scores: (all.len() > 1).then(|| all.join(";")),
        depth: detection.quantities.depth(),
    })
}
