//! The log of trials that are done: one JSON document a line with its checksum, appended and synced when a trial ends.
//!
//! A trial whose line is torn is run again. Of several lines for one trial the last counts, as a trial that
//! failed may be run again, and lines of trials that the experiment does not have any more are passed over, so that a
//! changed experiment runs what is new and keeps what is not.
use crate::document::folders;
use crate::trial::{Trial, TrialRecord};
use manifactor_formats::journal::{Journal, JournalError, Record, read};
use manifactor_run::output::OutputFolder;
use std::collections::HashMap;
use std::io;
use std::path::Path;

/// The log's name in an experiment's folder.
const NAME: &str = "trials.jsonl";

impl Record for TrialRecord {
    const NAME: &'static str = "record of a trial";

    fn write(&self) -> io::Result<String> {
        Ok(serde_json::to_string(self)?)
    }

    fn read(line: &[u8]) -> Result<Self, String> {
        serde_json::from_slice(line).map_err(|error| error.to_string())
    }
}

/// By labels and fingerprint of the trial.
type Records = HashMap<(Vec<String>, String), TrialRecord>;

/// A log that is open for writing, in a folder that this process alone writes into.
#[derive(Debug)]
pub struct TrialLog {
    file: Journal<TrialRecord>,
    records: Records,
    /// Held as long as the log is open.
    _folder: OutputFolder,
}

impl TrialLog {
    /// Opens the log of a folder, `trials.jsonl`, or begins one.
    ///
    /// # Errors
    /// A file that cannot be read or written, is a link, or is no log; it is unchanged then.
    pub fn open(folder: OutputFolder) -> Result<Self, JournalError> {
        let (file, records) = Journal::open(&folder.path().join(NAME), "")?;
        Ok(Self { file, records: records.into_iter().map(keyed).collect(), _folder: folder })
    }

    /// Takes over what the shards of the experiment have done and this log does not have.
    ///
    /// # Errors
    /// The log of a shard that cannot be read or is none, or this one cannot be written.
    pub fn take_over_shards(&mut self) -> Result<(), JournalError> {
        let output = self.file.path().parent().map(Path::to_owned).unwrap_or_default();
        for folder in folders(&output) {
            let records: Records = read(&folder.join(NAME))?.into_iter().map(keyed).collect();
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
    /// If it cannot be written.
    pub fn append(&mut self, record: TrialRecord) -> Result<(), JournalError> {
        let done = self.file.append(&record).and_then(|_| self.file.sync());
        done.map_err(|source| JournalError::Io { path: self.file.path().to_owned(), source })?;
        self.records.extend([keyed(record)]);
        Ok(())
    }
}

fn keyed(record: TrialRecord) -> ((Vec<String>, String), TrialRecord) {
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
