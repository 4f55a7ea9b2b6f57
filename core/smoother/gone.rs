//! What has left a session, so that it is told from what never was there: keys and ids of factors, as runs of numbers. They take no
//! room for each of them, as both are given one after the other.
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// A set of numbers, as runs: first to end, without it.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct Runs(BTreeMap<u64, u64>);

impl Runs {
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

/// Names of variables that are gone.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct GoneKeys {
    /// Those that end with a number, by what stands before it.
    numbered: BTreeMap<String, Runs>,
    others: BTreeSet<String>,
    /// Those of variables that have left nothing behind: another may have that name. They are few.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    free: BTreeSet<String>,
}

/// A name, and the number that it ends with; `None` where another name would have the same number.
fn split(key: &str) -> Option<(&str, u64)> {
    let name = key.trim_end_matches(|c: char| c.is_ascii_digit());
    let digits = &key[name.len()..];
    let is_plain = digits.len() <= 18 && (digits == "0" || !digits.starts_with('0'));
    Some((name, digits.parse().ok().filter(|_| is_plain)?))
}

impl GoneKeys {
    pub(crate) fn contains(&self, key: &str) -> bool {
        match split(key) {
            Some((name, number)) => self.numbered.get(name).is_some_and(|runs| runs.contains(number)),
            None => self.others.contains(key),
        }
    }

    /// Returns whether a new variable may not have this name.
    pub(crate) fn is_taken(&self, key: &str) -> bool {
        self.contains(key) && !self.free.contains(key)
    }

    /// Takes note of a variable that is gone, and whether something of it is left.
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
    pub keys: GoneKeys,
    pub factors: Runs,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn runs_hold_what_was_put_in(numbers in prop::collection::vec(0..30u64, 0..40)) {
            let mut runs = Runs::default();
            numbers.iter().for_each(|n| runs.insert(*n));
            for n in 0..32 {
                prop_assert_eq!(runs.contains(n), numbers.contains(&n));
            }
            // no two of them meet
            let ends: Vec<(u64, u64)> = runs.0.into_iter().collect();
            prop_assert!(ends.windows(2).all(|pair| pair[0].1 < pair[1].0));
        }
    }

    #[test]
    fn names_are_told_apart() {
        let mut gone = GoneKeys::default();
        ["x7", "x07", "lamp", "12", "y99999999999999999999999"].iter().for_each(|key| gone.insert(key, true));
        assert!(["x7", "x07", "lamp", "12", "y99999999999999999999999"].iter().all(|key| gone.contains(key)));
        assert!(["x8", "x007", "lam", "1", "y9", "x"].iter().all(|key| !gone.contains(key)));
    }
}
