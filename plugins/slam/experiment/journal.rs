//! The log of trials that are done: one JSON document a line with its checksum, appended and synced when a trial ends.
//!
//! A program that is killed leaves at most one line without an end, the last: it is dropped, and its trial run again.
//! A file that is no such log is refused and not touched. Of several lines for one trial the last counts, as a trial that
//! failed may be run again, and lines of trials that the experiment does not have any more are passed over, so that a
//! changed experiment runs what is new and keeps what is not.
use super::shard::folders;
use super::{Trial, TrialRecord};
use crate::output::OutputFolder;
use manifactor_formats::whole::{CHECKED, checked_line, open_regular, read_checked_line, read_regular};
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// The log's name in an experiment's folder.
const NAME: &str = "trials.jsonl";
/// How each line begins.
const BEGINNING: &[u8] = CHECKED.as_bytes();

/// Why trials cannot be logged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    /// A file that cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A whole line that is no record.
    #[error(
        "{}:{line} is not a record of a trial: {message}; move the file away to begin anew", path.display()
    )]
    Line {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
}

/// By labels and fingerprint of the trial.
type Records = HashMap<(Vec<String>, String), TrialRecord>;

/// A log that is open for writing, in a folder that this process alone writes into.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    records: Records,
    /// Held as long as the log is open.
    _folder: OutputFolder,
}

impl Journal {
    /// Opens the log of a folder, `trials.jsonl`, or begins one.
    ///
    /// # Errors
    /// Where it cannot be read or written, is a link, or is no log; it is unchanged then.
    pub fn open(folder: OutputFolder) -> Result<Self, JournalError> {
        let path = folder.path().join(NAME);
        let io = |source| JournalError::Io { path: path.clone(), source };
        let mut file = open_regular(&path).map_err(io)?;
        let mut bytes = vec![];
        file.read_to_end(&mut bytes).map_err(io)?;
        let (records, whole) = read(&bytes, &path)?;
        if whole < bytes.len() {
            file.set_len(whole as u64).map_err(io)?;
        }
        Ok(Self { path, file, records, _folder: folder })
    }

    /// Takes over what the shards of the experiment have done and this log does not have.
    ///
    /// # Errors
    /// Where the log of a shard cannot be read or is none, or this one cannot be written.
    pub fn take_over_shards(&mut self) -> Result<(), JournalError> {
        let output = self.path.parent().map(Path::to_owned).unwrap_or_default();
        for folder in folders(&output) {
            let path = folder.join(NAME);
            let bytes = match read_regular(&path) {
                Ok(bytes) => bytes,
                // one that has not begun
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(source) => return Err(JournalError::Io { path, source }),
            };
            // it may be at work: what its last line is to be is not whole yet
            let (records, _) = read(&bytes, &path)?;
            let mut records: Vec<_> = records.into_iter().collect();
            records.sort_by(|a, b| a.0.cmp(&b.0));
            for (key, record) in records {
                if !self.records.contains_key(&key) {
                    self.append(record)?;
                }
            }
        }
        Ok(())
    }

    /// What a trial came to, if it is done.
    pub fn find(&self, trial: &Trial) -> Option<&TrialRecord> {
        self.records.get(&(trial.labels.clone(), trial.fingerprint()))
    }

    /// Forgets the trials that failed, so that they are run again.
    pub fn retry_failed(&mut self) {
        self.records.retain(|_, record| record.outcome.status() != "failed");
    }

    /// Adds a trial that is done; it is on the disk when this returns.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn append(&mut self, record: TrialRecord) -> Result<(), JournalError> {
        let io = |source| JournalError::Io { path: self.path.clone(), source };
        let line = checked_line(&serde_json::to_string(&record).map_err(|error| io(error.into()))?);
        self.file.write_all(line.as_bytes()).and_then(|()| self.file.sync_data()).map_err(io)?;
        self.records.insert((record.labels.clone(), record.fingerprint.clone()), record);
        Ok(())
    }
}

/// The records of a log, and how many of its bytes are whole lines.
fn read(bytes: &[u8], path: &Path) -> Result<(Records, usize), JournalError> {
    let mistake = |line: usize, message: String| JournalError::Line { path: path.to_owned(), line, message };
    let mut records = Records::new();
    let mut whole = 0;
    for (i, line) in bytes.split_inclusive(|byte| *byte == b'\n').enumerate() {
        let Some(line) = line.strip_suffix(b"\n") else {
            if is_torn(line) {
                break;
            }
            return Err(mistake(i + 1, "it has no end, and does not begin as a record does".into()));
        };
        whole += line.len() + 1;
        if !line.is_empty() {
            let text = read_checked_line(line).map_err(|fault| mistake(i + 1, fault.to_owned()))?;
            let record: TrialRecord =
                serde_json::from_slice(&text).map_err(|error| mistake(i + 1, error.to_string()))?;
            records.insert((record.labels.clone(), record.fingerprint.clone()), record);
        }
    }
    Ok((records, whole))
}

/// Whether a line is one of ours, cut short.
fn is_torn(line: &[u8]) -> bool {
    let begins = line.starts_with(BEGINNING) || BEGINNING.starts_with(line);
    begins && serde_json::from_slice::<serde_json::Value>(line).err().is_none_or(|error| error.is_eof())
}

#[cfg(test)]
mod tests {
    use super::super::TrialOutcome;
    use super::*;

    fn record(label: &str, reason: &str) -> TrialRecord {
        let outcome = TrialOutcome::Failed { reason: reason.into() };
        TrialRecord { labels: vec![label.into()], fingerprint: "0".into(), outcome, seconds: 0.1 }
    }

    fn open(folder: &Path) -> Result<Journal, JournalError> {
        Journal::open(OutputFolder::claim(folder, "experiment", Path::new("sweep.toml"), true).unwrap())
    }

    #[test]
    fn a_torn_line_is_dropped_and_nothing_counts_twice() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        let mut journal = open(folder.path()).unwrap();
        for (label, reason) in [("a", "first"), ("b", "first"), ("a", "second")] {
            journal.append(record(label, reason)).unwrap();
        }
        drop(journal);
        let whole = std::fs::read(&path).unwrap();
        let line = checked_line(&serde_json::to_string(&record("ü", "torn")).unwrap());
        let line = line.trim_end().as_bytes();
        // wherever it was torn, within a character too
        for end in 0..=line.len() {
            std::fs::write(&path, [&whole[..], &line[..end]].concat()).unwrap();
            let journal = open(folder.path()).unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), whole, "torn at {end}");
            assert_eq!(journal.records.len(), 2);
            assert_eq!(journal.records[&(vec!["a".to_owned()], "0".to_owned())], record("a", "second"));
        }
        let mut journal = open(folder.path()).unwrap();
        journal.append(record("c", "third")).unwrap();
        drop(journal);
        assert_eq!(open(folder.path()).unwrap().records.len(), 3);
    }

    #[test]
    fn a_file_that_is_no_journal_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        let others = [
            "notes",
            "notes\n",
            "{\"labels\": 1}",
            "{\"labels\":[]}",
            "{\"results\":[1",
            "\n\nnotes",
            "\0\0",
        ];
        for text in others {
            std::fs::write(&path, text).unwrap();
            let error = open(folder.path()).unwrap_err().to_string();
            assert!(error.contains("is not a record"), "{error}");
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        }
    }

    #[test]
    #[cfg(unix)]
    fn what_a_journal_links_to_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let other = folder.path().join("precious");
        std::fs::write(&other, "precious").unwrap();
        std::os::unix::fs::symlink(&other, folder.path().join(NAME)).unwrap();
        let error = open(folder.path()).unwrap_err().to_string();
        assert!(error.contains("it is a link"), "{error}");
        assert_eq!(std::fs::read_to_string(&other).unwrap(), "precious");
    }
}
