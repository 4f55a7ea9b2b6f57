//! Trait objects that a document chooses by name: `solver = { type = "gauss_newton", max_iterations = 20 }`.
use crate::diagnostic::Errors;
use crate::node::{Field, Node, Value};
use crate::problem::Problem;
use crate::section::Section;
use crate::suggest::{advice, nearest};
use manifactor_graph::catalogue::{Entry, Kind, all, entries, find};

/// The field that names the type.
const TAG: &str = "type";

impl Section<'_> {
    /// A trait object that has to be there.
    pub fn registered<K: Kind + ?Sized>(&mut self, field: &str) -> Option<Box<K>> {
        let node = self.take_required(field)?;
        node.read_registered(self.errors())
    }

    /// A trait object that may be left out.
    pub fn optional_registered<K: Kind + ?Sized>(&mut self, field: &str) -> Option<Box<K>> {
        let node = self.take(field)?;
        node.read_registered(self.errors())
    }

    /// An array of trait objects; empty, if it is not there. Those that are wrong are reported and left out.
    pub fn registered_items<K: Kind + ?Sized>(&mut self, field: &str) -> Vec<Box<K>> {
        let errors = self.errors();
        self.nodes(field).into_iter().filter_map(|node| node.read_registered(errors)).collect()
    }
}

impl Node {
    /// Reads a table as the registered type of kind `K` that its `type` names.
    pub fn read_registered<K: Kind + ?Sized>(self, errors: &Errors) -> Option<Box<K>> {
        let (entry, fields) = self.named(K::NAME, errors)?;
        fields.read_with(errors, |json| entry.parse::<K>(json))
    }

    /// The catalogue's entry for a table's `type`, and the table without it.
    fn named(mut self, kind: &str, errors: &Errors) -> Option<(&'static Entry, Node)> {
        let entry = match &mut self.value {
            Value::Table(table) => match table.get(TAG) {
                Some(Field { node: tag, .. }) => {
                    let entry = entry_of(tag, kind, errors);
                    table.shift_remove(TAG);
                    entry
                }
                None => {
                    untagged(&self, kind, errors);
                    None
                }
            },
            _ => {
                untagged(&self, kind, errors);
                None
            }
        };
        Some((entry?, self))
    }
}

fn entry_of(tag: &Node, kind: &str, errors: &Errors) -> Option<&'static Entry> {
    let a = article(kind);
    let problem = match &tag.value {
        Value::String(name) => match find(kind, name) {
            Some(entry) => return Some(entry),
            None => match all().into_iter().find(|e| e.name == name) {
                Some(other) => {
                    let (b, other) = (article(other.kind), other.kind);
                    let message = format!("`{name}` is {b} {other}, not {a} {kind}");
                    Problem::Invalid { message, help: advice("", &known(kind)) }
                }
                None => unknown(kind, name),
            },
        },
        _ => Problem::wrong_type(format!("the name of {a} {kind}"), tag.in_words()),
    };
    errors.report(tag.place.clone(), problem);
    None
}

/// A name that nothing has: misspelt, or of a plugin that is not there.
fn unknown(kind: &str, name: &str) -> Problem {
    let known = known(kind);
    if nearest(name, known.iter().map(String::as_str)).is_some() {
        return Problem::UnknownName { what: kind.to_owned(), name: name.to_owned(), known };
    }
    let link =
        "if a plugin brings it, the binary has to link the plugin: `use the_plugin as _;` beside its `main`";
    let help = advice(name, &known).map_or_else(|| link.to_owned(), |known| format!("{known}; {link}"));
    Problem::with_help(format!("unknown {kind} `{name}`"), help)
}

/// Reports what has no `type`.
fn untagged(node: &Node, kind: &str, errors: &Errors) {
    let a = article(kind);
    let (place, problem) = match &node.value {
        Value::Table(table) => match table.iter().find(|(name, _)| nearest(name, [TAG]).is_some()) {
            Some((name, field)) => {
                let problem = Problem::UnknownField { field: name.clone(), known: vec![TAG.to_owned()] };
                (&field.key, problem)
            }
            None => {
                let message = format!("missing field `type`, the name of {a} {kind}");
                (&node.place, Problem::Invalid { message, help: advice("", &known(kind)) })
            }
        },
        value => {
            let expected = format!("a table with the `type` of {a} {kind}");
            let problem = Problem::wrong_type(expected, node.in_words());
            match value {
                Value::String(name) if find(kind, name).is_some() => {
                    let help = format!("write {{ type = {name:?} }}");
                    (&node.place, Problem::with_help(problem.to_string(), help))
                }
                _ => (&node.place, problem),
            }
        }
    };
    errors.report(place.clone(), problem);
}

fn known(kind: &str) -> Vec<String> {
    entries(kind).iter().map(|e| e.name.to_owned()).collect()
}

fn article(noun: &str) -> &'static str {
    if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" }
}
