//! Simulated sequences, written to files and read back by the sources of recordings.
use super::*;
use manifactor_graph::checked::{Count, NotNegative, Positive};
use manifactor_recording::recording::write;
use manifactor_recording::sequence::ClassScores;
use manifactor_recording::source::{
    CameraChoice, InputFolders, JsonLines, RecordedFiles, SequenceSource, format_line,
};
use serde_json::json;

/// Simulated data of two cameras that look apart.
fn two_cameras(frames: usize) -> SimulatedSource {
    let mut settings = SimulatedSource::default();
    settings.trajectory.frames = Count::literal(frames);
    settings.detector.depth_error = Some(Positive::literal(0.02));
    let pose = json!({ "translation": [0.1, 0.0, -0.05], "rotation": [0.0, 1.0, 0.0, 0.0] });
    let camera = Camera { fx: 400.0, width: 800, cx: 400.0, ..settings.camera };
    let back = SimulatedCamera { camera, body_from_camera: serde_json::from_value(pose).unwrap() };
    settings.cameras.insert("back".into(), back);
    settings
}

#[test]
fn a_written_recording_is_read_back() {
    let mut settings = two_cameras(30);
    settings.detector.false_boxes = NotNegative::literal(0.2);
    let mut sequence = settings.simulate().unwrap();
    // a detector may omit the class
    sequence.detections[3].scores = ClassScores::default();
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(&sequence, folder).unwrap();
    let SimulatedCamera { camera, body_from_camera } = settings.cameras["back"];
    let back = json!({ "camera": camera, "body_from_camera": body_from_camera, "detections": "detections_back.csv" });
    let recorded = json!({ "folder": folder, "camera": settings.camera, "cameras": { "back": back } });
    let recorded: RecordedFiles = serde_json::from_value(recorded).unwrap();
    assert!(matches!(recorded.camera, CameraChoice::Pinhole(camera) if camera == settings.camera));
    let read = recorded.load(&InputFolders::default()).unwrap();
    assert_eq!(read.cameras, sequence.cameras);
    assert_eq!((read.frames.len(), read.detections.len()), (30, sequence.detections.len()));
    for (a, b) in read.detections.iter().zip(&sequence.detections) {
        assert_eq!((a.frame, a.object, &a.scores, &a.camera), (b.frame, b.object, &b.scores, &b.camera));
        assert_eq!((a.bounding_box, &a.quantities), (b.bounding_box, &b.quantities));
    }
    let (found, truth) = (read.ground_truth.unwrap(), sequence.ground_truth.unwrap());
    assert_eq!(found.objects, truth.objects);
    let nothing = json!([{ "id": 1, "class": "cup", "world_from_object": truth.objects[0].world_from_object,
        "half_extents": [0.1, 0.0, 0.1], "bounding_box": truth.objects[0].bounding_box }]);
    std::fs::write(folder.join("objects.json"), nothing.to_string()).unwrap();
    let error = recorded.load(&InputFolders::default()).unwrap_err().to_string();
    assert!(error.contains("object 1: half_extents must be three finite numbers above zero"), "{error}");
    std::fs::write(folder.join("objects.json"), "[{}]").unwrap();
    assert!(recorded.load(&InputFolders::default()).unwrap_err().to_string().contains("missing field"));
}

#[test]
fn a_name_that_leads_out_of_the_folder_is_refused() {
    let mut settings = two_cameras(2);
    let back = settings.cameras["back"];
    settings.cameras.insert("../back".into(), back);
    let error = settings.simulate().unwrap_err().to_string();
    assert!(error.contains("`source.cameras` has the name \"../back\""), "{error}");
}

#[test]
fn frames_written_as_lines_are_read_back() {
    let settings = two_cameras(20);
    let sequence = settings.simulate().unwrap();
    let lines: Vec<String> = sequence.observations().map(|o| format_line(&o)).collect();
    let folder = tempfile::tempdir().unwrap();
    let folders = InputFolders { data: None, document: folder.path().into() };
    std::fs::write(folder.path().join("frames.jsonl"), lines.join("\n\n") + "\n").unwrap();
    let source = json!({ "camera": settings.camera, "cameras": settings.cameras, "file": "frames.jsonl" });
    let source: JsonLines = serde_json::from_value(source).unwrap();
    let read = source.load(&folders).unwrap();
    assert_eq!((&read.frames, &read.detections), (&sequence.frames, &sequence.detections));
}
