//! Parsing of trait objects by name: `solver = { type = "gauss_newton", max_iterations = 20 }`.
use crate::registry::catalogue::{Entry, Kind, TAG, all, entries, find};
use manifactor_document::{Fault, Field, Node, Place, ReadError, Value, advice, nearest};

/// Reads a table as the registered type of kind `K` that its `type` names.
///
/// # Errors
/// If `type` is missing or not registered, or a field is wrong; each with its position.
pub fn read<K: Kind + ?Sized>(node: &Node) -> Result<Box<K>, ReadError> {
    let tag = match &node.value {
        Value::Table(table) => table.get(TAG),
        _ => None,
    };
    let entry = match tag {
        Some(Field { node: tag, .. }) => {
            entry_of(tag, K::NAME).map_err(|problem| (tag.place.clone(), problem))
        }
        None => Err(untagged(node, K::NAME)),
    };
    entry.map_err(|(place, problem)| ReadError::new(place, problem))?.read(node)
}

/// Returns the entry that a tag names.
fn entry_of(tag: &Node, kind: &str) -> Result<&'static Entry, Fault> {
    let a = article(kind);
    Err(match &tag.value {
        Value::String(name) => match find(kind, name) {
            Some(entry) => return Ok(entry),
            None => match all().into_iter().find(|e| e.name == name) {
                Some(other) => {
                    let (b, other) = (article(other.kind), other.kind);
                    let message = format!("`{name}` is {b} {other}, not {a} {kind}");
                    Fault::Invalid { message, help: advice("", &known(kind)) }
                }
                None => unknown(kind, name),
            },
        },
        _ => Fault::wrong_type(format!("the name of {a} {kind}"), tag.in_words()),
    })
}

/// Describes an unknown name: misspelt, or from a plugin that is not linked.
fn unknown(kind: &str, name: &str) -> Fault {
    let known = known(kind);
    if nearest(name, known.iter().map(String::as_str)).is_some() {
        return Fault::UnknownName { what: kind.to_owned(), name: name.to_owned(), known };
    }
    let link =
        "if a plugin brings it, the binary has to link the plugin: `use the_plugin as _;` beside its `main`";
    let help = advice(name, &known).map_or_else(|| link.to_owned(), |known| format!("{known}; {link}"));
    Fault::with_help(format!("unknown {kind} `{name}`"), help)
}

/// Describes a missing `type`.
fn untagged(node: &Node, kind: &str) -> (Place, Fault) {
    let a = article(kind);
    let (place, problem) = match &node.value {
        Value::Table(table) => match table.iter().find(|(name, _)| nearest(name, [TAG]).is_some()) {
            Some((name, field)) => {
                let problem = Fault::UnknownField { field: name.clone(), known: vec![TAG.to_owned()] };
                (&field.key, problem)
            }
            None => {
                let message = format!("missing field `type`, the name of {a} {kind}");
                (&node.place, Fault::Invalid { message, help: advice("", &known(kind)) })
            }
        },
        value => {
            let expected = format!("a table with the `type` of {a} {kind}");
            let problem = Fault::wrong_type(expected, node.in_words());
            match value {
                Value::String(name) if find(kind, name).is_some() => {
                    let help = format!("write {{ type = {name:?} }}");
                    (&node.place, Fault::with_help(problem.to_string(), help))
                }
                _ => (&node.place, problem),
            }
        }
    };
    (place.clone(), problem)
}

fn known(kind: &str) -> Vec<String> {
    entries(kind).iter().map(|e| e.name.to_owned()).collect()
}

fn article(noun: &str) -> &'static str {
    if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" }
}
