//! Frames on disk as they come, so that a stream that was cut off goes on.
//!
//! The first line says for which settings; each other is a frame, as the source `json_lines` has it. The same frames give the
//! same bits: a program that was killed reads them again, and has the map that it had. A last line without an end is dropped. A file that
//! is no journal, or that of other settings, is refused and not touched.
use crate::input::sequence::Observation;
use crate::input::source::{line, parse};
use crate::input::stream::Stream;
use manifactor_formats::FormatError;
use manifactor_formats::whole::open_regular;
use manifactor_graph::Manifold;
use std::collections::HashSet;
use std::fs::{File, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// Why frames cannot be kept.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    /// A file that cannot be read or written.
    #[error(transparent)]
    File(#[from] FormatError),
    /// Somebody else's.
    #[error("{}: another program writes to this journal", path.display())]
    InUse {
        /// Which.
        path: PathBuf,
    },
    /// A file of something else.
    #[error("{} is no journal of frames: name another file", path.display())]
    NoJournal {
        /// Which.
        path: PathBuf,
    },
    /// A map that cannot be had again.
    #[error("{} is the journal of other settings, or of another version: name another file to begin anew", path.display())]
    OtherSettings {
        /// Which.
        path: PathBuf,
    },
    /// A run that is several.
    #[error("a journal is that of one variant: name another document, or leave all others out")]
    Variants,
    /// A whole line that is no frame.
    #[error("{}:{line} is no frame: {message}; move the file away to begin anew", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
}

/// How the first line begins; a fingerprint of the settings follows.
const BEGINNING: &str = r#"{"frames_for":""#;

/// The frames of a journal, which is begun where it is not there, then those of the stream that come after them, which are added to it.
///
/// # Errors
/// Where the file cannot be read or written, is a link, or is not the journal of these settings; it is unchanged then.
pub fn journaled(stream: Stream, path: &Path, fingerprint: &str) -> Result<Stream, JournalError> {
    let io = |source| FormatError::Io { path: path.to_owned(), source };
    let mut file = open_regular(path).map_err(io)?;
    file.try_lock().map_err(|error| match error {
        TryLockError::WouldBlock => JournalError::InUse { path: path.to_owned() },
        TryLockError::Error(source) => io(source).into(),
    })?;
    let mut bytes = vec![];
    file.read_to_end(&mut bytes).map_err(io)?;
    let header = format!("{BEGINNING}{fingerprint}\"}}\n");
    if header.as_bytes().starts_with(&bytes) {
        file.set_len(0).and_then(|()| file.write_all(header.as_bytes())).map_err(io)?;
        bytes.clear();
    } else if !bytes.starts_with(header.as_bytes()) {
        let path = path.to_owned();
        let is_ours = bytes.starts_with(BEGINNING.as_bytes());
        return Err(if is_ours {
            JournalError::OtherSettings { path }
        } else {
            JournalError::NoJournal { path }
        });
    }
    let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
    let lines =
        bytes[..whole].split(|byte| *byte == b'\n').enumerate().skip(1).filter(|(_, line)| !line.is_empty());
    let frame = |(i, line): (usize, &[u8])| {
        parse(line).map_err(|message| JournalError::Line { path: path.to_owned(), line: i + 1, message })
    };
    let before = lines.map(frame).collect::<Result<Vec<Observation>, _>>()?;
    if whole < bytes.len() {
        file.set_len(whole as u64).map_err(io)?;
    }
    let past = before.iter().map(|frame| frame.frame.timestamp).fold(f64::NEG_INFINITY, f64::max);
    let path = path.to_owned();
    let had: HashSet<u64> = before.iter().map(|frame| frame.frame.timestamp.to_bits()).collect();
    let is_new = move |frame: &Result<Observation, _>| {
        frame.as_ref().map_or(true, |frame| !had.contains(&frame.frame.timestamp.to_bits()))
    };
    let new = stream.observations.filter(is_new);
    let kept = new.map(move |frame| {
        let keep = keep(&mut file, frame?);
        Ok(keep.map_err(|source| FormatError::Io { path: path.clone(), source })?)
    });
    let observations = Box::new(before.into_iter().map(Ok).chain(kept));
    Ok(Stream { opening: stream.opening, observations, past })
}

/// Adds a frame, and returns it as it will be read: a rotation that is written and read may differ in its last digit. One that is not finite, which
/// no map takes, cannot be written either.
fn keep(file: &mut File, frame: Observation) -> io::Result<Observation> {
    if !(frame.frame.timestamp.is_finite() && frame.frame.world_from_camera.is_finite()) {
        return Ok(frame);
    }
    let line = line(&frame);
    // what cannot be read again is not written
    let read = parse(line.as_bytes()).map_err(io::Error::other)?;
    let length = file.metadata()?.len();
    if let Err(error) = file.write_all(format!("{line}\n").as_bytes()) {
        // half a line would end the journal
        file.set_len(length)?;
        return Err(error);
    }
    Ok(read)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::simulator::Simulated;
    use std::sync::Arc;

    fn stream() -> Stream {
        let mut settings = Simulated::default();
        settings.trajectory.frames = 12;
        Arc::new(settings.simulate().unwrap()).into()
    }

    fn frames(stream: Stream, count: usize) -> Vec<Observation> {
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
    fn a_file_of_something_else_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frames.jsonl");
        let others = [
            ("notes", "no journal"),
            ("{\"frames\": 1}\n", "no journal"),
            ("{\"frames_for\":\"8\"}\n", "other settings"),
            ("{\"frames_for\":\"7\"}\nnotes\n", ":2 is no frame"),
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
}
