//! Serde's messages as problems, in words of documents rather than of Rust.
use crate::node::{Node, Value};
use crate::problem::Problem;

/// The problem that a message of serde tells of; `node` is what stands at its place, if that is known.
pub(crate) fn problem_of(message: &str, node: Option<&Node>) -> Problem {
    let message = message.lines().find(|line| !line.trim().is_empty()).unwrap_or_default().trim();
    let table = node.is_some_and(|n| matches!(n.value, Value::Table(_)));
    if let Some(rest) = message.strip_prefix("unknown field ") {
        let (field, known) = names(rest);
        return Problem::UnknownField { field, known };
    }
    if let Some(rest) = message.strip_prefix("unknown variant ") {
        let (name, known) = names(rest);
        return match table {
            // { sigma = 1 } names its variant as a field
            true => Problem::UnknownField { field: name, known },
            false => Problem::UnknownName { what: "value".into(), name, known },
        };
    }
    if let Some(rest) = message.strip_prefix("missing field ") {
        return Problem::MissingField { field: rest.trim_matches('`').to_owned() };
    }
    for prefix in ["invalid type: ", "invalid value: ", "invalid length "] {
        let split = message.strip_prefix(prefix).and_then(|rest| rest.split_once(", expected "));
        if let Some((found, expected)) = split {
            let found = match (prefix, node) {
                ("invalid length ", _) if found == "1" => "1 element".to_owned(),
                ("invalid length ", _) => format!("{found} elements"),
                (_, Some(node)) => node.in_words(),
                (_, None) => found.to_owned(),
            };
            return Problem::WrongType { expected: in_words(expected), found };
        }
    }
    if message.starts_with("data did not match any variant of untagged enum") {
        let found = node.map_or_else(|| "something else".to_owned(), Node::in_words);
        return Problem::invalid(format!("{found} has none of the forms that are possible here"));
    }
    Problem::invalid(message)
}

/// The first quoted name, and all the others.
fn names(text: &str) -> (String, Vec<String>) {
    let mut quoted = text.split('`').skip(1).step_by(2).map(str::to_owned);
    (quoted.next().unwrap_or_default(), quoted.collect())
}

/// What serde expected, without Rust's types.
fn in_words(expected: &str) -> String {
    let words = match expected {
        "f64" | "f32" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, 0 or more",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "a nonzero u32" | "a nonzero u64" | "a nonzero usize" => "a whole number, 1 or more",
        "a boolean" => "true or false",
        "a string" | "a borrowed string" | "path string" => "a text",
        "a sequence" => "an array",
        "a map" => "a table",
        "fewer elements in array" => "fewer elements",
        _ => "",
    };
    match words {
        "" if expected.starts_with("struct ") => "a table".into(),
        "" if expected.starts_with("tuple ") || expected.starts_with("a tuple") => match size(expected) {
            Some(size) => format!("an array of {size}"),
            None => "an array".into(),
        },
        "" if expected.starts_with("an array of length ") => {
            format!("an array of {}", size(expected).unwrap_or("some size"))
        }
        "" if expected.contains(" enum ") || expected.starts_with("enum ") => "a name or a table".into(),
        "" => expected.to_owned(),
        words => words.to_owned(),
    }
}

/// `3` of `an array of length 3`, `a tuple of size 3`, `tuple struct Box with 3 elements`.
fn size(expected: &str) -> Option<&str> {
    expected.split_whitespace().find(|word| word.bytes().all(|b| b.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_and_their_neighbours_are_told() {
        let problem = problem_of("unknown field `sigam`, expected one of `sigma`, `loss`", None);
        assert_eq!(problem.to_string(), "unknown field `sigam`");
        assert_eq!(problem.help().unwrap(), "did you mean `sigma`? there are `sigma` and `loss`");
        let problem = problem_of("unknown field `x`, there are no fields", None);
        assert_eq!(problem.help().unwrap(), "there are no fields here");
    }

    #[test]
    fn types_are_said_in_words() {
        let say = |message| problem_of(message, None).to_string();
        assert_eq!(say("invalid type: string \"a\", expected f64"), "expected a number, found string \"a\"");
        assert_eq!(
            say("invalid length 2, expected an array of length 3"),
            "expected an array of 3, found 2 elements"
        );
        assert_eq!(say("invalid type: map, expected a tuple of size 4"), "expected an array of 4, found map");
        assert_eq!(say("sigma has to be positive\n\n"), "sigma has to be positive");
    }
}
