//! Journal of frames on disk, which lets an interrupted stream continue.
//!
//! The journal's key is the fingerprint of the settings. Each record is a frame in the format of the source
//! `json_lines`, with the unused input of the frame. Equal frames give equal bits: a program that was killed
//! reads the frames again and arrives at the same map.
//!
//! If a frame cannot be written, for example on a full disk, it is still mapped. The journal ends there, and
//! the run reports it.
use super::stream::FrameStream;
use crate::camera::Cameras;
use crate::sequence::Observation;
use crate::source::{SourceError, format_line, parse};
use manifactor_formats::journal::{Journal, JournalError, JournalRecord};
use manifactor_graph::Manifold;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Field of a record with the unused input of its frame.
const UNUSED: &str = "unused_input";

impl JournalRecord for Observation {
    type Context = Cameras;
    const NAME: &'static str = "frame";
    const HEADER_STARTS: &'static [&'static str] = &[r#"{"checked_frames_for":""#, r#"{"frames_for":""#];

    fn write(&self) -> io::Result<String> {
        let line = format_line(self);
        let Some(fields) = line.strip_suffix('}').filter(|_| !self.unused.is_empty()) else {
            return Ok(line);
        };
        Ok(format!("{fields},\"{UNUSED}\":{}}}", serde_json::to_string(&self.unused)?))
    }

    fn read(line: &[u8], cameras: &Cameras) -> Result<Self, String> {
        let separator = format!(",\"{UNUSED}\":");
        let text = std::str::from_utf8(line).map_err(|error| error.to_string())?;
        // boxes have no field of this name, so the last one is that of the record
        let Some((fields, unused)) = text.rsplit_once(&separator) else { return parse(line, cameras) };
        let unused = unused.strip_suffix('}').unwrap_or(unused);
        let unused = serde_json::from_str(unused).map_err(|error| error.to_string())?;
        Ok(Self { unused, ..parse(format!("{fields}}}").as_bytes(), cameras)? })
    }
}

/// Returns the frames of a journal, followed by the new frames of the stream, which are appended to the
/// journal. If there is no journal, it is created. A frame of the stream with the time of a recorded one is the same
/// frame again, or else the error [`SourceError::OtherJournal`].
///
/// # Errors
/// A file that cannot be read or written, is a link, or is not the journal of these settings. It stays
/// unchanged.
pub fn journaled(stream: FrameStream, path: &Path, fingerprint: &str) -> Result<FrameStream, JournalError> {
    let cameras = stream.opening.cameras.clone();
    let (mut journal, before) = Journal::<Observation>::open(path, fingerprint, cameras.clone())?;
    let past = before.iter().map(|frame| frame.frame.timestamp).fold(f64::NEG_INFINITY, f64::max);
    let content = |frame: &Observation| {
        let mut hash = DefaultHasher::new();
        format_line(frame).hash(&mut hash);
        hash.finish()
    };
    // a stream may have several frames with one time
    let mut recorded: HashMap<u64, Vec<u64>> = HashMap::new();
    for frame in &before {
        recorded.entry(frame.frame.timestamp.to_bits()).or_default().push(content(frame));
    }
    let file = path.to_owned();
    let new = stream.observations.filter_map(move |frame| {
        let Ok(observation) = &frame else { return Some(frame) };
        let timestamp = observation.frame.timestamp;
        let Some(known) = recorded.get(&timestamp.to_bits()) else { return Some(frame) };
        // as it was recorded: writing may change the last digits
        let again = parse(format_line(observation).as_bytes(), &cameras);
        let is_same = again.is_ok_and(|again| known.contains(&content(&again)));
        (!is_same).then(|| Err(SourceError::OtherJournal { file: file.clone(), timestamp }))
    });
    let lost = LostFrameCounter::default();
    let (path, counted) = (path.to_owned(), lost.clone());
    let kept = new.map(move |frame| {
        let frame = frame?;
        // a journal with a gap would give a different map
        if counted.get().is_some() {
            counted.add(&path, None);
            return Ok(frame);
        }
        Ok(append_frame(&mut journal, &frame).unwrap_or_else(|source| {
            counted.add(&path, Some(source));
            frame
        }))
    });
    let observations = Box::new(before.into_iter().map(Ok).chain(kept));
    Ok(FrameStream { opening: stream.opening, observations, recorded_frames: past, lost })
}

/// Shared count of the frames that a journal could not store.
#[derive(Debug, Clone, Default)]
pub struct LostFrameCounter(Arc<Mutex<Option<LostFrames>>>);

/// Frames that a journal could not store.
#[derive(Debug, Clone, PartialEq)]
pub struct LostFrames {
    /// Path of the journal.
    pub path: PathBuf,
    /// Number of frames, from the first that could not be written to the end.
    pub frames: usize,
    /// Reason from the operating system.
    pub reason: String,
}

impl LostFrameCounter {
    /// Returns the lost frames so far; `None` if all frames are stored.
    pub fn get(&self) -> Option<LostFrames> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn add(&self, path: &Path, error: Option<io::Error>) {
        let mut lost = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let reason = || error.map_or_else(String::new, |error| error.to_string());
        lost.get_or_insert_with(|| LostFrames { path: path.to_owned(), frames: 0, reason: reason() })
            .frames += 1;
    }
}

/// Appends a frame and returns it as it will be read, because writing and reading a rotation may change its
/// last digit. A non-finite frame is not written; the map rejects it as well.
fn append_frame(journal: &mut Journal<Observation>, frame: &Observation) -> io::Result<Observation> {
    if !(frame.frame.timestamp.is_finite() && frame.frame.world_from_camera.is_finite()) {
        return Ok(frame.clone());
    }
    journal.append(frame)
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::sequence::{ClassScores, Detection, Frame, ObjectId, SequenceHeader, UnusedInput};
    use manifactor_geometry::Se3;
    use manifactor_quadric::{BoundingBox, Camera};
    use nalgebra::Vector6;

    /// Twelve frames of a camera that moves ahead, each with two boxes.
    fn stream() -> FrameStream {
        let camera = Camera::new([500.0, 500.0, 320.0, 240.0], 640, 480).unwrap();
        let mut sequence = SequenceHeader::new(camera).into_sequence();
        for i in 0..12 {
            let t = f64::from(i) / 7.0;
            let world_from_camera = Se3::exp(&Vector6::new(0.1 * t, 0.2, 0.3, t, 0.5, 0.6 * t));
            sequence.frames.push(Frame::new(10.0 + t, world_from_camera));
            for (object, left) in [(1, 100.0), (2, 300.0)] {
                let bounding_box = BoundingBox::new([left + 3.0 * t, 120.0, left + 80.5, 200.0 + t]).unwrap();
                let (camera, scores) = (sequence.cameras.first().clone(), ClassScores::single("cup", 0.7));
                sequence.detections.push(Detection {
                    frame: sequence.frames.len() - 1,
                    object: Some(ObjectId(object)),
                    ..Detection::new(camera, bounding_box, scores)
                });
            }
        }
        Arc::new(sequence).into()
    }

    fn frames(stream: FrameStream, count: usize) -> Vec<Observation> {
        stream.observations.take(count).map(Result::unwrap).collect()
    }

    #[test]
    fn a_journal_that_was_cut_off_anywhere_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frames.jsonl");
        let whole = folder.path().join("whole.jsonl");
        let expected = frames(journaled(stream(), &whole, "7").unwrap(), 99);
        assert_eq!(expected.len(), 12);
        assert_eq!(frames(journaled(stream(), &path, "7").unwrap(), 5), expected[..5]);
        let whole = std::fs::read(&path).unwrap();
        for end in (0..whole.len()).step_by(97).chain([whole.len() - 1]) {
            std::fs::write(&path, &whole[..end]).unwrap();
            assert_eq!(frames(journaled(stream(), &path, "7").unwrap(), 99), expected, "cut off at {end}");
            assert_eq!(std::fs::read(&path).unwrap()[..whole.len()], whole);
        }
    }

    #[test]
    fn unused_input_is_reported_again_after_a_resume() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frames.jsonl");
        let with_faults = || {
            let mut stream = stream();
            let faulty = |frame: Result<Observation, SourceError>| {
                frame.map(|frame| {
                    let fault = ",\"unused_input\":[{\"}".to_owned();
                    let unused = UnusedInput::Box { timestamp: frame.frame.timestamp, place: 2, fault };
                    Observation { unused: vec![unused, UnusedInput::Recording("x".into())], ..frame }
                })
            };
            stream.observations = Box::new(stream.observations.map(faulty));
            stream
        };
        let expected = frames(journaled(with_faults(), &path, "7").unwrap(), 99);
        assert_eq!(frames(journaled(with_faults(), &path, "7").unwrap(), 99), expected);
        assert!(expected.iter().all(|frame| frame.unused.len() == 2));
    }

    #[test]
    fn another_stream_is_refused_at_its_first_frame() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frames.jsonl");
        frames(journaled(stream(), &path, "7").unwrap(), 5);
        let mut other = stream();
        other.observations = Box::new(other.observations.skip(2).map(|frame| {
            let mut frame = frame.unwrap();
            frame.detections[0].bounding_box.xmin -= 0.25;
            Ok(frame)
        }));
        let after: Vec<_> = journaled(other, &path, "7").unwrap().observations.skip(5).take(2).collect();
        assert!(
            matches!(after[0], Err(SourceError::OtherJournal { timestamp, .. }) if timestamp > 10.2),
            "{after:?}"
        );
    }

    #[test]
    fn a_file_of_something_else_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frames.jsonl");
        let others = [
            ("notes", "no journal"),
            ("{\"frames\": 1}\n", "no journal"),
            ("{\"frames_for\":\"7\"}\n", "other settings"),
            ("{\"checked_frames_for\":\"8\"}\n", "other settings"),
            ("{\"checked_frames_for\":\"7\"}\nnotes\n", ":2 is no frame"),
        ];
        for (text, words) in others {
            std::fs::write(&path, text).unwrap();
            let error = journaled(stream(), &path, "7").unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        }
    }

    #[test]
    fn a_journal_belongs_to_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frames.jsonl");
        let held = journaled(stream(), &path, "7").unwrap();
        let error = journaled(stream(), &path, "7").unwrap_err();
        assert!(matches!(error, JournalError::InUse { .. }), "{error}");
        drop(held);
        journaled(stream(), &path, "7").unwrap();
    }

    #[test]
    fn a_damaged_line_is_refused_with_its_number() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frames.jsonl");
        frames(journaled(stream(), &path, "7").unwrap(), 4);
        let whole = std::fs::read(&path).unwrap();
        let line = |place: usize| whole[..place].iter().filter(|byte| **byte == b'\n').count() + 1;
        let second = whole.iter().position(|byte| *byte == b'\n').unwrap() + 1;
        for place in (second..whole.len()).step_by(53).filter(|place| whole[*place] != b'\n') {
            let mut damaged = whole.clone();
            damaged[place] = if damaged[place] == b'7' { b'8' } else { b'7' };
            std::fs::write(&path, &damaged).unwrap();
            let error = journaled(stream(), &path, "7").unwrap_err().to_string();
            assert!(error.contains(&format!(":{} is no frame", line(place))), "{error}");
            assert_eq!(std::fs::read(&path).unwrap(), damaged);
        }
    }
}
