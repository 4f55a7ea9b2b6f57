//! Numbers and lists as text.
use std::collections::BTreeMap;

/// Returns `1 edge`, `2 edges`, `2 boxes`.
pub fn count(n: usize, noun: &str) -> String {
    let plural = if noun.ends_with(['x', 's']) || noun.ends_with("ch") { "es" } else { "s" };
    format!("{n} {noun}{}", if n == 1 { "" } else { plural })
}

/// Returns the first few items of a list, and the number of further ones.
pub fn list(items: impl ExactSizeIterator<Item = impl ToString>) -> String {
    const MAX_LISTED: usize = 8;
    let more = items.len().saturating_sub(MAX_LISTED);
    let text = items.take(MAX_LISTED).map(|item| item.to_string()).collect::<Vec<_>>().join(", ");
    if more > 0 { format!("{text} and {more} more") } else { text }
}

/// Returns notes about variables and factors that a format cannot express, by type name.
pub(crate) fn omission_notes(format: &str, variables: &ByName, factors: &ByName) -> Vec<String> {
    let counts = variables.iter().map(|c| (c, "variable")).chain(factors.iter().map(|c| (c, "factor")));
    let note = |((name, n), what): ((&&str, &usize), &str)| {
        format!("{format} cannot express {} of type {name}: left out", count(*n, what))
    };
    counts.map(note).collect()
}

/// Counts by type name.
pub(crate) type ByName = BTreeMap<&'static str, usize>;
