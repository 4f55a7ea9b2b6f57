//! Variables that still move when a solve runs out of iterations.
use manifactor_graph::Key;
use serde::Serialize;
use std::fmt;

/// The variables that the last step moved most, in the metric of the diagonal of H.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LargestMoves {
    /// Their keys, in descending order of motion.
    pub keys: Vec<Key>,
    /// Motion of each of these variables: name of the tangent direction, and its share.
    pub direction: Vec<(Key, &'static str, f64)>,
    /// Total number of moving variables.
    pub moving: usize,
}

impl fmt::Display for LargestMoves {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts: Vec<_> =
            self.direction.iter().map(|(key, name, x)| format!("{key}.{name} by {x:.2}")).collect();
        write!(f, "the last step still moves {}", parts.join(", "))?;
        match self.moving.saturating_sub(self.keys.len()) {
            0 => {}
            more => write!(f, ", and {more} more variables with them")?,
        }
        f.write_str("; allow more iterations, or constrain that better")
    }
}
