use super::assemble::read_ground_truth;
use super::rectification::Rectification;
use super::stream::FrameStream;
use super::{CameraChoice, InputFolders, SequenceSource, SourceError, check_files};
use crate::measurement::Quantities;
use crate::sequence::{
    Acceleration, ClassScores, Detection, Frame, ObjectId, Observation, Sequence, SequenceHeader,
    UnusedDetection,
};
use indexmap::IndexMap;
use manifactor_formats::FormatError;
use manifactor_geometry::Se3;
use manifactor_graph::checked::Share;
use manifactor_graph::{Direction, register};
use manifactor_quadric::BoundingBox;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{BufRead, BufReader, Read, stdin};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

/// Frames as lines of JSON, read one by one as they arrive: from standard input, or from a file.
///
/// A line contains the time, the odometry pose (from the camera frame, z forward, to a world frame that the
/// odometry chooses), and the boxes. Each box has a class and its score, or the scores of several classes.
/// Optional fields: the `object` that a box shows; its `depth`, the distance of the centre along the optical
/// axis in metres, or another registered measurement; accelerometer readings since the previous line.
///
/// ```json
/// {"timestamp": 0.1, "pose": {"translation": [0.0, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0]}, "boxes": [{"box": [10.0, 20.0, 90.0, 80.0], "class": "cup", "score": 0.8}]}
/// ```
///
/// A box that cannot be read is skipped and reported; the frame stays. A line that is not a frame is skipped
/// and reported by `manifactor online`. It is an error in `manifactor run`, which reads all lines first.
///
/// ```toml
/// source = { type = "json_lines", camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 } }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JsonLines {
    /// The camera.
    pub camera: CameraChoice,
    /// Path of the file, relative to the document. Default: standard input.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Ground-truth trajectory, if there is one: path of a file in TUM's format, relative to the document.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground_truth: Option<PathBuf>,
    /// Up direction in the odometry frame, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<Direction>,
}

/// A frame in the form of a line.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    /// Timestamp. Unit: seconds.
    timestamp: f64,
    pose: Se3,
    #[serde(default)]
    boxes: Vec<serde_json::Value>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    accelerometer: Vec<AccelerometerReading>,
}

/// A box in the form of a line; `quantities` collects all further fields.
#[derive(Debug, Serialize, Deserialize)]
struct LineBox {
    #[serde(rename = "box")]
    bounding_box: BoundingBox,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    class: Option<String>,
    #[serde(default = "certain_score", skip_serializing_if = "is_certain")]
    score: Share,
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    scores: IndexMap<String, f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    object: Option<ObjectId>,
    #[serde(flatten)]
    quantities: IndexMap<String, serde_json::Value>,
}

/// Fields of a box besides its measurements.
const FIELDS: [&str; 5] = ["box", "class", "score", "scores", "object"];

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct AccelerometerReading {
    timestamp: f64,
    acceleration: Vector3<f64>,
}

fn certain_score() -> Share {
    Share::literal(1.0)
}
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_certain(score: &Share) -> bool {
    **score >= 1.0
}

/// Returns a frame as a line for this source, without the line end.
pub fn format_line(observation: &Observation) -> String {
    let of_box = |detection: &Detection| {
        let scores: IndexMap<String, f64> = detection.scores.iter().map(|(c, s)| (c.to_owned(), s)).collect();
        let first = scores.first().filter(|_| scores.len() == 1);
        let single = first.and_then(|(class, score)| Some((class.clone(), Share::new(*score).ok()?)));
        LineBox {
            bounding_box: detection.bounding_box,
            scores: if single.is_some() { IndexMap::new() } else { scores },
            score: single.as_ref().map_or_else(certain_score, |(_, score)| *score),
            class: single.map(|(class, _)| class),
            object: detection.object,
            quantities: detection.quantities.to_fields().collect(),
        }
    };
    let of_reading =
        |r: &Acceleration| AccelerometerReading { timestamp: r.timestamp, acceleration: r.acceleration };
    let line = Line {
        timestamp: observation.frame.timestamp,
        pose: observation.frame.world_from_camera,
        boxes: observation
            .detections
            .iter()
            .map(of_box)
            .filter_map(|b| serde_json::to_value(b).ok())
            .collect(),
        accelerometer: observation.accelerometer.iter().map(of_reading).collect(),
    };
    serde_json::to_string(&line).unwrap_or_default()
}

/// Reads a frame from such a line.
pub fn parse(line: &[u8]) -> Result<Observation, String> {
    let read = serde_json::from_slice(line).or_else(|error| match without_infinities(line) {
        Some(text) => serde_json::from_str(&text),
        None => Err(error),
    });
    let Line { timestamp, pose, boxes, accelerometer } =
        read.map_err(|error: serde_json::Error| error.to_string())?;
    let (mut detections, mut unused) = (vec![], vec![]);
    for (place, value) in boxes.into_iter().enumerate() {
        match LineBox::read(value) {
            Ok(seen) => detections.push(seen),
            Err(fault) => unused.push(UnusedDetection::Box { timestamp, place: place + 1, fault }),
        }
    }
    let of_reading =
        |r: AccelerometerReading| Acceleration { timestamp: r.timestamp, acceleration: r.acceleration };
    Ok(Observation {
        frame: Frame { timestamp, world_from_camera: pose },
        detections,
        accelerometer: accelerometer.into_iter().map(of_reading).collect(),
        unused,
    })
}

/// Returns the line with `null` in place of each non-finite number; `None` if all numbers are finite. JSON
/// has no such numbers, but programs in several languages write them. A field that needs a number rejects
/// `null`; in a box this rejects only the box.
fn without_infinities(line: &[u8]) -> Option<String> {
    let text = std::str::from_utf8(line).ok()?;
    let (mut out, mut word, mut found) = (String::with_capacity(text.len()), String::new(), false);
    let (mut is_text, mut is_escaped) = (false, false);
    for c in text.chars().chain(['\n']) {
        if !is_text && (c.is_ascii_alphanumeric() || ['+', '-', '.'].contains(&c)) {
            word.push(c);
            continue;
        }
        if !word.is_empty() {
            let is_infinite = word.parse::<f64>().is_ok_and(|number| !number.is_finite());
            found |= is_infinite;
            out += if is_infinite { "null" } else { &word };
            word.clear();
        }
        match c {
            '"' if !is_escaped => is_text = !is_text,
            _ => {}
        }
        is_escaped = is_text && c == '\\' && !is_escaped;
        out.push(c);
    }
    found.then_some(out)
}

impl LineBox {
    fn read(value: serde_json::Value) -> Result<Detection, String> {
        let seen: Self = serde_json::from_value(value).map_err(|error| error.to_string())?;
        if let Some((class, score)) = seen.scores.iter().find(|(_, score)| !(0.0..=1.0).contains(*score)) {
            return Err(format!("the score of `{class}` must be a number from 0 to 1, got {score}"));
        }
        match &seen.class {
            Some(class) if !seen.scores.is_empty() => {
                Err(format!("a box has `class` and `score`, or `scores`, and not both: `{class}`"))
            }
            _ => seen.into_detection(),
        }
    }

    fn into_detection(self) -> Result<Detection, String> {
        let single = self.class.map(|class| (class, self.score.get()));
        let scores: ClassScores = self.scores.into_iter().chain(single).collect();
        let quantities = Quantities::read(self.quantities, &FIELDS)?;
        Ok(Detection { frame: 0, object: self.object, scores, bounding_box: self.bounding_box, quantities })
    }
}

/// True once standard input has been read: it can be read only once.
static STDIN_IS_READ: AtomicBool = AtomicBool::new(false);
/// Name of standard input in messages.
const STDIN_NAME: &str = "standard input";
/// Some editors write it at the beginning of a file.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
/// Bytes of the longest line that can be a frame.
const MAX_LINE_BYTES: u64 = 1 << 26;
/// Reading stops after this many further bytes without a line end.
const MAX_SKIPPED_BYTES: u64 = 1 << 30;
/// Reading stops after this many consecutive lines that are not frames: half a minute of a camera at 30 Hz. A
/// device such as `/dev/urandom`, or an unrelated file, may have no frames and no end.
const MAX_UNREADABLE_LINES: usize = 1000;

#[typetag::serialize(name = "json_lines")]
impl SequenceSource for JsonLines {
    fn load(&self, folders: &InputFolders) -> Result<Sequence, SourceError> {
        self.open_lines(folders)?.collect()
    }

    fn find_files(&self, folders: &InputFolders) -> Result<(), SourceError> {
        check_files(&folders.document, &[self.file.as_deref(), self.ground_truth.as_deref()])
    }

    fn may_have_up(&self) -> bool {
        self.up.is_some()
    }

    fn open(&self, folders: &InputFolders) -> Result<Option<FrameStream>, SourceError> {
        Ok(Some(self.open_lines(folders)?))
    }
}
register!(dyn SequenceSource, "json_lines", JsonLines);

impl JsonLines {
    fn open_lines(&self, folders: &InputFolders) -> Result<FrameStream, SourceError> {
        let truth = self.ground_truth.as_deref().map(|file| read_ground_truth(&folders.document, Some(file)));
        let ground_truth = truth.transpose()?.flatten();
        let lens = Rectification::new(&self.camera, None)?;
        let opening = SequenceHeader { camera: lens.camera, up: self.up, ground_truth };
        let (file, reader): (_, Box<dyn BufRead + Send>) = match &self.file {
            Some(file) => {
                let file = folders.beside_document(file);
                let opened =
                    File::open(&file).map_err(|source| FormatError::Io { path: file.clone(), source })?;
                (file, Box::new(BufReader::new(opened)))
            }
            None if STDIN_IS_READ.swap(true, Ordering::Relaxed) => {
                return Err(SourceError::ReadBefore { file: STDIN_NAME.into() });
            }
            None => (STDIN_NAME.into(), Box::new(BufReader::new(stdin()))),
        };
        let lines = FrameLines { file, reader, line: 0, text: vec![], unreadable: 0 };
        let rectified = lines.fuse().map(move |read| {
            read.map(|mut observation| {
                lens.apply_to_frame(&mut observation);
                observation
            })
        });
        Ok(FrameStream::new(opening, rectified))
    }
}

/// Lines of a file, up to its end or to a read error.
struct FrameLines {
    file: PathBuf,
    reader: Box<dyn BufRead + Send>,
    line: usize,
    text: Vec<u8>,
    /// Number of consecutive lines before the next one that are not frames.
    unreadable: usize,
}

impl FrameLines {
    /// Reads the next line and returns its length, 0 at the end.
    fn read(&mut self) -> std::io::Result<usize> {
        self.line += 1;
        self.text.clear();
        let read = self.reader.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut self.text)?;
        if read as u64 == MAX_LINE_BYTES && !self.text.ends_with(b"\n") {
            // skips the rest of the line; a line that never ends is an error
            let skipped = self.reader.by_ref().take(MAX_SKIPPED_BYTES).skip_until(b'\n')?;
            if skipped as u64 == MAX_SKIPPED_BYTES {
                return Err(std::io::Error::other("there is no end of a line within a gigabyte"));
            }
        }
        if self.line == 1 && self.text.starts_with(BYTE_ORDER_MARK) {
            self.text.drain(..BYTE_ORDER_MARK.len());
        }
        Ok(read)
    }

    /// Stops reading.
    fn stop_reading(&mut self) {
        self.reader = Box::new(std::io::empty());
    }

    /// Returns the frame of the last line that was read.
    fn parse_frame(&mut self) -> Result<Observation, SourceError> {
        let read = self.parse();
        self.unreadable = if read.is_ok() { 0 } else { self.unreadable + 1 };
        let (file, line) = (self.file.clone(), self.line);
        read.map_err(|message| match self.unreadable {
            MAX_UNREADABLE_LINES => {
                self.stop_reading();
                SourceError::NoFrames { file, line, count: MAX_UNREADABLE_LINES, message }
            }
            _ => SourceError::Line { file, line, message },
        })
    }

    fn parse(&self) -> Result<Observation, String> {
        if self.text.len() as u64 == MAX_LINE_BYTES {
            return Err(format!("the line is longer than {MAX_LINE_BYTES} bytes"));
        }
        parse(&self.text)
    }
}

impl Iterator for FrameLines {
    type Item = Result<Observation, SourceError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.read() {
                Ok(0) => return None,
                Ok(_) if self.text.trim_ascii().is_empty() => {}
                Ok(_) => return Some(self.parse_frame()),
                Err(source) => {
                    self.stop_reading();
                    return Some(Err(FormatError::Io { path: self.file.clone(), source }.into()));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use std::path::Path;

    fn source(folder: &Path, file: &str) -> JsonLines {
        let camera =
            json!({ "fx": 320.0, "fy": 320.0, "cx": 320.0, "cy": 240.0, "width": 640, "height": 480 });
        std::fs::write(folder.join("frames.jsonl"), file).unwrap();
        serde_json::from_value(json!({ "camera": camera, "file": "frames.jsonl" })).unwrap()
    }

    #[test]
    fn a_line_that_is_no_frame_is_reported_and_a_bad_box_leaves_its_frame() {
        let good = r#"{"timestamp": 1.0, "pose": {"translation": [0, 0, 0], "rotation": [0, 0, 0, 1]}}"#;
        let bad_box = good.replace("}}", r#"}, "boxes": [{"box": [9, 0, 1, 1]}]}"#);
        let text = format!("\u{feff}{good}\n{{\n{bad_box}\n{good}");
        let folder = tempfile::tempdir().unwrap();
        let folders = InputFolders { data: None, document: folder.path().into() };
        let source = source(folder.path(), &text);
        let stream = source.open(&folders).unwrap().unwrap();
        let read: Vec<_> = stream.observations.collect();
        assert_eq!(read.iter().map(Result::is_ok).collect::<Vec<_>>(), [true, false, true, true]);
        let UnusedDetection::Box { place, fault, .. } = &read[2].as_ref().unwrap().unused[0] else {
            panic!()
        };
        assert!(*place == 1 && fault.contains("expected [xmin, ymin, xmax, ymax]"), "{fault}");
        let error = source.load(&folders).unwrap_err().to_string();
        assert!(error.contains("line 2"), "{error}");
    }

    #[test]
    fn a_file_without_frames_is_given_up() {
        let good = r#"{"timestamp": 1.0, "pose": {"translation": [0, 0, 0], "rotation": [0, 0, 0, 1]}}"#;
        let bad = "\u{1}{?\n".repeat(MAX_UNREADABLE_LINES - 1);
        let folder = tempfile::tempdir().unwrap();
        let folders = InputFolders { data: None, document: folder.path().into() };
        let read = |text: &str| -> Vec<_> {
            let stream = source(folder.path(), text).open(&folders).unwrap().unwrap();
            stream.observations.collect()
        };
        // a frame in between resets the count
        let sound = read(&format!("{bad}{good}\n{bad}{good}\n"));
        assert_eq!(
            (sound.len(), sound.iter().filter(|read| read.is_ok()).count()),
            (2 * MAX_UNREADABLE_LINES, 2)
        );
        let given_up = read(&format!("{good}\n{bad}{bad}{good}\n"));
        assert_eq!(given_up.len(), 1 + MAX_UNREADABLE_LINES);
        let error = given_up.last().unwrap().as_ref().unwrap_err().to_string();
        let place =
            format!("line {}: {MAX_UNREADABLE_LINES} lines in a row are no frames", MAX_UNREADABLE_LINES + 1);
        assert!(error.contains(&place) && error.contains("check `source.file`"), "{error}");
    }

    #[test]
    fn scores_are_from_0_to_1_and_given_once() {
        let line = |seen: &str| {
            format!(
                r#"{{"timestamp": 1.0, "pose": {{"translation": [0, 0, 0], "rotation": [0, 0, 0, 1]}}, "boxes": [{seen}]}}"#
            )
        };
        let wrong = [
            (r#"{"box": [1, 1, 5, 5], "class": "cup", "score": 1.7}"#, "0"),
            (
                r#"{"box": [1, 1, 5, 5], "scores": {"cup": 1.7}}"#,
                "the score of `cup` must be a number from 0 to 1",
            ),
            (r#"{"box": [1, 1, 5, 5], "class": "cup", "scores": {"cup": 0.7}}"#, "and not both: `cup`"),
            (r#"{"box": [1, 1, 5, NaN], "class": "Infinity \" NaN"}"#, "null"),
            (r#"{"box": [1, -Infinity, 5, 5], "class": "cup"}"#, "null"),
            (r#"{"box": [1, 1, 1e999, 5], "class": "cup"}"#, "null"),
        ];
        for (seen, words) in wrong {
            let good = r#"{"box": [1, 1, 5, 5], "class": "cup"}"#;
            let read = parse(line(&format!("{seen}, {good}")).as_bytes()).unwrap();
            let UnusedDetection::Box { place, fault, .. } = &read.unused[0] else { panic!() };
            assert!(*place == 1 && fault.contains(words) && read.detections.len() == 1, "{fault}");
        }
        let two =
            parse(line(r#"{"box": [1, 1, 5, 5], "scores": {"cup": 0.7, "bowl": 0.2}}"#).as_bytes()).unwrap();
        assert_eq!(two.detections[0].scores.iter().count(), 2);
    }
}
