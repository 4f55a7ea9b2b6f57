use manifactor_config::{Fault, Section, read_graph_section};
use manifactor_graph::{FactorEntry, Fixed, Graph, Key, Values, Variable};
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

/// `[[variables]]` and `[[factors]]` of a run: a literal graph that is solved with the map, such as the plane of a table
/// that semantic rules connect objects with. In the frame of the map.
#[derive(Debug, Clone, Default)]
pub struct OwnGraph {
    /// Factors among the variables, and which of these are held.
    pub graph: Graph,
    /// The variables, where the solve begins.
    pub values: Values,
}

impl OwnGraph {
    pub(super) fn take(section: &mut Section<'_>) -> Self {
        if !section.has("variables") && !section.has("factors") {
            // known all the same, where others are misspelt
            let _ = (section.take("variables"), section.take("factors"));
            return Self::default();
        }
        let (graph, values) = read_graph_section(section);
        for (key, _) in values.iter().filter(|(key, _)| is_of_the_map(key)) {
            let message = format!("`{key}` is the key of a pose or an object");
            let help = "x0, x1, … are the poses and q0, q1, … the objects of a run: choose another name";
            section.report("variables", Fault::with_help(message, help));
        }
        Self { graph, values }
    }

    /// Variables whose key is one of these prefixes and a number, each with its prefix.
    pub(super) fn numbered(
        &self,
        prefixes: &'static [&'static str],
    ) -> impl Iterator<Item = (&Key, &'static str)> {
        let prefix = |key: &Key| prefixes.iter().copied().find(|prefix| is_numbered(key.as_str(), prefix));
        self.values.iter().filter_map(move |(key, _)| Some((key, prefix(key)?)))
    }

    /// Puts all of it into a graph.
    pub fn add_to(&self, graph: &mut Graph, values: &mut Values) {
        for (key, value) in self.values.iter() {
            values.insert_boxed(key.clone(), value.erased().clone_box());
        }
        for (key, fixed) in self.graph.fixed() {
            graph.set_fixed(key.clone(), fixed.clone());
        }
        graph.factors_mut().extend(self.graph.factors().iter().cloned());
    }
}

/// Returns whether a key is a prefix and a number.
fn is_numbered(key: &str, prefix: &str) -> bool {
    let number = key.strip_prefix(prefix).unwrap_or_default();
    !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit())
}

fn is_of_the_map(key: &Key) -> bool {
    ["x", "q"].iter().any(|prefix| is_numbered(key.as_str(), prefix))
}

/// As documents write it; nothing at all, where there is nothing.
impl Serialize for OwnGraph {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Written<'a> {
            key: &'a str,
            value: &'a dyn Variable,
            #[serde(skip_serializing_if = "Option::is_none")]
            fixed: Option<&'a Fixed>,
        }
        let mut map = serializer.serialize_map(None)?;
        if !self.values.is_empty() {
            let fixed = self.graph.fixed();
            let written = self.values.iter().map(|(key, value)| Written {
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
