//! JSON Schema of a run, for editors to complete and check by.
use crate::class::Aliases;
use crate::settings::{CutSides, EvaluationSettings, ReportSettings};
use crate::variance::VarianceSettings;
use manifactor_config::Definitions;
use manifactor_graph::Noise;
use manifactor_quadric::BoxModel;
use serde_json::{Value, json};

/// The schema of a [`RunDocument`](crate::run_document::RunDocument), with everything registered that it can name; its
/// definitions are put among the others.
pub fn run_root(definitions: &mut Definitions) -> Value {
    let mut properties = settings(definitions);
    let text = |description: &str| json!({ "type": "string", "description": description });
    let own = json!({
        "title": text("What it is called in reports."),
        "output": text("Where its results go; out/ and the document's name, where nothing is said."),
        "folder": text("From which its files are named; its own, where nothing is said."),
        "variants": {
            "type": "array",
            "description": "Ways to do the run, to compare.",
            "items": object(json!({
                "name": text("Its name, one of its own."),
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
    let rule = object(
        json!({
            "classes": { "type": "array", "items": { "type": "string" }, "description": "Names of classes, as any detector spells them." },
            // where its `up` is left open, it gets the run's gravity
            "factor": definitions.kind("factor"),
            "noise": noise,
            "loss": loss,
        }),
        &["classes", "factor"],
        "What objects of some classes get.",
    );
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
            "description": "Which classes get which factors: rules, the name of a shipped table, or a file.",
            "anyOf": [{ "type": "string" }, { "type": "array", "items": rule }],
        },
        "aliases": definitions.of::<Aliases>(),
        "variance_components": definitions.of::<VarianceSettings>(),
        "solver": definitions.kind("solver"),
        "evaluation": definitions.of::<EvaluationSettings>(),
        "report": definitions.of::<ReportSettings>(),
    })
}

fn object(properties: Value, required: &[&str], description: &str) -> Value {
    let mut object = json!({
        "type": "object", "description": description, "required": required, "additionalProperties": false,
    });
    object["properties"] = properties;
    object
}
