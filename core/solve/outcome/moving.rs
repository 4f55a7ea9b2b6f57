//! What still moves where a solve runs out of iterations.
use crate::inspect::null_space::name;
use crate::outcome::Undetermined;
use crate::problem::Problem;
use manifactor_graph::Key;
use serde::Serialize;
use std::fmt;

/// The variables that the last step moved the most, by the diagonal of H.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Moving {
    /// The first the most.
    pub keys: Vec<Key>,
    /// How each of them moves: name of the tangent direction, and its share.
    pub direction: Vec<(Key, &'static str, f64)>,
    /// How many variables move at all.
    pub moving: usize,
}

impl fmt::Display for Moving {
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

impl Problem {
    /// The step between the last trial and the estimate; `None` where they are the same.
    pub(crate) fn moving(&self) -> Option<Moving> {
        let mut step = vec![0.0; self.dim()];
        for place in &self.variables {
            let value =
                |columns: &manifactor_graph::column::Columns| columns.column(place.column).get(place.index);
            let (Some(start), Some(from), Some(to)) = (place.start, value(&self.trial), value(&self.columns))
            else {
                continue;
            };
            let local = from.erased().local(&*to).unwrap_or_default();
            step[start..start + local.len()].copy_from_slice(&local);
        }
        if step.iter().all(|x| *x == 0.0) || !step.iter().all(|x| x.is_finite()) {
            return None;
        }
        let mut scale = vec![];
        self.diagonal(&mut scale);
        let Undetermined { keys, direction, moving } = name(self, &step, &scale);
        Some(Moving { keys, direction, moving })
    }
}
