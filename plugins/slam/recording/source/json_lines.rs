use super::assemble::read_ground_truth;
use super::extrinsics::Extrinsics;
use super::interpolation::{InterpolatedFrames, PoseOrImage};
use super::rectification::Rectification;
use super::rig::Rig;
use super::stream::FrameStream;
use super::{CameraChoice, CameraPose, InputFolders, SequenceSource, SourceError, found_files};
use crate::camera::Cameras;
use crate::sequence::{Observation, Sequence, SequenceHeader};
use manifactor_formats::FormatError;
use manifactor_graph::checked::Positive;
use manifactor_graph::{Direction, register};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, stdin};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

mod line;

pub use line::{FrameLine, format_line, parse};

/// Frames as lines of JSON, read one by one as they arrive: from standard input, or from a file.
///
/// A line contains the time, the odometry pose (from the camera frame, z forward, to a world frame that the
/// odometry chooses), and the boxes. Each box has a class and its score, or the scores of several classes.
/// Optional fields: the `object` that a box shows; its `depth`, the distance of the centre along the optical
/// axis in metres, or another registered measurement; accelerometer readings since the previous line.
///
/// A SLAM system that provides the odometry can add to a line:
/// - `odometry_noise`: noise of the step from the previous frame, rotation before translation. Unit: rad, m.
/// - `factors`: loop closures, positions, markers and other factors on poses, with the `type` and parameters of
///   any registered factor and a noise. `keys` are timestamps of frames, and names of variables of the document.
///   A factor with the `id` of an earlier one replaces it.
/// - `removed`: ids of factors to remove.
/// - `corrected`: corrected poses of earlier frames. `pose` refers to the corrected odometry frame.
///
/// With `cameras`, further cameras on the same body have names. A box from one of them names it in the field `camera`.
///
/// With `max_pose_gap`, poses and images may have different timestamps, at different rates. A line has `pose`,
/// `boxes` or both. An image waits for the first pose after it. Images of one time, by several cameras, are one frame; an image that
/// arrives when one of a later time has been used is skipped and reported by `manifactor online`. An image
/// without poses around it is skipped and reported.
///
/// An item of these lists that cannot be used is skipped and reported; the frame stays.
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
    /// Pose of the camera in the frame of the body, if odometry, ground truth, `factors` and `corrected` are about poses of a body, such as a
    /// robot: a pose, or the `file` of a calibration. The camera frame has x to the right, y down and z forward. Default:
    /// they are poses of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_from_camera: Option<CameraPose>,
    /// Further cameras on the same body, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub cameras: BTreeMap<String, FurtherCamera>,
    /// Path of the file, relative to the document. Default: standard input.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Ground-truth trajectory, if there is one: path of a file in TUM's format, relative to the document.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground_truth: Option<PathBuf>,
    /// Up direction in the odometry frame, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<Direction>,
    /// Largest time between two poses, to interpolate the pose of an image between them. Then poses and boxes may
    /// come on separate lines, and lines without `boxes` add no frame. Default: each line is a frame with its
    /// pose. Unit: seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_pose_gap: Option<Positive>,
}

/// A further camera on the body.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FurtherCamera {
    /// The camera.
    pub camera: CameraChoice,
    /// Pose of the camera in the frame of the body; without `source.body_from_camera`, in the frame of the first camera.
    pub body_from_camera: CameraPose,
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

    fn find_files(&self, folders: &InputFolders) -> Result<Vec<PathBuf>, SourceError> {
        let pose = self.body_from_camera.as_ref().and_then(CameraPose::file);
        let files = [self.file.as_deref(), self.ground_truth.as_deref(), self.camera.file(), pose];
        let further = self.cameras.values();
        let others = further.flat_map(|further| [further.camera.file(), further.body_from_camera.file()]);
        found_files(&folders.document, &files.into_iter().chain(others).collect::<Vec<_>>())
    }

    fn may_have_up(&self) -> bool {
        self.up.is_some()
    }

    fn open(&self, folders: &InputFolders) -> Result<Option<FrameStream>, SourceError> {
        Ok(Some(self.open_lines(folders)?))
    }

    fn open_reader(
        &self,
        folders: &InputFolders,
        name: &str,
        reader: Box<dyn BufRead + Send>,
    ) -> Result<Option<FrameStream>, SourceError> {
        Ok(Some(self.stream(folders, name.into(), reader)?))
    }
}
register!(dyn SequenceSource, "json_lines", JsonLines);

impl JsonLines {
    fn open_lines(&self, folders: &InputFolders) -> Result<FrameStream, SourceError> {
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
        self.stream(folders, file, reader)
    }

    /// Returns the frames of a reader. `file` is its name in messages.
    fn stream(
        &self,
        folders: &InputFolders,
        file: PathBuf,
        reader: Box<dyn BufRead + Send>,
    ) -> Result<FrameStream, SourceError> {
        let truth = self.ground_truth.as_deref().map(|file| read_ground_truth(&folders.document, Some(file)));
        let mut ground_truth = truth.transpose()?.flatten();
        let mounting = self.body_from_camera.as_ref().map(|pose| pose.read(&folders.document));
        let body_from_camera = mounting.transpose()?;
        let extrinsics = body_from_camera.map(Extrinsics::new);
        if let (Some(extrinsics), Some(truth)) = (extrinsics, &mut ground_truth) {
            extrinsics.apply_to_ground_truth(truth);
        }
        let lens = Rectification::new(&self.camera, None, &folders.document)?;
        let others =
            self.cameras.iter().map(|(name, further)| (name, &further.camera, &further.body_from_camera));
        let rig = Rig::new(lens, body_from_camera).with(others, &folders.document)?;
        let cameras = rig.cameras.clone();
        let opening = SequenceHeader {
            cameras: cameras.clone(),
            body_from_camera,
            up: self.up,
            georeference: None,
            ground_truth,
        };
        let needs_pose = self.max_pose_gap.is_none();
        let lines =
            FrameLines { file, reader, cameras, line: 0, text: vec![], unreadable: 0, needs_pose }.fuse();
        let lines = lines.map(move |read| {
            let mut line = read?;
            if let Some(extrinsics) = extrinsics {
                extrinsics.apply_to_frame(&mut line.observation);
            }
            Ok(line)
        });
        let frames: Box<dyn Iterator<Item = Result<Observation, SourceError>> + Send> =
            match self.max_pose_gap {
                Some(gap) => Box::new(InterpolatedFrames::new(lines, gap.get())),
                None => Box::new(lines.map(|read| read.map(|line| line.observation))),
            };
        let rectified = frames.map(move |read| {
            read.map(|mut observation| {
                rig.apply_to_frame(&mut observation);
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
    cameras: Cameras,
    line: usize,
    text: Vec<u8>,
    /// Number of consecutive lines before the next one that are not frames.
    unreadable: usize,
    /// True if each line needs a pose.
    needs_pose: bool,
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

    /// Returns the content of the last line that was read.
    fn parse_frame(&mut self) -> Result<PoseOrImage, SourceError> {
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

    fn parse(&self) -> Result<PoseOrImage, String> {
        if self.text.len() as u64 == MAX_LINE_BYTES {
            return Err(format!("the line is longer than {MAX_LINE_BYTES} bytes"));
        }
        let read = line::parse_line(&self.text, &self.cameras)?;
        match (self.needs_pose, read.has_pose, read.is_image) {
            (true, false, _) => Err(
                "missing field `pose`; if poses and boxes come on separate lines, set `source.max_pose_gap`"
                    .into(),
            ),
            (false, false, false) => Err("a line needs `pose`, `boxes` or both".into()),
            _ => Ok(read),
        }
    }
}

impl Iterator for FrameLines {
    type Item = Result<PoseOrImage, SourceError>;

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
    use crate::sequence::UnusedInput;
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
        let UnusedInput::Box { place, fault, .. } = &read[2].as_ref().unwrap().unused[0] else { panic!() };
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
}
