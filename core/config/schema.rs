//! One JSON Schema for a whole document, for completion and checks in editors.
//!
//! The schema of a registered type describes its fields. The tag `type` is added to these properties. A
//! separate schema in `allOf` would not work, because a schema that denies additional properties would deny
//! the tag.
use crate::graph_document::{FactorDocument, VariableDocument};
use indexmap::IndexMap;
use manifactor_graph::catalogue::{Entry, entries};
use schemars::{JsonSchema, Schema, schema_for};
use serde_json::{Map, Value, json};

const DRAFT: &str = "https://json-schema.org/draft/2020-12/schema";

/// Returns the schema of [graph documents](crate::read_graph), with all linked factors, manifolds and losses.
pub fn graph_schema() -> Value {
    let mut definitions = Definitions::new();
    let root = graph_root(&mut definitions);
    definitions.document(root)
}

/// Returns [`graph_schema`] without its definitions, which are added to `definitions`.
pub fn graph_root(definitions: &mut Definitions) -> Value {
    let (variable, factor) = (definitions.of::<VariableDocument>(), definitions.of::<FactorDocument>());
    let (start, solver) = (definitions.kind("start"), definitions.kind("solver"));
    json!({
        "title": "A factor graph",
        "description": "Variables with their initial values, the factors between them, and how to solve them.",
        "type": "object",
        "properties": {
            "variables": { "type": "array", "items": variable },
            "factors": { "type": "array", "items": factor },
            "start": start,
            "solver": solver,
        },
        "required": ["variables"],
        "additionalProperties": false,
    })
}

/// The `$defs` of a schema that is composed of several schemas.
#[derive(Debug, Default)]
pub struct Definitions(IndexMap<String, Value>);

impl Definitions {
    /// Creates an empty set.
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns a reference to the registered types of a kind. The field `type` selects one.
    pub fn kind(&mut self, kind: &str) -> Value {
        if !self.0.contains_key(kind) {
            self.0.insert(kind.to_owned(), Value::Null);
            let entries = entries(kind);
            let names: Vec<&str> = entries.iter().map(|entry| entry.name).collect();
            let each: Vec<Value> = entries.into_iter().map(|entry| self.chosen(entry)).collect();
            let any = match names.is_empty() {
                // without linked types, no value is valid
                true => json!(false),
                false => json!({
                    "type": "object",
                    "properties": { "type": { "enum": names } },
                    "required": ["type"],
                    "allOf": each,
                }),
            };
            self.0.insert(kind.to_owned(), any);
        }
        reference(kind)
    }

    /// Returns the schema of a serde type.
    pub fn of<T: JsonSchema>(&mut self) -> Value {
        self.hoist(schema_for!(T), T::schema_name().as_ref())
    }

    /// Returns the whole schema: the root of the document with these definitions.
    pub fn document(self, root: Value) -> Value {
        let mut schema = Map::from_iter([("$schema".to_owned(), json!(DRAFT))]);
        if let Value::Object(root) = root {
            schema.extend(root);
        }
        schema.insert("$defs".to_owned(), Value::Object(self.0.into_iter().collect()));
        Value::Object(schema)
    }

    /// Returns the schema of a registered type on the condition that `type` names it. An error in its fields
    /// is then reported once, and not again for each type of the kind.
    fn chosen(&mut self, entry: &Entry) -> Value {
        let name = format!("{}.{}", entry.kind, entry.name);
        let mut schema = self.hoist((entry.schema)(), &name);
        tag(&mut schema, entry.name, &self.0);
        self.0.insert(name.clone(), schema);
        let named = json!({ "properties": { "type": { "const": entry.name } }, "required": ["type"] });
        json!({ "if": named, "then": reference(&name) })
    }

    /// Adds the kinds of registered types that a schema refers to.
    fn kinds_of(&mut self, schema: &Value) {
        match schema {
            Value::Object(object) => {
                let named =
                    object.get("$ref").and_then(Value::as_str).and_then(|r| r.strip_prefix("#/$defs/"));
                if let Some(kind) = named.filter(|name| !self.0.contains_key(*name)) {
                    self.kind(kind);
                }
                object.values().for_each(|value| self.kinds_of(value));
            }
            Value::Array(items) => items.iter().for_each(|item| self.kinds_of(item)),
            _ => {}
        }
    }

    /// Moves the definitions of a schema here and returns the schema without them. If a name is already taken
    /// by a different definition, it gets `owner` as a prefix.
    fn hoist(&mut self, schema: Schema, owner: &str) -> Value {
        let mut schema = Value::from(schema);
        let Some(object) = schema.as_object_mut() else { return schema };
        object.shift_remove("$schema");
        let Some(Value::Object(definitions)) = object.shift_remove("$defs") else {
            self.kinds_of(&schema);
            return schema;
        };
        let taken = |name: &str, value: &Value| self.0.get(name).is_some_and(|other| other != value);
        let renamed: Vec<(String, String)> = definitions
            .iter()
            .filter(|(name, value)| taken(name, value))
            .map(|(name, _)| (format!("#/$defs/{name}"), format!("#/$defs/{owner}.{name}")))
            .collect();
        let mut moved = Vec::new();
        for (name, mut value) in definitions {
            rename(&mut value, &renamed);
            let old = format!("#/$defs/{name}");
            let name = if renamed.iter().any(|(o, _)| *o == old) { format!("{owner}.{name}") } else { name };
            moved.push(value.clone());
            self.0.insert(name, value);
        }
        rename(&mut schema, &renamed);
        moved.iter().chain([&schema]).for_each(|schema| self.kinds_of(schema));
        schema
    }
}

fn reference(name: &str) -> Value {
    json!({ "$ref": format!("#/$defs/{name}") })
}

/// Adds the tag to the properties of an object and of each of its alternatives.
fn tag(schema: &mut Value, name: &str, definitions: &IndexMap<String, Value>) {
    if let Some(target) = schema.get("$ref").and_then(Value::as_str).and_then(|r| r.strip_prefix("#/$defs/"))
    {
        // the type is used elsewhere without a tag, so its definition is copied
        if let Some(target) = definitions.get(target) {
            *schema = target.clone();
        }
    }
    let Some(object) = schema.as_object_mut() else { return };
    let mut alternatives = false;
    for of in ["oneOf", "anyOf"] {
        if let Some(Value::Array(each)) = object.get_mut(of) {
            each.iter_mut().for_each(|schema| tag(schema, name, definitions));
            alternatives = true;
        }
    }
    if alternatives && !object.contains_key("properties") {
        return;
    }
    object.insert("type".to_owned(), json!("object"));
    let mut properties = Map::from_iter([("type".to_owned(), json!({ "const": name }))]);
    if let Some(Value::Object(own)) = object.shift_remove("properties") {
        properties.extend(own);
    }
    object.insert("properties".to_owned(), Value::Object(properties));
    let mut required = vec![json!("type")];
    if let Some(Value::Array(own)) = object.shift_remove("required") {
        required.extend(own);
    }
    object.insert("required".to_owned(), Value::Array(required));
}

fn rename(schema: &mut Value, names: &[(String, String)]) {
    match schema {
        Value::Object(object) => {
            for (key, value) in object.iter_mut() {
                match value {
                    Value::String(text) if key == "$ref" => {
                        if let Some((_, new)) = names.iter().find(|(old, _)| old == text) {
                            new.clone_into(text);
                        }
                    }
                    value => rename(value, names),
                }
            }
        }
        Value::Array(items) => items.iter_mut().for_each(|item| rename(item, names)),
        _ => {}
    }
}
