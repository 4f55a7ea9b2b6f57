//! Suggestions of existing names for an unknown name.

/// Largest number of names in a message.
const MAX_LISTED: usize = 30;

/// Smallest number of letters that count as the beginning of a name.
const MIN_PREFIX: usize = 3;

/// Returns the known name that is closest to `name`, if it is similar enough or begins with `name`.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wanted = normal(name);
    let letters = wanted.chars().count();
    let begins = |k: &str| letters >= MIN_PREFIX && normal(k).starts_with(&wanted);
    known
        .into_iter()
        .map(|k| (strsim::damerau_levenshtein(&wanted, &normal(k)), k))
        .filter(|(distance, k)| *distance <= k.chars().count().max(letters) / 3 || begins(k))
        .min_by(|a, b| a.0.cmp(&b.0).then_with(|| a.1.cmp(b.1)))
        .map(|(_, k)| k)
}

/// Normalizes case and hyphens, which cause most mistakes.
fn normal(name: &str) -> String {
    name.chars().take(64).map(|c| if c == '-' || c == ' ' { '_' } else { c.to_ascii_lowercase() }).collect()
}

/// Formats advice such as ``did you mean `a`? there are `a` and `b` ``.
pub fn advice(name: &str, known: &[String]) -> Option<String> {
    let near = nearest(name, known.iter().map(String::as_str));
    let list = list(known);
    match (near, known.is_empty()) {
        (_, true) => None,
        (Some(near), _) if known.len() == 1 => Some(format!("did you mean `{near}`?")),
        (Some(near), _) => Some(format!("did you mean `{near}`? there are {list}")),
        (None, _) if known.len() == 1 => Some(format!("there is only {list}")),
        (None, _) => Some(format!("there are {list}")),
    }
}

/// Formats a list: `` `a`, `b` and `c` ``.
pub(crate) fn list(names: &[String]) -> String {
    let quoted: Vec<String> = names.iter().take(MAX_LISTED).map(|n| format!("`{n}`")).collect();
    match (names.len().saturating_sub(MAX_LISTED), quoted.split_last()) {
        (more @ 1.., _) => format!("{} and {more} more", quoted.join(", ")),
        (0, Some((last, rest))) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        _ => quoted.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_finds_its_name() {
        let known = ["vertical_orientation", "bounding_box", "between_se2", "between_se3"];
        assert_eq!(nearest("vertical-orientation", known), Some("vertical_orientation"));
        assert_eq!(nearest("boundingbox", known), Some("bounding_box"));
        assert_eq!(nearest("betwen_se3", known), Some("between_se3"));
        assert_eq!(nearest("Between_SE2", known), Some("between_se2"));
        assert_eq!(nearest("levenberg", ["dogleg", "levenberg_marquardt"]), Some("levenberg_marquardt"));
    }

    #[test]
    fn a_stranger_finds_none() {
        assert_eq!(nearest("gaussian", ["huber", "cauchy"]), None);
        assert_eq!(nearest("", ["huber"]), None);
        assert_eq!(nearest("x", []), None);
        assert_eq!(nearest("x", ["y"]), None);
    }

    #[test]
    fn long_lists_are_cut() {
        let names: Vec<String> = (0..100).map(|i| format!("x{i}")).collect();
        assert!(list(&names).ends_with("`x29` and 70 more"));
        assert_eq!(list(&names[..2]), "`x0` and `x1`");
        assert_eq!(list(&names[..1]), "`x0`");
    }
}
