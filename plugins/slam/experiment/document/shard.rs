//! Shards: parts of an experiment that run in separate processes, on any machine.
//!
//! A shard has every N-th trial, a separate folder beside the experiment's folder, and a log in it. The
//! experiment itself begins with the trials that its shards have finished. Its tables are equal to the tables
//! of a single run.
use super::Experiment;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Returns the folder of all shards of an experiment: `out/sweep.shards`.
fn shards_folder(output: &Path) -> PathBuf {
    let name = output.file_name().unwrap_or(OsStr::new("experiment"));
    output.with_file_name([name, OsStr::new(".shards")].join(OsStr::new("")))
}

/// The K-th of N parts, written `K/N`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Number of the part, from 1.
    number: usize,
    /// Number of all parts.
    of: usize,
}

/// Error for a text that is not a shard.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("expected K/N, the K-th of N parts, such as 2/8; got `{0}`")]
pub struct ShardError(String);

impl FromStr for Shard {
    type Err = ShardError;
    fn from_str(text: &str) -> Result<Self, ShardError> {
        let parts = text.split_once('/').and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((number, of)) if 1 <= number && number <= of => Ok(Self { number, of }),
            _ => Err(ShardError(text.to_owned())),
        }
    }
}

impl Experiment {
    /// Keeps one part of the trials. Its results go to a separate folder.
    pub fn restrict_to_shard(&mut self, Shard { number, of }: Shard) {
        let mut place = 0..;
        self.trials.retain(|_| place.next().is_some_and(|i| i % of == number - 1));
        self.output = shards_folder(&self.output).join(format!("{number}-of-{of}"));
    }
}

/// Returns the folders of an experiment's shards, sorted by name.
pub(crate) fn shard_folders(output: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(shards_folder(output)).into_iter().flatten();
    let mut folders: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    folders.sort();
    folders
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_shard_is_refused() {
        for text in ["", "1", "0/3", "4/3", "1/0", "-1/3", "1/3/5", "a/b", "1/ 3"] {
            let error = text.parse::<Shard>().unwrap_err().to_string();
            assert!(error.ends_with(&format!("got `{text}`")), "{error}");
        }
        assert_eq!("2/8".parse(), Ok(Shard { number: 2, of: 8 }));
    }
}
