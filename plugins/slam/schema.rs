//! JSON Schema of a run, for editors to complete and check by.
use crate::estimate::variance::VarianceSettings;
use crate::experiment::SummarySettings;
use crate::input::class::Aliases;
use crate::semantics::Near;
use crate::settings::{CutSides, EvaluationSettings, ReportSettings};
use manifactor_config::{Definitions, graph_root};
use manifactor_graph::Noise;
use manifactor_quadric::BoxModel;
use serde_json::{Value, json};

/// The schema of a [`RunDocument`](crate::settings::run_document::RunDocument), with everything registered that it can name; its
/// definitions are put among the others.
pub fn run_root(definitions: &mut Definitions) -> Value {
    let mut properties = settings(definitions);
    let text = |description: &str| json!({ "type": "string", "description": description });
    let own = json!({
        "title": text("What it is called in reports."),
        "output": text("Where its results go. Default: out/ and the document's name."),
        "folder": text("The folder that its paths are relative to. Default: its own."),
        "variants": {
            "type": "array",
            "description": "Ways to do the run, to compare.",
            "items": object(json!({
                "name": text("Its name, one of its own."),
                "about": text("What it does, in a sentence that reports repeat."),
                // a patch: parts of settings, that make sense with those of the document
                "set": { "type": "object", "description": "Settings of the document that are others here." },
            }), &["name"], "A way to do the run."),
        },
    });
    if let (Some(all), Value::Object(own)) = (properties.as_object_mut(), own) {
        all.extend(own);
    }
    let mut root = object(
        properties,
        &["source"],
        "Where data come from, how a graph is built of them, how it is solved.",
    );
    root["title"] = json!("A run");
    root
}

/// The settings, by section.
fn settings(definitions: &mut Definitions) -> Value {
    let (noise, loss) = (definitions.of::<Noise>(), definitions.kind("loss"));
    let number = |description: &str, default: f64| json!({ "type": "number", "minimum": 0, "default": default, "description": description });
    let count = |description: &str, default: u32| json!({ "type": "integer", "minimum": 0, "default": default, "description": description });
    let mut literal = graph_root(definitions);
    json!({
        "source": definitions.kind("source"),
        "odometry": object(json!({ "noise": noise, "loss": loss }), &[], "Factors between consecutive poses: rad, then m."),
        "prior": object(json!({ "noise": noise }), &[], "The factor that holds the first pose: rad, then m."),
        "detections": object(
            json!({
                "noise": noise,
                "loss": loss,
                "model": definitions.of::<BoxModel>(),
                "cut_sides": definitions.of::<CutSides>(),
                "border_px": number("Sides this near to the border count as cut, in pixels.", 20.0),
                "min_score": number("Detections whose best class scores less are left out.", 0.0),
            }),
            &[],
            "Which boxes are used, and how.",
        ),
        "objects": object(
            json!({
                "min_views": count("Objects with fewer boxes are left out.", 3),
                "max_box_deviation_px": number("Objects whose boxes vary more in width or height are left out, in pixels.", 50.0),
                "min_parallax_deg": number("Objects that are seen under a smaller angle are left out, in degrees.", 0.0),
                "initialiser": definitions.kind("initialiser"),
                "refinements": count("How many times each object is fitted alone before the joint solve.", 5),
            }),
            &[],
            "Which objects are mapped, and where they begin.",
        ),
        "gravity": definitions.kind("gravity"),
        "semantics": {
            "description": "Which objects get which factors: rules, the name of a shipped table, or a file.",
            "anyOf": [{ "type": "string" }, { "type": "array", "items": rule(definitions) }],
        },
        "variables": literal["properties"]["variables"].take(),
        "factors": literal["properties"]["factors"].take(),
        "aliases": definitions.of::<Aliases>(),
        "variance_components": definitions.of::<VarianceSettings>(),
        "solver": definitions.kind("solver"),
        "evaluation": definitions.of::<EvaluationSettings>(),
        "report": definitions.of::<ReportSettings>(),
    })
}

/// One `[[semantics]]`.
fn rule(definitions: &mut Definitions) -> Value {
    let share = |description: &str| json!({ "type": "number", "minimum": 0, "maximum": 1, "description": description });
    let size =
        |description: &str| json!({ "type": "number", "exclusiveMinimum": 0, "description": description });
    object(
        json!({
            "classes": { "type": "array", "items": { "type": "string" }, "description": "Names of classes, as any detector spells them; `*` for all." },
            "min_score": share("The score of an object's class, averaged over its detections, is at least this."),
            "min_size_m": size("It is at least this long, twice its longest semi-axis, where the solve begins, in metres."),
            "max_size_m": size("It is at most this long, in metres."),
            "near": definitions.of::<Near>(),
            "mixture": { "type": "boolean", "default": false, "description": "The factor holds as likely as the object is of these classes, or nothing does: a `max_mixture`; and it is for all objects that may be of them." },
            "with": { "type": "array", "items": { "type": "string" }, "description": "Keys of the document's own `variables` that the factor connects besides objects." },
            // where its `up` is left open, it gets the run's gravity
            "factor": definitions.kind("factor"),
            "noise": definitions.of::<Noise>(),
            "loss": definitions.kind("loss"),
        }),
        &["classes", "factor"],
        "What objects of some classes get. All rules that are for an object apply to it.",
    )
}

/// The schema of a file of semantic rules, which runs name; its definitions are put among the others.
pub fn rules_root(definitions: &mut Definitions) -> Value {
    let rules = json!({ "type": "array", "items": rule(definitions), "description": "Which objects get which factors." });
    let mut root = object(
        json!({ "semantics": rules }),
        &["semantics"],
        "Rules that runs name: semantics = \"this_file.toml\".",
    );
    root["title"] = json!("Semantic rules");
    root
}

/// The schema of an [`Experiment`](crate::experiment::Experiment); its definitions are put among the others.
pub fn experiment_root(definitions: &mut Definitions) -> Value {
    let text = |description: &str| json!({ "type": "string", "description": description });
    let set = |description: &str| json!({ "type": "object", "description": description });
    let option = object(
        json!({ "name": text("Its name in tables."), "about": text("What it does, in a sentence."), "set": set("Settings that are others.") }),
        &["name"],
        "A way to set it.",
    );
    let axis = json!({
        "type": "object",
        "description": "What is varied: columns with rows of values, or a name with options.",
        "properties": {
            "columns": { "type": "object", "additionalProperties": { "type": "string" }, "description": "Columns, and the setting that each changes: { seed = \"source.seed\" }." },
            "rows": { "type": "array", "description": "Their values: a list for each row, or the value itself where there is one column." },
            "name": text("The one column of an axis with options."),
            "options": { "type": "array", "items": option, "description": "Ways to set it." },
        },
        "additionalProperties": false,
        "anyOf": [{ "required": ["columns", "rows"] }, { "required": ["name", "options"] }],
    });
    let properties = json!({
        "title": text("What it is called in reports."),
        "output": text("Where its results go. Default: out/ and the document's name."),
        "base": text("The run that it varies: a path from this document."),
        "set": set("Settings of the base that are others in all trials."),
        "axes": { "type": "array", "items": axis, "description": "What is varied; all combinations are run." },
        "summary": definitions.of::<SummarySettings>(),
    });
    let mut root = object(properties, &["base"], "A run over a grid of settings and seeds.");
    root["title"] = json!("An experiment");
    root
}

fn object(properties: Value, required: &[&str], description: &str) -> Value {
    let mut object = json!({
        "type": "object", "description": description, "required": required, "additionalProperties": false,
    });
    object["properties"] = properties;
    object
}
