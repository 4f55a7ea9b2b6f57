//! Files of a sequence, which [`Recorded`](crate::input::source::Recorded) reads.
use crate::input::measurement::Measurement;
use crate::input::sequence::Sequence;
use manifactor_formats::FormatError;
use manifactor_formats::detections::{self, Detection};
use manifactor_formats::tum::{self, StampedPose};
use manifactor_formats::whole::write_whole;
use serde_json::json;
use std::io;
use std::path::Path;

/// File of the true objects.
pub(crate) const OBJECTS: &str = "objects.json";

/// Writes `odometry.txt` and `detections.csv` into a folder, and with ground truth also `groundtruth.txt` and
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
    write_detections(sequence, &folder.join("detections.csv"))?;
    if let Some(truth) = &sequence.ground_truth {
        tum::write(folder.join("groundtruth.txt"), &truth.trajectory)?;
        let path = folder.join(OBJECTS);
        write_whole(&path, format!("{:#}\n", json!(truth.objects)).as_bytes()).map_err(io(&path))?;
    }
    Ok(())
}

/// Writes only the boxes, with the objects that they show.
///
/// # Errors
/// If the file cannot be written.
pub fn write_detections(sequence: &Sequence, file: &Path) -> Result<(), FormatError> {
    let quantities = sequence.detections.iter().flat_map(|detection| detection.quantities.iter());
    if let Some(other) = quantities.map(Measurement::name).find(|name| *name != "depth") {
        let message = format!("detections with `{other}` have no column here: use JSON lines");
        let source = io::Error::new(io::ErrorKind::Unsupported, message);
        return Err(FormatError::Io { path: file.to_owned(), source });
    }
    detections::write(file, &rows(sequence))
}

fn rows(sequence: &Sequence) -> Vec<Detection> {
    let row = |d: &crate::input::sequence::Detection| {
        let (class, score) = d.scores.best().unwrap_or_default();
        let all: Vec<_> = d.scores.iter().map(|(class, score)| format!("{class}:{score}")).collect();
        let [xmin, ymin, xmax, ymax] = d.bounding_box.bounds();
        Some(Detection {
            frame_idx: Some(d.frame as u64),
            timestamp: sequence.frames.get(d.frame)?.timestamp,
            frame_idx_as_published: None,
            object_key: d.object.map(|id| id.0),
            class_id: None,
            class_name: class.to_owned(),
            score,
            xmin,
            ymin,
            xmax,
            ymax,
            scores: (all.len() > 1).then(|| all.join(";")),
            depth: d.quantities.depth(),
        })
    };
    sequence.detections.iter().filter_map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::sequence::ClassScores;
    use crate::input::simulator::Simulated;
    use crate::input::source::{CameraChoice, Folders, Recorded, Source};
    use manifactor_graph::checked::{Count, NotNegative, Positive};

    #[test]
    fn what_is_written_is_read_back() {
        let mut settings = Simulated::default();
        settings.trajectory.frames = Count::literal(30);
        settings.detector.false_boxes = NotNegative::literal(0.2);
        settings.detector.depth_error = Some(Positive::literal(0.02));
        let mut sequence = settings.simulate().unwrap();
        // a detector may omit the class
        sequence.detections[3].scores = ClassScores::default();
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        write(&sequence, folder).unwrap();
        let camera = serde_json::to_value(sequence.camera).unwrap();
        let recorded: Recorded =
            serde_json::from_value(json!({ "folder": folder, "camera": camera })).unwrap();
        assert!(matches!(recorded.camera, CameraChoice::Pinhole(camera) if camera == sequence.camera));
        let read = recorded.load(&Folders::default()).unwrap();
        assert_eq!((read.frames.len(), read.detections.len()), (30, sequence.detections.len()));
        for (a, b) in read.detections.iter().zip(&sequence.detections) {
            assert_eq!((a.frame, a.object, &a.scores), (b.frame, b.object, &b.scores));
            assert_eq!((a.bounding_box, &a.quantities), (b.bounding_box, &b.quantities));
        }
        let (found, truth) = (read.ground_truth.unwrap(), sequence.ground_truth.unwrap());
        assert_eq!(found.objects, truth.objects);
        let nothing = json!([{ "id": 1, "class": "cup", "world_from_object": truth.objects[0].world_from_object,
            "half_extents": [0.1, 0.0, 0.1], "bounding_box": truth.objects[0].bounding_box }]);
        std::fs::write(folder.join(OBJECTS), nothing.to_string()).unwrap();
        let error = recorded.load(&Folders::default()).unwrap_err().to_string();
        assert!(error.contains("object 1: half_extents must be three finite numbers above zero"), "{error}");
        std::fs::write(folder.join(OBJECTS), "[{}]").unwrap();
        assert!(recorded.load(&Folders::default()).unwrap_err().to_string().contains("missing field"));
    }
}
