//! A session as text: a line that says what it is, and a JSON document.
//!
//! ```text
//! manifactor session 3 90b4b1a3c2f0d7e1
//! {"settings":{…},"variables":[…],"factors":[…],"fronts":[…],…}
//! ```
//!
//! What is saved is what history has left: factors, linearization points, steps, and which variables are eliminated together.
//! The numbers of the factorization are not: from the same points, in the same tree, they have the same bits again.
use crate::gone::{GoneKeys, Runs};
use crate::settings::Settings;
use manifactor_graph::{FactorEntry, GraphError, Key, Variable};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// The version of the format that this program writes and reads.
const VERSION: u32 = 3;

/// Why a session cannot be saved.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SaveError {
    /// Changes that the next update is to make.
    #[error("there are changes that no update has made yet; update the session, and save it then")]
    Pending,
    /// A value or a factor that has no text.
    #[error("cannot be saved: {0}")]
    Write(String),
}

/// Why a text is no saved session.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// Something else.
    #[error("no saved session: expected a first line `manifactor session {version} …`")]
    Foreign {
        /// The version that this program reads.
        version: u32,
    },
    /// A text that another version has saved.
    #[error("saved in version {found}; this program reads version {version}")]
    Version {
        /// The version of the text.
        found: String,
        /// The version that this program reads.
        version: u32,
    },
    /// A text that is not as it was saved.
    #[error("the saved text is damaged or cut off: its checksum does not fit")]
    Damaged,
    /// A document that cannot be read: a type that this program does not know, say.
    #[error("cannot read what was saved: {0}")]
    Read(String),
    /// Factors and values that do not fit each other.
    #[error("the saved session contradicts itself:{}", GraphError::list(.0))]
    Graph(Vec<GraphError>),
    /// Something else that no session can be.
    #[error("the saved session contradicts itself: {0}")]
    Inconsistent(&'static str),
}

/// What is saved.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Saved {
    pub settings: Settings,
    pub updates: usize,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_quiet: bool,
    pub next_factor: u32,
    pub postponed: usize,
    /// By number.
    pub variables: Vec<SavedVariable>,
    /// By ascending number.
    pub factors: Vec<SavedFactor>,
    /// Children before parents.
    pub fronts: Vec<SavedFront>,
    /// Variables that have left the region of their linearization, those that have left it far, and those to be judged.
    pub born: u64,
    /// By column, how many variables have come.
    pub ordinals: Vec<u64>,
    /// Numbers of variables that are gone, those that are used again first last.
    pub unused: Vec<u32>,
    pub priors: Vec<SavedPrior>,
    pub gone: GoneKeys,
    pub gone_factors: Runs,
    pub waiting: Vec<u32>,
    pub urgent: Vec<u32>,
    pub doubtful: Vec<u32>,
    /// The bits of the time that was set last.
    pub time: Option<u64>,
    /// Of a window by seconds, by variable that it holds, the oldest first: the bits of the time when it came.
    pub times: Vec<u64>,
    /// Variables that have moved since factors that may be wrong were looked at.
    pub shaken: BTreeSet<u32>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SavedVariable {
    pub key: Key,
    /// How many came before it, and how many of its type; `None` where it is gone.
    pub born: Option<[u64; 2]>,
    /// Its linearization point, and the bits of its step from there.
    pub point: Box<dyn Variable>,
    pub step: Vec<u64>,
    /// The bits of what its steps are damped by, and whether it still takes a step at each update.
    #[serde(default, skip_serializing_if = "is_none")]
    pub damping: (u64, bool),
    pub held: u32,
    pub parked: bool,
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
    /// What is known of a factor that may be an outlier.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub suspect: Option<Suspect>,
}

/// What is known of a factor that may be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Suspect {
    /// What ‖r‖² of a right one stays below: the χ² quantile for its rows.
    pub(crate) bound: f64,
    /// Nats by which it may narrow down alone where its variables are.
    pub(crate) gain: f64,
    /// The update that rejected it; `None` where it counts.
    pub(crate) since: Option<usize>,
}

/// A linear prior, its numbers by their bits.
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
    /// Its place among the fronts.
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

/// FNV-1a, of 64 bits: it finds damage, not malice.
fn checksum(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}
