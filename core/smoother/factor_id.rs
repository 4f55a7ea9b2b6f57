//! Ids of factors.
use serde::Serialize;
use std::fmt;

/// The id of a factor in one smoother. It never changes and is never reused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(transparent)]
pub struct FactorId(pub(crate) u32);

impl FactorId {
    /// Returns the id with this number, which was stored with a smoother.
    pub fn of_number(number: u32) -> Self {
        Self(number)
    }
    /// Returns the number.
    pub fn number(self) -> u32 {
        self.0
    }
}

impl fmt::Display for FactorId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}
