//! Errors between the factors and the variables of a document, with positions.
use super::read::Read;
use manifactor_document::{Diagnostic, Errors, Fault, Node, Place, Value, nearest, quoted_list};
use manifactor_graph::{GraphError, Key, OutOfBounds};

/// Largest number of variables that are listed for an unknown key.
const MAX_LISTED: usize = 12;
/// Number of unknown keys for which the nearest known key is searched. Each search visits all variables.
const MAX_SEARCHED: usize = 100;

/// Reports all errors of the graph and its values.
pub(super) fn check(read: &Read<'_>, root: &Place, errors: &Errors) {
    let mut unknown = 0;
    for key in read.factors.iter().chain(&read.unread).flat_map(|factor| factor.items("keys")) {
        if let Value::String(name) = &key.value
            && !read.variables.contains_key(name.as_str())
        {
            errors.report(key.place.clone(), missing(read, name, unknown < MAX_SEARCHED));
            unknown += 1;
        }
    }
    for error in read.graph.check(&read.values) {
        if let Some(diagnostic) = place(read, &error, root) {
            errors.push(diagnostic);
        }
    }
}

fn missing(read: &Read<'_>, key: &str, search: bool) -> Fault {
    let names = || read.variables.keys().map(Key::as_str);
    let known = match read.variables.len() {
        0..=MAX_LISTED => names().map(str::to_owned).collect(),
        _ if search => nearest(key, names()).map(str::to_owned).into_iter().collect(),
        _ => Vec::new(),
    };
    Fault::UnknownName { what: "variable".into(), name: key.to_owned(), known }
}

/// Lists the variables of the type that a factor expects.
fn of_type(read: &Read<'_>, expected: &str) -> String {
    let fit = read.values.iter().filter(|(_, value)| value.typetag_name() == expected);
    let keys: Vec<String> = fit.take(MAX_LISTED + 1).map(|(key, _)| key.to_string()).collect();
    match keys.len() {
        0 => format!("no variable here is of type `{expected}`: add one, or take another factor"),
        1..=MAX_LISTED => format!("of type `{expected}`: {}", quoted_list(&keys)),
        _ => format!("many others are of type `{expected}`"),
    }
}

/// Converts an error to a diagnostic. Returns `None` if it was already reported.
fn place(read: &Read<'_>, error: &GraphError, root: &Place) -> Option<Diagnostic> {
    let at = |node: Option<&Node>| node.map_or(root, |node| &node.place).clone();
    let factor = |factor: &usize| read.factors.get(*factor);
    let at_key = |of: &usize, position: usize| at(factor(of).and_then(|f| f.items("keys").get(position)));
    let variable = |key: &Key| read.variables.get(key);
    let at_variable = |key: &Key| at(variable(key).and_then(|variable| variable.field("key")));
    let bound = |key: &Key, direction: &str| variable(key)?.field("bounds")?.field(direction);
    Some(match error {
        GraphError::MissingVariable { .. } => return None,
        GraphError::WrongArity { factor: of, name, expected, found } => {
            let place = at(factor(of).and_then(|factor| factor.field("keys")));
            let keys = if *found == 1 { "key" } else { "keys" };
            let message = match found {
                0 => format!("`{name}` connects variables, and no key is given"),
                _ => format!("`{name}` connects {expected} variables, found {found} {keys}"),
            };
            Diagnostic::new(place, Fault::invalid(message))
        }
        GraphError::WrongType { factor: of, name, position, key, expected, found } => {
            let message =
                format!("`{name}` takes a variable of type `{expected}` here, `{key}` is of type `{found}`");
            let problem = Fault::with_help(message, of_type(read, expected));
            let related = Some((at_variable(key), "it is declared here".into()));
            Diagnostic { related, ..Diagnostic::new(at_key(of, *position), problem) }
        }
        GraphError::RepeatedVariable { factor: of, name, position, key } => {
            let message = format!("`{name}` connects `{key}` to itself");
            let help = "a factor's variables have to be different ones";
            Diagnostic::new(at_key(of, *position), Fault::with_help(message, help))
        }
        GraphError::Noise { factor: of, source, .. } => {
            let place = at(factor(of).and_then(|f| f.field("noise").or_else(|| f.field("factor"))));
            Diagnostic::new(place, Fault::invalid(source.to_string()))
        }
        GraphError::UnknownDirection { key, direction, tangent } => {
            let names = variable(key).map(|variable| variable.items("fixed")).unwrap_or_default();
            let is_it = |node: &&Node| matches!(&node.value, Value::String(name) if name == direction);
            let place =
                names.iter().find(is_it).or_else(|| bound(key, direction)).map(|node| node.place.clone());
            let known = tangent.iter().map(|name| (*name).to_owned()).collect();
            let problem = Fault::UnknownName { what: "direction".into(), name: direction.clone(), known };
            Diagnostic::new(place.unwrap_or_else(|| at_variable(key)), problem)
        }
        GraphError::NoCoordinate { key, direction, .. } => {
            Diagnostic::new(at(bound(key, direction)), Fault::invalid(error.to_string()))
        }
        GraphError::OutOfBounds(OutOfBounds { key, direction, .. }) => {
            Diagnostic::new(at(bound(key, direction)), Fault::invalid(error.to_string()))
        }
        GraphError::MissingFixed { key } | GraphError::NotFinite { key } => {
            Diagnostic::new(at_variable(key), Fault::invalid(error.to_string()))
        }
        _ => Diagnostic::new(root.clone(), Fault::invalid(error.to_string())),
    })
}
