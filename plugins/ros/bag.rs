//! Messages of a recording, in the order of its files.
mod folder;
mod mcap_file;
mod sqlite_file;

use crate::decode::{DecodeError, Definition, ZSTD};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

pub use folder::is_recording;

/// First bytes of an SQLite file.
const SQLITE: &[u8] = b"SQLite format 3";
/// First bytes of a recording of ROS 1.
const ROS_1: &[u8] = b"#ROSBAG";
/// First bytes of an MCAP file.
const MCAP: &[u8] = b"\x89MCAP";

/// Error that prevents reading a recording.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BagError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file has a different format.
    #[error("{}: expected a recording of ROS 2 (MCAP or SQLite), found {found}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// The format, with a remedy if there is one.
        found: &'static str,
    },
    /// The database cannot be read.
    #[error("{}: {source}", path.display())]
    Database {
        /// The file.
        path: PathBuf,
        /// Error of SQLite.
        source: rusqlite::Error,
    },
}

impl BagError {
    /// Returns the error as that of another file, of which this one is a copy.
    fn of_file(self, file: &Path) -> Self {
        let path = file.to_owned();
        match self {
            Self::Io { source, .. } => Self::Io { path, source },
            Self::Format { found, .. } => Self::Format { path, found },
            Self::Database { source, .. } => Self::Database { path, source },
        }
    }
}

/// A topic of a recording.
#[derive(Debug)]
pub struct Topic {
    /// Name, such as `/odom`.
    pub name: String,
    /// Type of its messages, such as `nav_msgs/msg/Odometry`.
    pub message_type: String,
    definition: Result<Definition, DecodeError>,
}

/// A message of a recording.
#[derive(Debug)]
pub struct BagMessage<'a> {
    /// Its topic.
    pub topic: &'a Topic,
    /// Time at which it was recorded. Unit: seconds.
    pub log_time: f64,
    /// Its content in the encoding of the topic.
    pub data: &'a [u8],
}

impl BagMessage<'_> {
    /// Decodes the message and reads it as a type of [`messages`](crate::messages).
    ///
    /// # Errors
    /// If the definition of its type is missing or invalid, or the content does not match it.
    pub fn decode<T: serde::de::DeserializeOwned>(&self) -> Result<T, DecodeError> {
        let definition = self.topic.definition.as_ref().map_err(Clone::clone)?;
        let value = definition.decode(self.data)?;
        serde_json::from_value(value).map_err(|error| DecodeError::Content(error.to_string()))
    }
}

/// The end of a recording.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// The file was read completely.
    Complete,
    /// The file is cut off or damaged. The messages before were read.
    Fault(String),
}

impl Ending {
    /// Returns the ending of a recording of which only some messages were read.
    fn after(messages: usize, fault: &str) -> Self {
        Self::Fault(format!("{fault}, after {messages} messages"))
    }
}

/// Calls a function for each message of a recording, in the order of the file: MCAP, or SQLite (db3). A folder is a
/// recording in several files, which are read by their number. The memory does not depend on the length of the files.
///
/// # Errors
/// If a file cannot be read or has another format, or a folder has no recording.
pub fn read(path: &Path, mut visit: impl FnMut(BagMessage<'_>)) -> Result<Ending, BagError> {
    let mut faults = vec![];
    for file in folder::files(path)? {
        match read_file(&file, &mut visit)? {
            // the other files are read nevertheless
            Ending::Fault(fault) if file != *path => faults.push(format!("{}: {fault}", file.display())),
            Ending::Fault(fault) => faults.push(fault),
            Ending::Complete => {}
        }
    }
    Ok(if faults.is_empty() { Ending::Complete } else { Ending::Fault(faults.join("; ")) })
}

fn read_file(path: &Path, visit: &mut dyn FnMut(BagMessage<'_>)) -> Result<Ending, BagError> {
    match format(path)? {
        FileFormat::Mcap => mcap_file::read(path, visit),
        FileFormat::Sqlite => sqlite_file::read(path, visit),
        FileFormat::Zstd => {
            let io = |source| BagError::Io { path: path.to_owned(), source };
            let mut plain = NamedTempFile::new().map_err(io)?;
            let fault = match zstd::stream::copy_decode(File::open(path).map_err(io)?, &mut plain) {
                Err(fault) if plain.as_file().metadata().map_err(io)?.len() == 0 => return Err(io(fault)),
                ended => ended.err(),
            };
            let ending = match format(plain.path()) {
                Ok(FileFormat::Zstd) => {
                    let found = "a file compressed twice by zstd";
                    return Err(BagError::Format { path: path.to_owned(), found });
                }
                Ok(_) => read_file(plain.path(), visit),
                Err(error) => Err(error),
            };
            let ending = ending.map_err(|error| error.of_file(path))?;
            // a file that is cut off is read up to there
            Ok(fault.map_or(ending, |fault| {
                Ending::Fault(format!("it cannot be decompressed completely: {fault}"))
            }))
        }
    }
}

enum FileFormat {
    Mcap,
    Sqlite,
    /// One of the others, compressed.
    Zstd,
}

/// Returns the format of a file by its first bytes.
fn format(path: &Path) -> Result<FileFormat, BagError> {
    let io = |source| BagError::Io { path: path.to_owned(), source };
    let mut start = vec![];
    File::open(path).map_err(io)?.take(SQLITE.len() as u64).read_to_end(&mut start).map_err(io)?;
    let found = match &start[..] {
        start if start.starts_with(MCAP) => return Ok(FileFormat::Mcap),
        start if start == SQLITE => return Ok(FileFormat::Sqlite),
        start if start.starts_with(ZSTD) => return Ok(FileFormat::Zstd),
        [] => "an empty file",
        start if start.starts_with(ROS_1) => "a recording of ROS 1: convert it to MCAP with `mcap convert`",
        _ => "something else",
    };
    Err(BagError::Format { path: path.to_owned(), found })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{STRING, recording, string_message};

    #[derive(serde::Deserialize)]
    struct Text {
        data: String,
    }

    fn texts(bytes: &[u8]) -> (Vec<String>, Ending) {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        let mut texts = vec![];
        let ending = read(file.path(), |message| texts.push(message.decode::<Text>().unwrap().data)).unwrap();
        (texts, ending)
    }

    #[test]
    fn a_recording_that_is_cut_off_is_read_up_to_there() {
        let sent: Vec<String> = (0..40).map(|i| format!("message {i}")).collect();
        let messages = sent.iter().zip(0..).map(|(text, i)| ("/chatter", i as f64, string_message(text)));
        let whole = recording(&[("/chatter", STRING)], messages);
        assert_eq!(texts(&whole), (sent.clone(), Ending::Complete));
        for end in (8..whole.len() - 8).step_by(61) {
            let (read, ending) = texts(&whole[..end]);
            assert_eq!(read, sent[..read.len()], "cut off at {end}");
            let Ending::Fault(fault) = ending else { panic!("cut off at {end}") };
            assert!(fault.starts_with("the file is cut off, after"), "{fault}");
        }
    }

    #[test]
    fn a_compressed_file_is_read_up_to_its_end() {
        let sent: Vec<String> =
            (0..20_000_u64).map(|i| format!("{}", i.wrapping_mul(0x9e37_79b9_7f4a_7c15))).collect();
        let messages = sent.iter().zip(0..).map(|(text, i)| ("/chatter", i as f64, string_message(text)));
        let whole = zstd::encode_all(&recording(&[("/chatter", STRING)], messages)[..], 0).unwrap();
        assert_eq!(texts(&whole), (sent.clone(), Ending::Complete));
        let (read_before, ending) = texts(&whole[..whole.len() / 2]);
        let Ending::Fault(fault) = ending else { panic!("complete") };
        assert!(fault.contains("decompressed") && read_before.len() > 5_000, "{fault}");
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), &whole[..20]).unwrap();
        assert!(read(file.path(), |_| ()).is_err());
        std::fs::write(file.path(), zstd::encode_all(&whole[..], 0).unwrap()).unwrap();
        let error = read(file.path(), |_| ()).unwrap_err().to_string();
        assert!(
            error.contains("compressed twice") && error.contains(&*file.path().to_string_lossy()),
            "{error}"
        );
    }

    #[test]
    fn a_damaged_recording_is_no_reason_to_panic() {
        let messages = (0..20).map(|i| ("/chatter", f64::from(i), string_message("some text")));
        let whole = recording(&[("/chatter", STRING)], messages);
        let file = tempfile::NamedTempFile::new().unwrap();
        for place in 5..whole.len() {
            let mut damaged = whole.clone();
            damaged[place] ^= 0x55;
            std::fs::write(file.path(), &damaged).unwrap();
            let mut faults = 0;
            if let Ok(Ending::Complete) =
                read(file.path(), |m| faults += usize::from(m.decode::<Text>().is_err()))
            {
                assert!(faults <= 20);
            }
        }
    }

    #[test]
    fn other_formats_are_named() {
        for (start, words) in [("#ROSBAG V2.0\n", "ROS 1"), ("", "empty"), ("PK", "something")] {
            let file = tempfile::NamedTempFile::new().unwrap();
            std::fs::write(file.path(), start).unwrap();
            let error = read(file.path(), |_| ()).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
