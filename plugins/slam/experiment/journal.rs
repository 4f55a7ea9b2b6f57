//! The log of trials that are done: one JSON document a line, appended and synced when a trial ends.
//!
//! A program that is killed leaves at most one line without an end, the last: it is dropped, and its trial run again.
//! Of several lines for one trial the last counts, as a trial that failed may be run again, and lines of trials that the experiment does not have any more are
//! passed over, so that a changed experiment runs what is new and keeps what is not.
use super::{Record, Trial};
use manifactor_formats::whole::remove_unfinished;
use std::collections::HashMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

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
    /// Somebody else writes to it.
    #[error("{} is in use: another run of this experiment is under way", path.display())]
    InUse {
        /// Which.
        path: PathBuf,
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

/// A log that is open for writing. Nobody else can have it open at the same time.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    records: HashMap<(Vec<String>, String), Record>,
}

impl Journal {
    /// Opens a log, or begins one.
    ///
    /// # Errors
    /// Where it cannot be read or written, is in use, or is no log.
    pub fn open(path: &Path) -> Result<Self, JournalError> {
        let io = |source| JournalError::Io { path: path.to_owned(), source };
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(io)?;
        }
        let mut file = OpenOptions::new().read(true).append(true).create(true).open(path).map_err(io)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(JournalError::InUse { path: path.to_owned() }),
            // a file system without locks is no reason not to run
            Err(TryLockError::Error(_)) | Ok(()) => {}
        }
        if let Some(folder) = path.parent() {
            remove_unfinished(folder);
        }
        let mut bytes = vec![];
        file.read_to_end(&mut bytes).map_err(io)?;
        let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        if whole < bytes.len() {
            file.set_len(whole as u64).map_err(io)?;
            bytes.truncate(whole);
        }
        let mut records = HashMap::new();
        for (i, line) in bytes.split(|byte| *byte == b'\n').enumerate().filter(|(_, line)| !line.is_empty()) {
            let record: Record = serde_json::from_slice(line).map_err(|error| JournalError::Line {
                path: path.to_owned(),
                line: i + 1,
                message: error.to_string(),
            })?;
            records.insert((record.labels.clone(), record.fingerprint.clone()), record);
        }
        Ok(Self { path: path.to_owned(), file, records })
    }

    /// What a trial came to, if it is done.
    pub fn find(&self, trial: &Trial) -> Option<&Record> {
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
    pub fn append(&mut self, record: Record) -> Result<(), JournalError> {
        let io = |source| JournalError::Io { path: self.path.clone(), source };
        let mut line = serde_json::to_vec(&record).map_err(|error| io(error.into()))?;
        line.push(b'\n');
        self.file.write_all(&line).and_then(|()| self.file.sync_data()).map_err(io)?;
        self.records.insert((record.labels.clone(), record.fingerprint.clone()), record);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::Outcome;
    use super::*;

    fn record(label: &str, reason: &str) -> Record {
        let outcome = Outcome::Failed { reason: reason.into() };
        Record { labels: vec![label.into()], fingerprint: "0".into(), outcome, seconds: 0.1 }
    }

    fn file(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("manifactor-journal-{name}-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        path
    }

    #[test]
    fn a_torn_line_is_dropped_and_nothing_counts_twice() {
        let path = file("torn");
        let mut journal = Journal::open(&path).unwrap();
        for (label, reason) in [("a", "first"), ("b", "first"), ("a", "second")] {
            journal.append(record(label, reason)).unwrap();
        }
        drop(journal);
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, [&whole[..], b"{\"labels\":[\"c\"],\"finger"].concat()).unwrap();
        let journal = Journal::open(&path).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), whole);
        assert_eq!(journal.records.len(), 2);
        assert_eq!(journal.records[&(vec!["a".to_owned()], "0".to_owned())], record("a", "second"));
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn two_runs_at_once_are_refused() {
        let path = file("twice");
        let first = Journal::open(&path).unwrap();
        assert!(matches!(Journal::open(&path), Err(JournalError::InUse { .. })));
        drop(first);
        assert!(Journal::open(&path).is_ok());
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn a_file_that_is_no_journal_is_left_alone() {
        let path = file("other");
        std::fs::write(&path, "notes\n").unwrap();
        let error = Journal::open(&path).unwrap_err().to_string();
        assert!(error.contains(":1 is not a record"), "{error}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "notes\n");
        std::fs::remove_file(&path).unwrap();
    }
}
