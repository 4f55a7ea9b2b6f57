//! Sources of sequences, selected by type in a run's `[source]`.
use crate::camera::CameraNameError;
use crate::recording::OBJECTS_FILE;
use crate::sequence::{ObjectId, Sequence};
use manifactor_config::Diagnostics;
use manifactor_formats::FormatError;
use std::fmt::Debug;
use std::io::BufRead;
use std::path::{Path, PathBuf};

mod assemble;
mod camera;
mod detections;
mod extrinsics;
mod interpolation;
pub mod journal;
mod json_lines;
mod mcap;
mod recorded;
mod rectification;
mod rig;
pub mod stream;
mod tum;

pub use camera::{CalibrationFile, CameraChoice, CameraPose};
pub use detections::DetectionsFile;
pub use interpolation::NoPose;
pub use json_lines::parse;
pub use json_lines::{FrameLine, FurtherCamera, JsonLines, format_line};
pub use mcap::{FurtherMcapCamera, Mcap, McapError, McapFixes};
pub use recorded::{FurtherRecordedCamera, RecordedFiles};
pub use stream::FrameStream;
pub use tum::TumRgbd;

/// A source of a sequence.
#[typetag::serialize(tag = "type")]
pub trait SequenceSource: Debug + Send + Sync {
    /// Reads or simulates the sequence.
    ///
    /// # Errors
    /// Missing or invalid files; empty sequences.
    fn load(&self, folders: &InputFolders) -> Result<Sequence, SourceError>;

    /// Opens the sequence as a stream if frames arrive during mapping; `None` if all frames exist beforehand.
    ///
    /// # Errors
    /// Missing files.
    fn open(&self, _folders: &InputFolders) -> Result<Option<FrameStream>, SourceError> {
        Ok(None)
    }

    /// Opens the sequence as a stream of the lines of `reader`, in place of the file that it names; `None` if it does not
    /// read lines. `name` is the name of the reader in messages.
    ///
    /// # Errors
    /// Missing files.
    fn open_reader(
        &self,
        _folders: &InputFolders,
        _name: &str,
        _reader: Box<dyn BufRead + Send>,
    ) -> Result<Option<FrameStream>, SourceError> {
        Ok(None)
    }

    /// Returns the input files and folders, without reading them.
    ///
    /// # Errors
    /// The first folder or file that does not exist.
    fn find_files(&self, _folders: &InputFolders) -> Result<Vec<PathBuf>, SourceError> {
        Ok(vec![])
    }

    /// Returns whether the sequence may have an up direction. The settings of a run are checked with it before
    /// the data is read.
    fn may_have_up(&self) -> bool {
        true
    }
}

manifactor_graph::kind!(dyn SequenceSource, "source");

/// Folders that contain input files.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct InputFolders {
    /// Folder with public data sets, one folder each: `--data`, or `MANIFACTOR_DATA`.
    pub data: Option<PathBuf>,
    /// Folder of the run's document, which its paths are relative to.
    pub document: PathBuf,
}

impl InputFolders {
    /// Returns the path of a file relative to the document.
    pub fn beside_document(&self, path: &Path) -> PathBuf {
        self.document.join(path)
    }

    /// Returns the folder of a data set. The name is an absolute path or a path relative to the document;
    /// otherwise the data folder is searched, and then the folders in it. `setting` is the setting that has the
    /// name, for messages.
    ///
    /// # Errors
    /// If there is none. The error lists the paths that were tried.
    pub fn data_set(&self, name: &Path, setting: &'static str) -> Result<PathBuf, SourceError> {
        let mut tried = vec![self.beside_document(name)];
        if let Some(data) = self.data.as_ref().filter(|_| name.is_relative()) {
            tried.push(data.join(name));
            let inner = std::fs::read_dir(data).into_iter().flatten().flatten().map(|entry| entry.path());
            let mut inner: Vec<PathBuf> = inner.filter(|path| path.is_dir()).collect();
            // sorted, because the order differs between file systems
            inner.sort();
            tried.extend(inner.into_iter().map(|folder| folder.join(name)));
        }
        let found = tried.iter().find(|path| path.is_dir()).cloned();
        let no_data_folder = self.data.is_none();
        found.ok_or_else(|| SourceError::NoFolder { setting, name: name.to_owned(), tried, no_data_folder })
    }
}

/// Error that prevents reading a sequence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SourceError {
    /// A folder that does not exist.
    #[error("`{setting}` names the folder `{}`, which does not exist; searched: {}", name.display(), paths(tried))]
    NoFolder {
        /// Setting with the name, for example `source.folder`.
        setting: &'static str,
        /// Requested name.
        name: PathBuf,
        /// Paths that were tried.
        tried: Vec<PathBuf>,
        /// True if no data folder was given.
        no_data_folder: bool,
    },
    /// A file that cannot be read or has an invalid format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// A document in a data set that cannot be read.
    #[error(transparent)]
    Document(#[from] Diagnostics),
    /// A true object with an invalid length.
    #[error("{}: object {object}: half_extents must be three finite numbers above zero", file.display())]
    NoObject {
        /// The file.
        file: PathBuf,
        /// The object.
        object: ObjectId,
    },
    /// A sequence with an unknown camera.
    #[error(
        "the camera of `{}` is not known by the name of its folder: set `camera` to \
         {{ fx = …, fy = …, cx = …, cy = …, width = …, height = … }}, or to one of {}", folder.display(), known.join(", ")
    )]
    UnknownCamera {
        /// Folder of the sequence.
        folder: PathBuf,
        /// Names of known cameras.
        known: Vec<&'static str>,
    },
    /// Detections that match no frame.
    #[error(
        "{}: none of {detections} detections was made within {within} s of a pose in {}{}: do the two belong to the same \
         sequence? `{setting}` allows for more", file.display(), odometry.display(), closest(*nearest)
    )]
    NothingMatches {
        /// File of the detections.
        file: PathBuf,
        /// File of the poses.
        odometry: PathBuf,
        /// Number of detections.
        detections: usize,
        /// Largest time difference of a match. Unit: seconds.
        within: f64,
        /// Setting of this limit.
        setting: &'static str,
        /// Detection closest to a pose: its timestamp, and the distance from the pose. Unit: seconds.
        nearest: Option<(f64, f64)>,
    },
    /// A timestamp far ahead of the neighbouring frames.
    #[error(
        "the timestamp {timestamp} s is {ahead:.3} s ahead of the frame before, and the next frame does not confirm it: \
         the frame is left out"
    )]
    Ahead {
        /// Timestamps of the next two frames. Unit: seconds.
        timestamp: f64,
        /// Distance from the previous frame. Unit: seconds.
        ahead: f64,
    },
    /// A first timestamp that is later than those of the next two frames.
    #[error(
        "the first timestamp {timestamp} s comes after those of the next two frames, {} s and {} s: the frame is left out; \
         check the clock of the source", next[0], next[1]
    )]
    FirstAhead {
        /// Timestamps of the next two frames. Unit: seconds.
        timestamp: f64,
        /// Timestamps of the next two frames. Unit: seconds.
        next: [f64; 2],
    },
    /// A line that is not a frame.
    #[error("{}, line {line}: {message}", file.display())]
    Line {
        /// The file.
        file: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// The error.
        message: String,
    },
    /// A stream of lines without frames.
    #[error(
        "{}, line {line}: {count} lines in a row are no frames, so that the rest is not read; a frame is an object with \
         `timestamp` and `pose`: check `source.file`, or the program that writes to standard input. The last line: {message}",
        file.display()
    )]
    NoFrames {
        /// The file.
        file: PathBuf,
        /// Number of the last line, from 1.
        line: usize,
        /// Number of consecutive lines that are not frames.
        count: usize,
        /// The error in the last line.
        message: String,
    },
    /// An image between poses that are too far apart, or outside of them.
    #[error(
        "the image at {timestamp} s is left out, with {boxes} boxes: {}; `source.max_pose_gap` sets the limit", no_pose(*why)
    )]
    ImageWithoutPose {
        /// Timestamp of the image. Unit: seconds.
        timestamp: f64,
        /// Number of its boxes.
        boxes: usize,
        /// The reason.
        why: NoPose,
    },
    /// Changes of the pose graph after the last image with a pose.
    #[error("changes of the pose graph after the last image with a pose are left out: {changes}")]
    ChangesWithoutImage {
        /// Number of factors, removed factors and corrected poses.
        changes: usize,
    },
    /// A frame that is not the one that a journal has for its time.
    #[error(
        "the frame at {timestamp} s is not the one in the journal {}: the journal is that of another stream; give a new file",
        file.display()
    )]
    OtherJournal {
        /// The journal.
        file: PathBuf,
        /// Timestamp of the frame. Unit: seconds.
        timestamp: f64,
    },
    /// A stream that can be read only once and has been read already.
    #[error("{} can be read once, and another variant has read it: run one variant, or give `file`", file.display())]
    ReadBefore {
        /// The stream.
        file: PathBuf,
    },
    /// A box that is impossible for the camera's lens.
    #[error(
        "a box of frame {frame} cannot be used: {fault}; check the camera's numbers and its `distortion`"
    )]
    Distorted {
        /// Frame of the box.
        frame: usize,
        /// The reason.
        fault: String,
    },
    /// A further camera whose name cannot be used.
    #[error(transparent)]
    CameraName(#[from] CameraNameError),
    /// A camera model together with a separate distortion.
    #[error(
        "`source.camera` is a model of its lens and `source.distortion` is another: leave one of them out"
    )]
    DistortedTwice,
    /// A recording of ROS 2 without the needed data.
    #[error(transparent)]
    Mcap(#[from] McapError),
    /// A calibration that cannot be used.
    #[error("{}: {fault}", file.display())]
    Calibration {
        /// The file.
        file: PathBuf,
        /// The fault, with the expected form.
        fault: String,
    },
    /// A simulation that cannot be run.
    #[error("the simulation cannot be run: {0}")]
    Simulation(String),
}

/// Distance above which two files hardly use the same unit: 300 years.
const OTHER_UNIT_S: f64 = 1e10;

fn closest(nearest: Option<(f64, f64)>) -> String {
    let Some((at, away)) = nearest else { return String::new() };
    let unit = if away > OTHER_UNIT_S {
        "; timestamps are in seconds: is one of the files in nanoseconds?"
    } else {
        ""
    };
    format!(" (the closest, at {at} s, is {away:.6} s away{unit})")
}

fn no_pose(why: NoPose) -> String {
    match why {
        NoPose::Before => "there is no pose before it".into(),
        NoPose::After => "there is no pose after it".into(),
        NoPose::Gap(gap) => format!("the poses before and after it are {gap:.3} s apart"),
    }
}

fn paths(tried: &[PathBuf]) -> String {
    tried.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}

/// Returns the path of a file that exists.
///
/// # Errors
/// If its metadata cannot be read.
fn found_file(path: PathBuf) -> Result<PathBuf, SourceError> {
    match std::fs::metadata(&path) {
        Ok(_) => Ok(path),
        Err(source) => Err(FormatError::Io { path, source }.into()),
    }
}

/// Returns the paths of the named files in a folder.
///
/// # Errors
/// The first file that does not exist.
fn found_files(folder: &Path, files: &[Option<&Path>]) -> Result<Vec<PathBuf>, SourceError> {
    files.iter().flatten().map(|file| found_file(folder.join(file))).collect()
}

/// Files of a data set that are read under these names if they exist and no other is named.
const USUAL_FILES: [&str; 3] = ["groundtruth.txt", "accelerometer.txt", OBJECTS_FILE];

/// Returns the paths of the [`USUAL_FILES`] in a folder.
fn usual_files(folder: &Path) -> Vec<PathBuf> {
    USUAL_FILES.iter().map(|name| folder.join(name)).filter(|file| file.is_file()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_is_nowhere_is_reported_with_the_places_tried() {
        let folders = InputFolders { data: None, document: "runs".into() };
        let text = folders.data_set(Path::new("fr1"), "source.folder").unwrap_err().to_string();
        assert!(text.contains("`source.folder`") && text.ends_with("runs/fr1"), "{text}");
    }

    #[test]
    fn data_sets_are_found_one_folder_deep() {
        let root = tempfile::tempdir().unwrap();
        let [runs, data] = ["runs", "data"].map(|name| root.path().join(name));
        let sets = [runs.join("beside"), data.join("direct"), data.join("group/deep")];
        sets.iter().for_each(|set| std::fs::create_dir_all(set).unwrap());
        let folders = InputFolders { data: Some(data), document: runs };
        for (name, set) in ["beside", "direct", "deep"].iter().zip(&sets) {
            assert_eq!(&folders.data_set(Path::new(name), "source.folder").unwrap(), set);
        }
    }
}
