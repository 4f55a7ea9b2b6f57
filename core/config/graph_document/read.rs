//! Reading of graph documents.
use super::check::check;
use super::each::{Each, entries};
use crate::document::Document;
use indexmap::IndexMap;
use manifactor_document::{Diagnostic, Diagnostics, Errors, Fault, Node, Section, Value};
use manifactor_graph::loss::Loss;
use manifactor_graph::{Bounds, Factor, FactorEntry, Fixed, Graph, Key, Noise, Values, Variable};
use schemars::JsonSchema;
use serde::Deserialize;
use std::borrow::Cow;
use std::sync::Arc;

/// Reads a graph document, which lists all variables and factors by key.
///
/// ```toml
/// [[variables]]
/// key = "x0"
/// value = { type = "se2", translation = [0.0, 0.0], angle = 0.0 }
/// fixed = true                                   # or the names of some directions of its tangent space
///
/// [[variables]]
/// key = "x1"
/// value = { type = "se2", translation = [1.0, 0.0], angle = 0.1 }
///
/// [[variables]]
/// key = "scale"
/// value = { type = "point1", position = [1.0] }
/// bounds = { x = { min = 0.5, max = 2.0 } }      # limits of coordinates, which steps do not cross
///
/// [[factors]]
/// keys = ["x0", "x1"]
/// factor = { type = "between_se2", relative = { translation = [1.0, 0.0], angle = 0.1 } }
/// noise = { sigmas = [0.1, 0.1, 0.02] }          # unit, where it is left out
/// loss = { type = "huber", scale = 1.345 }       # none, where it is left out
///
/// [[factors]]                                    # one factor for each value of the arrays in `each`
/// keys = ["x1"]
/// factor = { type = "position_se2" }
/// each.factor.position = [[1.0, 0.1], [1.1, 0.0]]
/// ```
///
/// Reading the text of [`write_graph`](crate::write_graph) restores all values bit for bit.
///
/// # Errors
/// All errors at once: unknown types and fields, wrong types of fields, variables that are given twice, and
/// factors that do not fit their variables or their noise.
pub fn read_graph(document: &Document) -> Result<(Graph, Values), Diagnostics> {
    let errors = Errors::new();
    let graph = document.section(&errors).map(|mut section| {
        let graph = read_graph_section(&mut section);
        section.finish();
        graph
    });
    errors.finish(graph)
}

/// Takes `variables` and `factors` from a table. Entries with errors are reported and left out.
pub fn read_graph_section(section: &mut Section<'_>) -> (Graph, Values) {
    let errors = section.errors();
    let mut read = Read::default();
    for variable in section.required_nodes("variables") {
        read.variable(variable, errors);
    }
    for factor in section.nodes("factors") {
        read.factor(factor, errors);
    }
    check(&read, section.place(), errors);
    (read.graph, read.values)
}

/// A variable in a document.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct VariableDocument {
    /// Key of the variable, which factors refer to.
    key: Key,
    /// Initial value.
    value: Box<dyn Variable>,
    /// Tangent directions in which no step goes, or `true` for all of them. Those of a pose are the axes of its current
    /// frame, so that a coordinate can change as the pose turns.
    #[serde(default)]
    fixed: Fixed,
    /// Limits of coordinates, by the names of their directions. Default: none.
    #[serde(default)]
    bounds: Bounds,
}

/// A factor in a document.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct FactorDocument {
    /// Keys of the variables that it connects.
    #[schemars(length(min = 1))]
    keys: Vec<Key>,
    /// Name in reports. Default: the name of its type.
    #[serde(default)]
    name: Option<Arc<str>>,
    /// Type and parameters of the factor.
    factor: Box<dyn Factor>,
    /// Noise model of its residual.
    #[serde(default)]
    noise: Noise,
    /// Robust loss, which limits large residuals. Default: none.
    #[serde(default)]
    loss: Option<Box<dyn Loss>>,
    /// Fields that differ between factors, which this entry then stands for.
    #[serde(default, rename = "each")]
    _each: Option<Each>,
}

/// A graph with the nodes that it was read from.
#[derive(Default)]
pub(super) struct Read<'a> {
    pub graph: Graph,
    pub values: Values,
    /// Nodes of all declared variables, also of variables with errors.
    pub variables: IndexMap<Key, &'a Node>,
    /// Nodes of all factors in the graph.
    pub factors: Vec<Cow<'a, Node>>,
    /// Nodes of factors with errors.
    pub unread: Vec<Cow<'a, Node>>,
}

impl<'a> Read<'a> {
    fn variable(&mut self, node: &'a Node, errors: &Errors) {
        let read = node.read_partial::<VariableDocument>(&[], errors);
        let key = match (&read, node.field("key")) {
            (Some(variable), _) => variable.key.clone(),
            // a variable with errors still counts as declared
            (None, Some(Node { value: Value::String(key), .. })) => Key::from(key.as_str()),
            (None, _) => return,
        };
        let place = &node.field("key").unwrap_or(node).place;
        if key.as_str().is_empty() {
            let problem = Fault::invalid("a key needs at least one character");
            errors.push(Diagnostic::new(place.clone(), problem));
            return;
        }
        if let Some(first) = self.variables.get(&key) {
            let first = first.field("key").unwrap_or(first).place.clone();
            errors.push(Diagnostic::duplicate("variable", key.as_str(), place.clone(), first));
            return;
        }
        if let Some(variable) = read {
            self.values.insert_boxed(key.clone(), variable.value);
            self.graph.set_fixed(key.clone(), variable.fixed);
            self.graph.set_bounds(key.clone(), variable.bounds);
        }
        self.variables.insert(key, node);
    }

    /// Reads the factors of an entry, up to the first one with errors.
    fn factor(&mut self, node: &'a Node, errors: &Errors) {
        for entry in entries(node, errors) {
            let read = entry.read_partial(&[], errors);
            let Some(FactorDocument { keys, name, factor, noise, loss, .. }) = read else {
                return self.unread.push(entry);
            };
            self.graph.push(FactorEntry {
                keys,
                name,
                factor: Arc::from(factor),
                noise,
                loss: loss.map(Arc::from),
            });
            self.factors.push(entry);
        }
    }
}
