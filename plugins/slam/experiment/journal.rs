//! Log of finished trials: one JSON document per line with its checksum, appended and synced when a trial
//! ends.
//!
//! A trial with an incomplete line is run again. If a trial has several lines, the last one counts, because a
//! failed trial may be run again. Lines of trials that the experiment no longer contains are ignored. An
//! experiment that was changed therefore runs only its new trials.
use crate::document::shard_folders;
use crate::trial::{Trial, TrialRecord};
use manifactor_formats::journal::{Journal, JournalError, JournalRecord, read};
use manifactor_run::output::OutputFolder;
use std::collections::HashMap;
use std::io;
use std::path::Path;

/// Name of the log in an experiment's folder.
const NAME: &str = "trials.jsonl";

impl JournalRecord for TrialRecord {
    type Context = ();
    const NAME: &'static str = "record of a trial";

    fn write(&self) -> io::Result<String> {
        Ok(serde_json::to_string(self)?)
    }

    fn read(line: &[u8], (): &()) -> Result<Self, String> {
        serde_json::from_slice(line).map_err(|error| error.to_string())
    }
}

/// Records by labels and fingerprint of the trial.
type TrialRecords = HashMap<(Vec<String>, String), TrialRecord>;

/// A log that is open for writing, in a folder that only this process writes into.
#[derive(Debug)]
pub struct TrialLog {
    file: Journal<TrialRecord>,
    records: TrialRecords,
    /// Claimed while the log is open.
    _folder: OutputFolder,
}

impl TrialLog {
    /// Opens the log of a folder, `trials.jsonl`, or creates it.
    ///
    /// # Errors
    /// A file that cannot be read or written, is a link, or is not a log. It stays unchanged.
    pub fn open(folder: OutputFolder) -> Result<Self, JournalError> {
        let (file, records) = Journal::open(&folder.path().join(NAME), "", ())?;
        Ok(Self { file, records: records.into_iter().map(record_with_key).collect(), _folder: folder })
    }

    /// Adds the trials that shards of the experiment have finished and this log does not contain.
    ///
    /// # Errors
    /// If the log of a shard cannot be read or is invalid, or if this log cannot be written.
    pub fn take_over_shards(&mut self) -> Result<(), JournalError> {
        let output = self.file.path().parent().map(Path::to_owned).unwrap_or_default();
        for folder in shard_folders(&output) {
            let records: TrialRecords = read(&folder.join(NAME))?.into_iter().map(record_with_key).collect();
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

    /// Returns the record of a trial, if it is finished.
    pub fn record_of(&self, trial: &Trial) -> Option<&TrialRecord> {
        self.records.get(&(trial.labels.clone(), trial.fingerprint()))
    }

    /// Removes failed trials, so that they are run again.
    pub fn retry_failed(&mut self) {
        self.records.retain(|_, record| record.outcome.status() != "failed");
    }

    /// Adds a finished trial. The record is on the disk when this function returns.
    ///
    /// # Errors
    /// If the log cannot be written.
    pub fn append(&mut self, record: TrialRecord) -> Result<(), JournalError> {
        let done = self.file.append(&record).and_then(|_| self.file.sync());
        done.map_err(|source| JournalError::Io { path: self.file.path().to_owned(), source })?;
        self.records.extend([record_with_key(record)]);
        Ok(())
    }
}

fn record_with_key(record: TrialRecord) -> ((Vec<String>, String), TrialRecord) {
    ((record.labels.clone(), record.fingerprint.clone()), record)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::TrialOutcome;
    use manifactor_formats::whole::checked_line;

    fn record(label: &str, reason: &str) -> TrialRecord {
        let outcome = TrialOutcome::Failed { reason: reason.into() };
        TrialRecord { labels: vec![label.into()], fingerprint: "0".into(), outcome, seconds: 0.1 }
    }

    fn open(folder: &Path) -> Result<TrialLog, JournalError> {
        TrialLog::open(OutputFolder::claim(folder, "experiment", Path::new("sweep.toml"), true).unwrap())
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
        // cut off anywhere, even within a character
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
            assert!(error.contains("is no record"), "{error}");
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
