use crate::{manifactor, root};
use jsonschema::Validator;
use manifactor::config::{Document, Format};
use manifactor::graph::catalogue;
use serde_json::Value;
use std::path::{Path, PathBuf};

fn validator(document: &str) -> Validator {
    jsonschema::validator_for(&manifactor(&format!("schema {document}")).ended(0).json()).unwrap()
}

/// Collects all documents in a folder and below.
fn documents(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
        if entry.is_dir() {
            documents(&entry, found);
        } else if entry.extension().is_some_and(|e| e == "toml") {
            found.push(entry);
        }
    }
}

fn complaints(schema: &Validator, document: &Value) -> Vec<String> {
    schema.iter_errors(document).map(|e| format!("{} at {}", e, e.instance_path)).collect()
}

#[test]
fn the_schema_accepts_every_example_and_refuses_a_misspelt_one() {
    let (any, graph) = (validator(""), validator("graph"));
    let mut found = vec![];
    documents(&root().join("examples"), &mut found);
    assert!(found.len() >= 8, "{found:?}");
    for path in &found {
        // its factor is registered by a separate example program
        if path.ends_with("01_new_factor/desk.toml") {
            continue;
        }
        let document = Document::open(path).unwrap().root().to_json().unwrap();
        assert_eq!(complaints(&any, &document), [""; 0], "{}", path.display());
        let mut wrong = document.clone();
        wrong["sover"] = Value::Null;
        assert!(!any.is_valid(&wrong), "{}", path.display());
    }
    let wrong = r#"{ "variables": [{ "key": "x0", "value": { "type": "se2", "translation": [0, 0], "angel": 0 } }] }"#;
    assert!(!graph.is_valid(&serde_json::from_str(wrong).unwrap()));
}

#[test]
fn the_schema_of_a_frame_accepts_lines_and_refuses_a_misspelt_one() {
    let frame = validator("frame");
    let read = |line: &str| serde_json::from_str::<Value>(line).unwrap();
    let camera = "camera = { fx = 320, fy = 320, cx = 320, cy = 240, width = 640, height = 480 }";
    let further = format!(
        "source.cameras.rear={{ {camera}, body_from_camera = {{ translation = [0, 0, 0], rotation = [0, 1, 0, 0] }} }}"
    );
    let simulate = ["simulate", "examples/desk/desk.toml", "--lines", "--set"];
    let more =
        ["source.detector.depth_error=0.02", "--set", &further, "--set", "source.trajectory.frames=20"];
    let lines = crate::run(simulate.into_iter().chain(more), &[]).ended(0).stdout;
    let closure = r#"{"timestamp": 4, "pose": {"translation": [0, 0, 0], "rotation": [0, 0, 0, 1]}, "odometry_noise": {"sigma": 0.1},
        "factors": [{"id": "loop", "keys": [1.0, 4], "factor": {"type": "between_se3", "relative": {"translation": [0, 0, 0],
        "rotation": [0, 0, 0, 1]}}, "noise": {"sigma": 0.1}}], "removed": ["a"],
        "corrected": [{"timestamp": 1, "pose": {"translation": [0, 0, 0], "rotation": [0, 0, 0, 1]}}]}"#;
    for line in lines.lines().map(read).chain([read(closure)]) {
        assert_eq!(complaints(&frame, &line), [""; 0], "{line}");
    }
    let seen = |field: &str| {
        read(&format!(r#"{{"timestamp": 1, "boxes": [{{"box": [1, 2, 3, 4], "{field}": 2.0}}]}}"#))
    };
    assert!(frame.is_valid(&seen("depth")) && !frame.is_valid(&seen("dept")));
    assert!(!frame.is_valid(&read(r#"{"timestamp": 1, "pse": null}"#)));
}

#[test]
fn every_registered_type_is_in_the_schema_and_its_example_fits() {
    let schema = manifactor("schema").ended(0).json();
    let definitions = &schema["$defs"];
    for entry in catalogue::all() {
        let name = format!("{}.{}", entry.kind, entry.name);
        assert!(definitions[&name].is_object(), "{name} is not in the schema");
        let example = entry.example().unwrap();
        let example = Document::parse("example", example, Format::Toml).unwrap().root().to_json().unwrap();
        let one = serde_json::json!({ "$ref": format!("#/$defs/{name}"), "$defs": definitions });
        let one = jsonschema::validator_for(&one).unwrap();
        for table in tables_of_type(&example, entry.name) {
            assert_eq!(complaints(&one, table), [""; 0], "{name}: {table}");
        }
    }
}

fn tables_of_type<'a>(value: &'a Value, name: &str) -> Vec<&'a Value> {
    match value {
        Value::Object(table) if table.get("type").is_some_and(|t| t == name) => vec![value],
        Value::Object(table) => table.values().flat_map(|v| tables_of_type(v, name)).collect(),
        Value::Array(items) => items.iter().flat_map(|v| tables_of_type(v, name)).collect(),
        _ => vec![],
    }
}

#[test]
fn completions_and_the_manual_know_every_command() {
    for shell in ["bash", "zsh", "fish"] {
        let script = manifactor(&format!("completions {shell}")).ended(0).stdout;
        assert!(script.contains("check-factor") && script.contains("experiment"), "{shell}");
    }
    let page = manifactor("man").ended(0).stdout;
    assert!(page.starts_with(".ie") && page.contains("check\\-factor"), "{page}");
    assert!(manifactor("man plot").ended(0).stdout.contains("record.json"));
    manifactor("man plto").ended(2).complains("unknown command `plto`");
}
