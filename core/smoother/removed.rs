//! Removed keys and factor ids, so that an error can say *removed* instead of *unknown*. Both are stored as
//! ranges: they are mostly consecutive, so the memory does not grow with their number.
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// A set of numbers as ranges. The map holds the first number and the end (exclusive) of each range.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct NumberRanges(BTreeMap<u64, u64>);

impl NumberRanges {
    pub(crate) fn contains(&self, number: u64) -> bool {
        self.0.range(..=number).next_back().is_some_and(|(_, end)| number < *end)
    }

    pub(crate) fn insert(&mut self, number: u64) {
        if self.contains(number) {
            return;
        }
        let before = self.0.range(..number).next_back().filter(|(_, end)| **end == number);
        let first = before.map_or(number, |(first, _)| *first);
        let end = self.0.remove(&(number + 1)).unwrap_or(number + 1);
        self.0.insert(first, end);
    }
}

/// Keys of removed variables.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RemovedKeys {
    /// Keys that end with a number, by the part before it.
    numbered: BTreeMap<String, NumberRanges>,
    others: BTreeSet<String>,
    /// Removed keys that a new variable may use again, because their variables had no factors. They are few.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    free: BTreeSet<String>,
}

/// Splits a key into a name and its final number. Returns `None` if a different key would give equal parts.
fn split(key: &str) -> Option<(&str, u64)> {
    let name = key.trim_end_matches(|c: char| c.is_ascii_digit());
    let digits = &key[name.len()..];
    let is_plain = digits.len() <= 18 && (digits == "0" || !digits.starts_with('0'));
    Some((name, digits.parse().ok().filter(|_| is_plain)?))
}

impl RemovedKeys {
    pub(crate) fn contains(&self, key: &str) -> bool {
        match split(key) {
            Some((name, number)) => self.numbered.get(name).is_some_and(|runs| runs.contains(number)),
            None => self.others.contains(key),
        }
    }

    /// Returns whether a new variable may not use this key.
    pub(crate) fn is_taken(&self, key: &str) -> bool {
        self.contains(key) && !self.free.contains(key)
    }

    /// Records a removed variable. `is_left` is false if it had no factors.
    pub(crate) fn insert(&mut self, key: &str, is_left: bool) {
        if is_left {
            self.free.remove(key);
        } else {
            self.free.insert(key.to_owned());
        }
        match split(key) {
            Some((name, number)) => self.numbered.entry(name.to_owned()).or_default().insert(number),
            None => drop(self.others.insert(key.to_owned())),
        }
    }
}

/// Variables and factors that were removed, so that an error can say *removed* instead of *unknown*.
#[derive(Debug, Clone, Default)]
pub(crate) struct Removed {
    pub keys: RemovedKeys,
    pub factors: NumberRanges,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn runs_hold_what_was_put_in(numbers in prop::collection::vec(0..30u64, 0..40)) {
            let mut runs = NumberRanges::default();
            numbers.iter().for_each(|n| runs.insert(*n));
            for n in 0..32 {
                prop_assert_eq!(runs.contains(n), numbers.contains(&n));
            }
            // no two ranges touch
            let ends: Vec<(u64, u64)> = runs.0.into_iter().collect();
            prop_assert!(ends.windows(2).all(|pair| pair[0].1 < pair[1].0));
        }
    }

    #[test]
    fn names_are_told_apart() {
        let mut gone = RemovedKeys::default();
        ["x7", "x07", "lamp", "12", "y99999999999999999999999"].iter().for_each(|key| gone.insert(key, true));
        assert!(["x7", "x07", "lamp", "12", "y99999999999999999999999"].iter().all(|key| gone.contains(key)));
        assert!(["x8", "x007", "lam", "1", "y9", "x"].iter().all(|key| !gone.contains(key)));
    }
}
