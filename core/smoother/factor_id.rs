//! Names of factors.
use serde::Serialize;
use std::fmt;

/// The name of a factor in a session. It stays the same whatever comes and goes, and is not used again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(transparent)]
pub struct FactorId(pub(crate) u32);

impl fmt::Display for FactorId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}
