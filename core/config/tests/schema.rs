//! The schema of graph documents.
#![allow(dead_code, reason = "types that are here for their schemas alone")]

use manifactor_config::{Definitions, graph_schema};
use manifactor_graph::catalogue::entries;
use manifactor_graph::register;
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

trait Shade {}
manifactor_graph::kind!(dyn Shade, "shade");

mod one {
    /// A level.
    #[derive(serde::Deserialize, schemars::JsonSchema)]
    pub(crate) struct Level {
        percent: f64,
    }
}
mod two {
    /// Another level.
    #[derive(serde::Deserialize, schemars::JsonSchema)]
    pub(crate) struct Level {
        name: String,
    }
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Grey {
    level: one::Level,
}
impl Shade for Grey {}
register!(dyn Shade, "grey", Grey);

#[derive(Deserialize, JsonSchema)]
#[serde(untagged)]
enum Named {
    ByName { level: two::Level },
    ByNumber { number: u32 },
}
impl Shade for Named {}
register!(dyn Shade, "named", Named);

fn references(schema: &Value, found: &mut Vec<String>) {
    match schema {
        Value::Object(object) => object.iter().for_each(|(key, value)| match value {
            Value::String(text) if key == "$ref" => found.push(text.clone()),
            value => references(value, found),
        }),
        Value::Array(items) => items.iter().for_each(|item| references(item, found)),
        _ => {}
    }
}

#[test]
fn every_reference_leads_somewhere() {
    let schema = graph_schema();
    let mut found = Vec::new();
    references(&schema, &mut found);
    assert!(found.len() > 10);
    for reference in found {
        assert!(schema.pointer(reference.trim_start_matches('#')).is_some(), "{reference}");
    }
}

#[test]
fn the_tag_is_among_the_fields_of_every_registered_type() {
    let schema = graph_schema();
    for kind in ["factor", "variable", "loss"] {
        assert!(!entries(kind).is_empty());
        for entry in entries(kind) {
            let definition = &schema["$defs"][format!("{kind}.{}", entry.name)];
            assert_eq!(definition["properties"]["type"], json!({ "const": entry.name }));
            assert!(definition["required"].as_array().unwrap().contains(&json!("type")));
            assert_eq!(definition["additionalProperties"], false, "{}", entry.name);
        }
    }
    assert_eq!(schema["$defs"]["factor.offset"]["required"], json!(["type", "measured"]));
}

#[test]
fn alternatives_get_the_tag_each_and_names_do_not_clash() {
    let mut definitions = Definitions::new();
    let root = definitions.kind("shade");
    let schema = definitions.document(root);
    assert_eq!(schema["$defs"]["Level"]["description"], "A level.");
    assert_eq!(schema["$defs"]["shade.named.Level"]["description"], "Another level.");
    let named = &schema["$defs"]["shade.named"]["anyOf"];
    assert_eq!(named[0]["properties"]["type"]["const"], "named");
    assert_eq!(named[0]["properties"]["level"]["$ref"], "#/$defs/shade.named.Level");
    assert_eq!(named[1]["required"], json!(["type", "number"]));
}

#[test]
fn a_kind_that_nothing_is_linked_of_fits_nothing() {
    let mut definitions = Definitions::new();
    let root = definitions.kind("nothing");
    assert_eq!(definitions.document(root)["$defs"]["nothing"], false);
}
