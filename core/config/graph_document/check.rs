//! What is wrong between the factors and the variables of a document, at its place.
use super::read::{FactorPlace, Read};
use manifactor_graph::{GraphError, Key};
use manifactor_tree::Place;
use manifactor_tree::nearest;
use manifactor_tree::{Diagnostic, Errors};
use manifactor_tree::{Problem, quoted_list};

/// Up to this many variables are listed for a key that is none of them.
const LISTED: usize = 12;
/// Unknown keys for which the nearest known key is searched: each search goes through all variables.
const SEARCHED: usize = 100;

/// Reports everything that the graph finds wrong between itself and its values.
pub(super) fn check(read: &Read, root: &Place, errors: &Errors) {
    let mut unknown = 0;
    for (place, key) in read.factors.iter().flat_map(|factor| &factor.each) {
        if !read.variables.contains_key(key) {
            errors.report(place.clone(), missing(read, key, unknown < SEARCHED));
            unknown += 1;
        }
    }
    let factors: Vec<&FactorPlace> = read.factors.iter().filter(|factor| factor.read).collect();
    for error in read.graph.check(&read.values) {
        if let Some(diagnostic) = place(read, &factors, &error, root) {
            errors.push(diagnostic);
        }
    }
}

fn missing(read: &Read, key: &Key, search: bool) -> Problem {
    let names = || read.variables.keys().map(Key::as_str);
    let known = match read.variables.len() {
        0..=LISTED => names().map(str::to_owned).collect(),
        _ if search => nearest(key.as_str(), names()).map(str::to_owned).into_iter().collect(),
        _ => Vec::new(),
    };
    Problem::UnknownName { what: "variable".into(), name: key.to_string(), known }
}

/// Which variables a factor could have taken.
fn of_type(read: &Read, expected: &str) -> String {
    let fit = read.values.iter().filter(|(_, value)| value.typetag_name() == expected);
    let keys: Vec<String> = fit.take(LISTED + 1).map(|(key, _)| key.to_string()).collect();
    match keys.len() {
        0 => format!("no variable here is of type `{expected}`: add one, or take another factor"),
        1..=LISTED => format!("of type `{expected}`: {}", quoted_list(&keys)),
        _ => format!("many others are of type `{expected}`"),
    }
}

/// The error as a diagnostic; none, where it has been reported already.
fn place(read: &Read, factors: &[&FactorPlace], error: &GraphError, root: &Place) -> Option<Diagnostic> {
    let at_key = |factor: usize, position: usize| {
        let each = factors.get(factor).and_then(|f| f.each.get(position));
        each.map_or(root, |(place, _)| place).clone()
    };
    let at_variable = |key: &Key| read.variables.get(key).map_or(root, |v| &v.key).clone();
    Some(match error {
        GraphError::MissingVariable { .. } => return None,
        GraphError::WrongArity { factor, name, expected, found } => {
            let place = factors.get(*factor).map_or(root, |f| &f.keys).clone();
            let keys = if *found == 1 { "key" } else { "keys" };
            let message = match found {
                0 => format!("`{name}` connects variables, and no key is given"),
                _ => format!("`{name}` connects {expected} variables, found {found} {keys}"),
            };
            Diagnostic::new(place, Problem::invalid(message))
        }
        GraphError::WrongType { factor, name, position, key, expected, found } => {
            let message =
                format!("`{name}` takes a variable of type `{expected}` here, `{key}` is of type `{found}`");
            let problem = Problem::with_help(message, of_type(read, expected));
            let related = Some((at_variable(key), "it is declared here".into()));
            Diagnostic { related, ..Diagnostic::new(at_key(*factor, *position), problem) }
        }
        GraphError::RepeatedVariable { factor, name, position, key } => {
            let message = format!("`{name}` connects `{key}` to itself");
            let help = "a factor's variables have to be different ones";
            Diagnostic::new(at_key(*factor, *position), Problem::with_help(message, help))
        }
        GraphError::Noise { factor, source, .. } => {
            let place = factors.get(*factor).map_or(root, |f| &f.noise).clone();
            Diagnostic::new(place, Problem::invalid(source.to_string()))
        }
        GraphError::UnknownDirection { key, direction, tangent } => {
            let fixed = read.variables.get(key).map(|v| v.fixed.as_slice()).unwrap_or_default();
            let place = fixed.iter().find(|(_, name)| name == direction).map(|(place, _)| place.clone());
            let known = tangent.iter().map(|name| (*name).to_owned()).collect();
            let problem = Problem::UnknownName { what: "direction".into(), name: direction.clone(), known };
            Diagnostic::new(place.unwrap_or_else(|| at_variable(key)), problem)
        }
        GraphError::MissingFixed { key } | GraphError::NotFinite { key } => {
            Diagnostic::new(at_variable(key), Problem::invalid(error.to_string()))
        }
        _ => Diagnostic::new(root.clone(), Problem::invalid(error.to_string())),
    })
}
