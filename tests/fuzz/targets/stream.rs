//! Streams of frames: lines of JSON, and the journal that stores them.
use super::{assert_alike, temporary};
use manifactor::formats::whole::{checked_line, read_checked_line};
use manifactor::geometry::Se3;
use manifactor::quadric::Camera;
use manifactor::slam::journal::journaled;
use manifactor::slam::sequence::{Frame, Observation, SequenceHeader};
use manifactor::slam::source::{
    CameraChoice, InputFolders, JsonLines, SequenceSource, SourceError, format_line,
};
use manifactor::slam::stream::FrameStream;
use std::collections::{BTreeMap, HashSet};
use std::path::Path;

/// Reads lines of JSON. Each line is a frame or an error with its line number, and written frames are read
/// back.
pub fn json_lines(data: &[u8]) {
    let folder = temporary();
    let read = lines(folder.path(), data);
    let written = data.split(|byte| *byte == b'\n').count();
    assert!(read.len() <= written, "{} frames in {written} lines", read.len());
    let mut last = 0;
    let mut frames = vec![];
    for frame in read {
        match frame {
            Ok(frame) => frames.push(frame),
            Err(SourceError::Line { line, .. }) => {
                assert!(last < line && line <= written, "line {line} of {written}");
                last = line;
            }
            Err(error) => panic!("{error}"),
        }
    }
    let text: String = frames.iter().map(|frame| format_line(frame) + "\n").collect();
    let again = lines(folder.path(), text.as_bytes());
    assert_eq!(again.len(), frames.len());
    for (frame, again) in frames.iter().zip(again) {
        let again = again.unwrap_or_else(|e| panic!("{e}"));
        same_frame(frame, &again);
        // rounding of a rotation ends
        assert_alike(&json(&format_line(frame)), &json(&format_line(&again)));
    }
}

/// Reads journals of frames, unchanged and with valid checksums.
pub fn frame_journal(data: &[u8]) {
    kept(data);
    kept(&sealed(data));
}

/// A refused journal is not modified. An accepted journal stores new frames, and returns all frames again.
fn kept(bytes: &[u8]) {
    let folder = temporary();
    let path = folder.path().join("frames.jsonl");
    std::fs::write(&path, bytes).unwrap_or_else(|e| panic!("{e}"));
    let read = |new: &[Observation]| {
        let new: Vec<_> = new.iter().cloned().map(Ok).collect();
        let stream =
            journaled(FrameStream::new(SequenceHeader::new(camera()), new.into_iter()), &path, FINGERPRINT)?;
        let frames = stream.observations.filter_map(|frame| match frame {
            Ok(frame) => Some(frame),
            // a frame with the time of a recorded one
            Err(SourceError::OtherJournal { .. }) => None,
            Err(error) => panic!("{error}"),
        });
        Ok::<_, manifactor::formats::journal::JournalError>(frames.collect::<Vec<_>>())
    };
    let Ok(before) = read(&[]) else {
        assert_eq!(std::fs::read(&path).unwrap_or_default(), bytes, "a refused journal has changed");
        return;
    };
    let whole = std::fs::read(&path).unwrap_or_default();
    assert!(bytes.starts_with(&whole) || whole.starts_with(bytes), "a journal has other lines");
    let had: HashSet<u64> = before.iter().map(|frame| frame.frame.timestamp.to_bits()).collect();
    let new = [1.0, 1e300, f64::NAN, 2.0].map(|timestamp| Observation {
        detections: before.first().map_or(vec![], |frame| frame.detections.clone()),
        ..Observation::new(Frame::new(timestamp, Se3::identity()))
    });
    let all = read(&new).unwrap_or_else(|e| panic!("{e}"));
    let is_new = |frame: &&Observation| !had.contains(&frame.frame.timestamp.to_bits());
    assert_eq!(all.len(), before.len() + new.iter().filter(is_new).count());
    let again = read(&[]).unwrap_or_else(|e| panic!("{e}"));
    let kept: Vec<&Observation> = all.iter().filter(|frame| frame.frame.timestamp.is_finite()).collect();
    assert_eq!(again.iter().collect::<Vec<_>>(), kept);
}

/// Settings of the corpus's journals.
const FINGERPRINT: &str = "7";

/// Adds valid checksums to all lines except the first.
pub(super) fn sealed(data: &[u8]) -> Vec<u8> {
    let (first, rest) = data.split_at(data.iter().position(|byte| *byte == b'\n').map_or(0, |end| end + 1));
    let mut bytes = first.to_vec();
    bytes.extend(sealed_lines(rest));
    bytes
}

/// Adds valid checksums. A last line without an end stays unchanged.
pub(super) fn sealed_lines(data: &[u8]) -> Vec<u8> {
    let seal = |line: &[u8]| {
        let text = String::from_utf8_lossy(line);
        let object = match (read_checked_line(line), text.strip_suffix('\n')) {
            (_, None) | (Ok(_), _) => return line.to_vec(),
            // an invalid checksum
            (_, Some(text)) => match text.split_once("\",").filter(|_| text.starts_with("{\"checksum\"")) {
                Some((_, rest)) => format!("{{{rest}"),
                None => text.to_owned(),
            },
        };
        checked_line(&object).into_bytes()
    };
    data.split_inclusive(|byte| *byte == b'\n').flat_map(seal).collect()
}

fn lines(folder: &Path, bytes: &[u8]) -> Vec<Result<Observation, SourceError>> {
    let file = "frames.jsonl";
    std::fs::write(folder.join(file), bytes).unwrap_or_else(|e| panic!("{e}"));
    let source = JsonLines {
        body_from_camera: None,
        cameras: BTreeMap::new(),
        camera: CameraChoice::Pinhole(camera()),
        file: Some(file.into()),
        ground_truth: None,
        up: None,
        max_pose_gap: None,
    };
    let folders = InputFolders { data: None, document: folder.into() };
    let stream = source.open(&folders).unwrap_or_else(|e| panic!("{e}"));
    stream.map_or(vec![], |stream| stream.observations.collect())
}

/// Compares two frames, except for unused boxes and the last digits of a rotation.
fn same_frame(frame: &Observation, again: &Observation) {
    assert_eq!(frame.frame.timestamp.to_bits(), again.frame.timestamp.to_bits());
    assert_eq!(frame.frame.world_from_camera.translation, again.frame.world_from_camera.translation);
    assert_eq!((&frame.detections, &frame.accelerometer), (&again.detections, &again.accelerometer));
    assert!(again.unused.is_empty());
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}"))
}

pub(super) fn camera() -> Camera {
    Camera::new([320.0, 320.0, 320.0, 240.0], 640, 480).unwrap_or_else(|e| panic!("{e}"))
}
