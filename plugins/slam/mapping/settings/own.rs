use manifactor_config::{Fault, Section, read_graph_section};
use manifactor_graph::{FactorEntry, Fixed, Graph, Key, Values, Variable};
use manifactor_recording::keys::{is_pose_or_object, key_number};
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

/// `[[variables]]` and `[[factors]]` of a run: a literal graph that is solved together with the map, in the
/// map frame. An example is the plane of a table that semantic rules connect with objects.
#[derive(Debug, Clone, Default)]
pub struct OwnGraph {
    /// Factors between the variables, and the variables that are held fixed.
    pub graph: Graph,
    /// Initial values of the variables.
    pub values: Values,
}

impl OwnGraph {
    pub(super) fn read_section(section: &mut Section<'_>) -> Self {
        if !section.has("variables") && !section.has("factors") {
            // still registers both names, so that an error about a misspelt field can suggest them
            let _ = (section.optional_node("variables"), section.optional_node("factors"));
            return Self::default();
        }
        let (graph, values) = read_graph_section(section);
        for (key, _) in values.iter().filter(|(key, _)| is_pose_or_object(key)) {
            let message = format!("`{key}` is the key of a pose or an object");
            let help = "x0, x1, … are the poses and q0, q1, … the objects of a run: choose another name";
            section.report("variables", Fault::with_help(message, help));
        }
        // a run with an incremental solver, or from a stream, would keep neither bounds nor constraints
        if let Some(key) = graph.bounds().keys().next() {
            let message = format!("`{key}` has bounds, and a run has none");
            let help = "leave them out, or solve a graph of its own with `manifactor solve`";
            section.report("variables", Fault::with_help(message, help));
        }
        if let Some(factor) = graph.factors().iter().position(FactorEntry::is_constraint) {
            let message = format!("factor {factor} is a constraint, and a run has none");
            section.report("factors", Fault::with_help(message, "give it a small noise instead"));
        }
        Self { graph, values }
    }

    /// Returns the variables whose key is one of these prefixes and a number, each with its prefix.
    pub(super) fn numbered_variables(
        &self,
        prefixes: &'static [&'static str],
    ) -> impl Iterator<Item = (&Key, &'static str)> {
        let prefix = |key: &Key| prefixes.iter().copied().find(|prefix| key_number(key, prefix).is_some());
        self.values.iter().filter_map(move |(key, _)| Some((key, prefix(key)?)))
    }

    /// Adds the variables and factors to a graph.
    pub fn add_to(&self, graph: &mut Graph, values: &mut Values) {
        for (key, value) in self.values.iter() {
            values.insert_boxed(key.clone(), value.erased().clone_box());
        }
        graph.extend(&self.graph);
    }
}

/// Writes the form of a document; empty lists are left out.
impl Serialize for OwnGraph {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct WrittenEntry<'a> {
            key: &'a str,
            value: &'a dyn Variable,
            #[serde(skip_serializing_if = "Option::is_none")]
            fixed: Option<&'a Fixed>,
        }
        let mut map = serializer.serialize_map(None)?;
        if !self.values.is_empty() {
            let fixed = self.graph.fixed();
            let written = self.values.iter().map(|(key, value)| WrittenEntry {
                key: key.as_str(),
                value,
                fixed: fixed.get(key),
            });
            map.serialize_entry("variables", &written.collect::<Vec<_>>())?;
        }
        let factors: &[FactorEntry] = self.graph.factors();
        if !factors.is_empty() {
            map.serialize_entry("factors", factors)?;
        }
        map.end()
    }
}
