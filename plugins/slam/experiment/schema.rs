//! JSON Schema of a run for completion and checks in editors, generated from the types that read it.
use crate::document::ExperimentDocument;
use manifactor_config::{Definitions, graph_root};
use manifactor_mapping::semantics::{RulesDocument, SemanticsDocument, SizesDocument};
use manifactor_mapping::settings::RunSettings;
use manifactor_mapping::settings::run_document::RunHeader;
use manifactor_recording::source::FrameLine;
use serde_json::{Value, json};

/// The schema of a [`RunDocument`](manifactor_mapping::settings::run_document::RunDocument), with everything
/// registered that it can name; its definitions are put among the others.
pub fn run_root(definitions: &mut Definitions) -> Value {
    let mut root = definitions.of::<RunSettings>();
    let mut header = definitions.of::<RunHeader>();
    let mut literal = graph_root(definitions);
    let mut own = json!({
        "semantics": definitions.of::<SemanticsDocument>(),
        "sizes": definitions.of::<SizesDocument>(),
    });
    own["semantics"]["description"] =
        json!("Rules that give factors to objects: a list of rules, the name of a shipped table, or a file.");
    own["sizes"]["description"] = json!(
        "Typical sizes of classes, as priors: a list of sizes, the name of a shipped table, or a file."
    );
    for field in ["variables", "factors"] {
        own[field] = literal["properties"][field].take();
    }
    if let Some(properties) = root["properties"].as_object_mut() {
        for more in [own, header["properties"].take()] {
            properties.extend(more.as_object().cloned().into_iter().flatten());
        }
    }
    titled(root, "A run", "Source of the data, settings of the graph, and the solver.")
}

/// Returns the schema of a file of semantic rules, which runs can name. Its definitions are added to
/// `definitions`.
pub fn rules_root(definitions: &mut Definitions) -> Value {
    let description = "Rules that runs name: semantics = \"this_file.toml\".";
    titled(definitions.of::<RulesDocument>(), "Semantic rules", description)
}

/// The schema of an [`Experiment`](crate::Experiment); its definitions are put among the others.
pub fn experiment_root(definitions: &mut Definitions) -> Value {
    let root = definitions.of::<ExperimentDocument>();
    titled(root, "An experiment", "A run over a grid of settings and seeds.")
}

/// Returns the schema of a frame of a stream, one line of JSON. Its definitions are added to `definitions`.
pub fn frame_root(definitions: &mut Definitions) -> Value {
    let description = "A line of a stream, read by the source `json_lines`.";
    titled(definitions.of::<FrameLine>(), "A frame of a stream", description)
}

fn titled(mut root: Value, title: &str, description: &str) -> Value {
    root["title"] = json!(title);
    root["description"] = json!(description);
    root
}
