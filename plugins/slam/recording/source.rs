//! Where sequences come from, chosen by name in a run's `[source]`.
use crate::sequence::{ObjectId, Sequence};
use manifactor_config::Diagnostics;
use manifactor_formats::FormatError;
use std::fmt::Debug;
use std::path::{Path, PathBuf};

mod assemble;
mod camera;
pub mod journal;
mod json_lines;
mod recorded;
mod rectification;
pub mod stream;
mod tum;

pub use camera::CameraChoice;
pub use json_lines::parse;
pub use json_lines::{JsonLines, line};
pub use recorded::Recorded;
pub use rectification::Distortion;
pub use stream::Stream;
pub use tum::TumRgbd;

/// A source of a sequence.
#[typetag::serialize(tag = "type")]
pub trait Source: Debug + Send + Sync {
    /// Reads or makes the sequence.
    ///
    /// # Errors
    /// Files that are not there or not what they should be; sequences of nothing.
    fn load(&self, folders: &Folders) -> Result<Sequence, SourceError>;

    /// The same frame by frame, where frames come while they are mapped; `None` where all of them are there before.
    ///
    /// # Errors
    /// Files that are not there.
    fn open(&self, _folders: &Folders) -> Result<Option<Stream>, SourceError> {
        Ok(None)
    }
}

manifactor_graph::kind!(dyn Source, "source");

/// Where files are looked for.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Folders {
    /// Where public data sets lie, each in a folder of its own: `--data`, or `MANIFACTOR_DATA`.
    pub data: Option<PathBuf>,
    /// The folder of the run's document, from which its own files are named.
    pub document: PathBuf,
}

impl Folders {
    /// A file that belongs to the document.
    pub fn beside_document(&self, path: &Path) -> PathBuf {
        self.document.join(path)
    }

    /// A data set's folder: as it stands if it is absolute or lies beside the document; else in the data folder, or in
    /// one of the folders there.
    ///
    /// # Errors
    /// If there is none, with the places that were tried.
    pub fn data_set(&self, name: &Path) -> Result<PathBuf, SourceError> {
        let mut tried = vec![self.beside_document(name)];
        if let Some(data) = self.data.as_ref().filter(|_| name.is_relative()) {
            tried.push(data.join(name));
            let inner = std::fs::read_dir(data).into_iter().flatten().flatten().map(|entry| entry.path());
            let mut inner: Vec<PathBuf> = inner.filter(|path| path.is_dir()).collect();
            // the order of a folder differs between file systems
            inner.sort();
            tried.extend(inner.into_iter().map(|folder| folder.join(name)));
        }
        let found = tried.iter().find(|path| path.is_dir()).cloned();
        let no_data_folder = self.data.is_none();
        found.ok_or_else(|| SourceError::NoFolder { name: name.to_owned(), tried, no_data_folder })
    }
}

/// Why there is no sequence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SourceError {
    /// A folder that is nowhere.
    #[error("{}", no_folder(name, tried, *no_data_folder))]
    NoFolder {
        /// What was asked for.
        name: PathBuf,
        /// Where it was looked for.
        tried: Vec<PathBuf>,
        /// Whether no data folder was given.
        no_data_folder: bool,
    },
    /// A file that cannot be read, or that is not what it should be.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// A document in a data set that cannot be read.
    #[error(transparent)]
    Document(#[from] Diagnostics),
    /// A true object with a length that nothing has.
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
        /// The sequence's folder.
        folder: PathBuf,
        /// Cameras that have a name.
        known: Vec<&'static str>,
    },
    /// Detections of which none belongs to a frame.
    #[error(
        "{}: none of {detections} detections was made within {within} s of a pose in {}{}: do the two belong to the same \
         sequence? `max_time_difference` allows for more", file.display(), odometry.display(), closest(*nearest)
    )]
    NothingMatches {
        /// The file of detections.
        file: PathBuf,
        /// The file of poses.
        odometry: PathBuf,
        /// How many detections there are.
        detections: usize,
        /// Seconds.
        within: f64,
        /// Of the detection that is closest to a pose: its time stamp, and how far the pose is away, in seconds.
        nearest: Option<(f64, f64)>,
    },
    /// A timestamp far ahead of the frames around it.
    #[error(
        "the timestamp {timestamp} s is {ahead:.3} s ahead of the frame before, and the next frame does not confirm it: \
         the frame is left out"
    )]
    Ahead {
        /// In seconds.
        timestamp: f64,
        /// By how much, in seconds.
        ahead: f64,
    },
    /// A first timestamp that comes after those of the next two frames.
    #[error(
        "the first timestamp {timestamp} s comes after those of the next two frames, {} s and {} s: the frame is left out; \
         check the clock of the source", next[0], next[1]
    )]
    FirstAhead {
        /// In seconds.
        timestamp: f64,
        /// In seconds.
        next: [f64; 2],
    },
    /// A line that is no frame.
    #[error("{}, line {line}: {message}", file.display())]
    Line {
        /// The file.
        file: PathBuf,
        /// From 1.
        line: usize,
        /// What is wrong with it.
        message: String,
    },
    /// A stream of lines that has no frames any more.
    #[error(
        "{}, line {line}: {count} lines in a row are no frames, so that the rest is not read; a frame is an object with \
         `timestamp` and `pose`: check `source.file`, or the program that writes to standard input. The last line: {message}",
        file.display()
    )]
    NoFrames {
        /// The file.
        file: PathBuf,
        /// The last of them, from 1.
        line: usize,
        /// How many there are.
        count: usize,
        /// The fault of the last one.
        message: String,
    },
    /// A stream that is there once, and was read.
    #[error("{} can be read once, and another variant has read it: run one variant, or give `file`", file.display())]
    ReadBefore {
        /// The stream.
        file: PathBuf,
    },
    /// A box that a lens cannot have shown.
    #[error(
        "the box {bounds:?} of frame {frame} has no place in the rectified image: check the camera's numbers and its `distortion`"
    )]
    Distorted {
        /// Of the box.
        frame: usize,
        /// xmin, ymin, xmax, ymax, in pixels.
        bounds: [f64; 4],
    },
    /// A camera model with a distortion beside it.
    #[error(
        "`source.camera` is a model of its lens and `source.distortion` is another: leave one of them out"
    )]
    DistortedTwice,
    /// A simulation that cannot be run.
    #[error("the simulation cannot be run: {0}")]
    Simulation(String),
}

fn closest(nearest: Option<(f64, f64)>) -> String {
    let told = |(at, away)| format!(" (the closest, at {at} s, is {away:.6} s away)");
    nearest.map(told).unwrap_or_default()
}

fn no_folder(name: &Path, tried: &[PathBuf], no_data_folder: bool) -> String {
    let name = name.display();
    let tried: Vec<String> = tried.iter().map(|path| format!("\n  {}", path.display())).collect();
    let data = if no_data_folder {
        "say where data sets lie with --data FOLDER, or the environment variable MANIFACTOR_DATA"
    } else {
        "check the name, and the folder given by --data or MANIFACTOR_DATA"
    };
    format!("there is no folder `{name}`: {data}; it was looked for at{}", tried.concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_is_nowhere_is_told_with_the_places_tried() {
        let folders = Folders { data: None, document: "runs".into() };
        let text = folders.data_set(Path::new("fr1")).unwrap_err().to_string();
        assert!(text.contains("MANIFACTOR_DATA") && text.ends_with("runs/fr1"), "{text}");
    }

    #[test]
    fn data_sets_are_found_one_folder_deep() {
        let data = Path::new(env!("CARGO_MANIFEST_DIR"));
        let folders = Folders { data: Some(data.parent().unwrap().to_owned()), document: data.into() };
        assert_eq!(folders.data_set(Path::new("settings")).unwrap(), data.join("settings"));
        let found = folders.data_set(Path::new("gravity")).unwrap();
        assert_eq!(found, data.join("gravity"));
        let deep = Folders { document: "elsewhere".into(), ..folders };
        assert!(deep.data_set(Path::new("slam")).unwrap().ends_with("slam"));
        assert!(deep.data_set(Path::new("semantics")).unwrap().ends_with("slam/semantics"));
    }
}
