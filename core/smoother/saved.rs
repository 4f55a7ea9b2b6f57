//! A smoother as text: a header line and a JSON document.
//!
//! ```text
//! manifactor session 3 90b4b1a3c2f0d7e1
//! {"settings":{…},"variables":[…],"factors":[…],"fronts":[…],…}
//! ```
//!
//! The document holds the state that depends on history: factors, linearization points, steps, and the
//! variables of each front. It does not hold the values of the factorization, because equal points in an
//! equal tree reproduce their bits.
use crate::removed::{NumberRanges, RemovedKeys};
use crate::settings::SmootherSettings;
use manifactor_graph::{FactorEntry, GraphError, Key, Variable};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Format version that this program writes and reads.
const VERSION: u32 = 3;

/// Error of saving a smoother.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SaveError {
    /// Changes that no update has made yet.
    #[error("there are changes that no update has made yet; update the smoother, and save it then")]
    Pending,
    /// A value or a factor that cannot be written as text.
    #[error("cannot be saved: {0}")]
    Write(String),
}

/// Error of loading a smoother.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// A text that is not a saved smoother.
    #[error("no saved smoother: expected a first line `manifactor session {version} …`")]
    Foreign {
        /// The version that this program reads.
        version: u32,
    },
    /// A text of a different format version.
    #[error("saved in version {found}; this program reads version {version}")]
    Version {
        /// The version of the text.
        found: String,
        /// The version that this program reads.
        version: u32,
    },
    /// A text that was damaged or cut off after it was saved.
    #[error("the saved text is damaged or cut off: its checksum does not fit")]
    Damaged,
    /// A document that cannot be read, for example because of a type that this program does not have.
    #[error("cannot read what was saved: {0}")]
    Read(String),
    /// Factors and values that contradict each other.
    #[error("the saved smoother contradicts itself:{}", GraphError::list(.0))]
    Graph(Vec<GraphError>),
    /// Any other contradiction.
    #[error("the saved smoother contradicts itself: {0}")]
    Inconsistent(&'static str),
}

/// The saved document.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Saved {
    pub settings: SmootherSettings,
    pub updates: usize,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_quiet: bool,
    pub next_factor: u32,
    pub postponed: usize,
    /// By variable number.
    pub variables: Vec<SavedVariable>,
    /// By ascending number.
    pub factors: Vec<SavedFactor>,
    /// Children before parents.
    pub fronts: Vec<SavedFront>,
    /// Number of variables ever added.
    #[serde(rename = "born")]
    pub added: u64,
    /// Number of variables ever added, by column.
    pub ordinals: Vec<u64>,
    /// Free variable numbers. The last one is reused first.
    pub unused: Vec<u32>,
    pub priors: Vec<SavedPrior>,
    #[serde(rename = "gone")]
    pub removed_keys: RemovedKeys,
    #[serde(rename = "gone_factors")]
    pub removed_factors: NumberRanges,
    /// Variables outside of the region of their linearization (`waiting`), far outside (`urgent`); and undetermined
    /// variables to check again (`doubtful`).
    pub waiting: Vec<u32>,
    pub urgent: Vec<u32>,
    pub doubtful: Vec<u32>,
    /// Bits of the last time that was set.
    pub time: Option<u64>,
    /// Bits of the insertion time of each variable in a window by seconds, the oldest first.
    pub times: Vec<u64>,
    /// Variables that have moved since the last outlier test.
    #[serde(rename = "shaken")]
    pub moved: BTreeSet<u32>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SavedVariable {
    pub key: Key,
    /// Ranks in the order of insertion, among all variables and within the type; `None` for a removed
    /// variable.
    #[serde(rename = "born")]
    pub ranks: Option<[u64; 2]>,
    /// Linearization point, and bits of the step from there.
    pub point: Box<dyn Variable>,
    pub step: Vec<u64>,
    /// Bits of the damping, and whether the variable takes a step at each update.
    #[serde(default, skip_serializing_if = "is_none")]
    pub damping: (u64, bool),
    pub held: u32,
    #[serde(rename = "parked")]
    pub is_undetermined: bool,
}

fn is_none(damping: &(u64, bool)) -> bool {
    *damping == (0, false)
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SavedFactor {
    pub number: u32,
    pub weight: f64,
    pub entry: FactorEntry,
    /// Present for a candidate of the outlier test.
    #[serde(rename = "suspect", default, skip_serializing_if = "Option::is_none")]
    pub candidate: Option<SavedCandidate>,
}

/// A factor that may be an outlier.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SavedCandidate {
    /// Upper limit of ‖r‖² for an inlier: the χ² quantile for its rows.
    pub(crate) bound: f64,
    /// Largest information gain without confirmation by a second factor. Unit: nats.
    pub(crate) gain: f64,
    /// The update that rejected it; `None` if the factor counts.
    pub(crate) since: Option<usize>,
}

/// A linear prior. Numbers are stored as bits.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SavedPrior {
    pub number: u32,
    pub variables: Vec<u32>,
    pub h: Vec<u64>,
    pub g: Vec<u64>,
    pub constant: u64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SavedFront {
    pub blocks: Vec<u32>,
    pub rows: Vec<u32>,
    /// Index among the saved fronts.
    pub parent: Option<u32>,
}

impl Saved {
    pub(crate) fn write(&self) -> Result<String, SaveError> {
        let json = serde_json::to_string(self).map_err(|e| SaveError::Write(e.to_string()))?;
        Ok(format!("manifactor session {VERSION} {:016x}\n{json}\n", checksum(json.as_bytes())))
    }

    pub(crate) fn read(text: &str) -> Result<Self, LoadError> {
        let foreign = || LoadError::Foreign { version: VERSION };
        let (first, json) = text.split_once('\n').unwrap_or((text, ""));
        let mut words = first.split_ascii_whitespace();
        if words.next() != Some("manifactor") || words.next() != Some("session") {
            return Err(foreign());
        }
        let found = words.next().ok_or_else(foreign)?;
        if found != VERSION.to_string() {
            return Err(LoadError::Version { found: found.to_owned(), version: VERSION });
        }
        let json = json.strip_suffix('\n').ok_or(LoadError::Damaged)?;
        let stated = words.next().and_then(|word| u64::from_str_radix(word, 16).ok());
        if stated != Some(checksum(json.as_bytes())) {
            return Err(LoadError::Damaged);
        }
        serde_json::from_str(json).map_err(|e| LoadError::Read(e.to_string()))
    }
}

/// FNV-1a with 64 bits. It detects damage, not manipulation.
fn checksum(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}
