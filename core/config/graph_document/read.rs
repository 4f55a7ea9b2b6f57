//! A literal graph, read.
use super::check::check;
use crate::document::Document;
use indexmap::IndexMap;
use manifactor_graph::loss::Loss;
use manifactor_graph::{Factor, FactorEntry, Fixed, Graph, Key, Values, Variable};
use manifactor_tree::Place;
use manifactor_tree::Problem;
use manifactor_tree::Section;
use manifactor_tree::{Diagnostic, Diagnostics, Errors};
use manifactor_tree::{Node, Value};
use std::sync::Arc;

/// Reads a document that is a graph: every variable and every factor by key.
///
/// ```toml
/// [[variables]]
/// key = "x0"
/// value = { type = "se2", x = 0.0, y = 0.0, theta = 0.0 }
/// fixed = true                                   # or the names of some directions of its tangent space
///
/// [[factors]]
/// keys = ["x0", "x1"]
/// factor = { type = "between_se2", x = 1.0, y = 0.0, theta = 0.1 }
/// noise = { sigmas = [0.1, 0.1, 0.02] }          # unit, where it is left out
/// loss = { type = "huber", scale = 1.345 }       # none, where it is left out
/// ```
///
/// What [`write_graph`](crate::write_graph) writes, this reads back to the last bit.
///
/// # Errors
/// Everything that is wrong with it, at once: unknown types and fields, wrong types of fields, variables given twice,
/// and factors that do not fit their variables or their noise.
pub fn read_graph(document: &Document) -> Result<(Graph, Values), Diagnostics> {
    let errors = Errors::new();
    let graph = document.section(&errors).map(|mut section| {
        let graph = read_graph_section(&mut section);
        section.finish();
        graph
    });
    errors.finish(graph)
}

/// Takes `variables` and `factors` out of a table. What is wrong is reported and left out.
pub fn read_graph_section(section: &mut Section<'_>) -> (Graph, Values) {
    let errors = section.errors();
    let mut read = Read::default();
    for variable in section.required_items("variables") {
        read.variable(variable);
    }
    for factor in section.items("factors") {
        read.factor(factor);
    }
    check(&read, section.place(), errors);
    (read.graph, read.values)
}

/// What was read, and where.
#[derive(Default)]
pub(super) struct Read {
    pub graph: Graph,
    pub values: Values,
    /// Every variable that was declared, readable or not.
    pub variables: IndexMap<Key, VariablePlace>,
    /// The places of every factor, and which factor of the graph it became.
    pub factors: Vec<FactorPlace>,
}

pub(super) struct VariablePlace {
    pub key: Place,
    /// The directions to be held, or `true`.
    pub fixed: Vec<(Place, String)>,
}

pub(super) struct FactorPlace {
    pub keys: Place,
    /// Each key and its place.
    pub each: Vec<(Place, Key)>,
    /// The noise; the factor, where there is none.
    pub noise: Place,
    /// Whether it is in the graph: in it are only those that could be read.
    pub read: bool,
}

impl Read {
    fn variable(&mut self, mut section: Section<'_>) {
        let errors = section.errors();
        let key = section.required::<String>("key").map(Key::from);
        let place = section.place_of("key");
        let value = section.required::<Box<dyn Variable>>("value");
        let fixed = section.take("fixed").and_then(|node| fixed(&node, errors));
        section.finish();
        let Some(key) = key else { return };
        if key.as_str().is_empty() {
            errors.push(Diagnostic::new(place, Problem::invalid("a key needs at least one character")));
            return;
        }
        if let Some(first) = self.variables.get(&key) {
            errors.push(Diagnostic::duplicate("variable", key.as_str(), place, first.key.clone()));
            return;
        }
        let (directions, fixed) = fixed.unwrap_or((Vec::new(), Fixed::Whole(false)));
        if let Some(value) = value {
            self.values.insert_boxed(key.clone(), value);
            self.graph.set_fixed(key.clone(), fixed);
        }
        self.variables.insert(key, VariablePlace { key: place, fixed: directions });
    }

    fn factor(&mut self, mut section: Section<'_>) {
        let errors = section.errors();
        let keys = section.take_required("keys");
        let place = section.place_of("keys");
        let each = keys.and_then(|node| keys_of(node, errors));
        let noise = if section.has("noise") { "noise" } else { "factor" };
        let factor = section.required::<Box<dyn Factor>>("factor");
        let noise_before = errors.len();
        let noise_value = section.or_default("noise");
        let noise_read = errors.len() == noise_before;
        let loss = section.optional::<Box<dyn Loss>>("loss");
        let noise = section.place_of(noise);
        section.finish();
        let mut read = false;
        if let (Some(factor), Some(each)) = (factor, &each) {
            // with a noise that could not be read, the keys can be checked all the same
            let noise = if noise_read { noise_value } else { Default::default() };
            let keys = each.iter().map(|(_, key)| key.clone()).collect();
            self.graph.push(FactorEntry {
                keys,
                factor: Arc::from(factor),
                noise,
                loss: loss.map(Arc::from),
            });
            read = true;
        }
        self.factors.push(FactorPlace { keys: place, each: each.unwrap_or_default(), noise, read });
    }
}

/// The keys of a factor, each with its place.
fn keys_of(node: Node, errors: &Errors) -> Option<Vec<(Place, Key)>> {
    let Value::Array(items) = node.value else {
        let problem = Problem::wrong_type("an array of keys", node.in_words());
        errors.report(node.place, problem);
        return None;
    };
    let read = |item: &Node| Some((item.place.clone(), Key::from(item.read::<String>(errors)?)));
    let keys: Vec<Option<(Place, Key)>> = items.iter().map(read).collect();
    keys.into_iter().collect()
}

/// `true`, `false`, or the names of directions, each with its place.
fn fixed(node: &Node, errors: &Errors) -> Option<(Vec<(Place, String)>, Fixed)> {
    match &node.value {
        Value::Bool(whole) => Some((vec![(node.place.clone(), String::new())], Fixed::Whole(*whole))),
        Value::Array(items) => {
            let names: Vec<Option<String>> = items.iter().map(|item| item.read(errors)).collect();
            let names: Option<Vec<String>> = names.into_iter().collect();
            let places = items.iter().map(|item| item.place.clone());
            let names = names?;
            Some((places.zip(names.iter().cloned()).collect(), Fixed::Directions(names)))
        }
        _ => {
            let expected = "true, false, or an array of directions of the tangent space";
            errors.report(node.place.clone(), Problem::wrong_type(expected, node.in_words()));
            None
        }
    }
}
