//! One JSON Schema for a whole document, for editors to complete and check by.
//!
//! Each registered type's schema is that of its fields. Its tag `type` is put in among them: a schema that denies other
//! properties would deny the tag if it stood beside (`allOf`).
use crate::graph_document::{FactorDocument, VariableDocument};
use indexmap::IndexMap;
use manifactor_graph::catalogue::{Entry, entries};
use schemars::{JsonSchema, Schema, schema_for};
use serde_json::{Map, Value, json};

const DRAFT: &str = "https://json-schema.org/draft/2020-12/schema";

/// The schema of [literal graphs](crate::read_graph), with every factor, manifold and loss that is linked.
pub fn graph_schema() -> Value {
    let mut definitions = Definitions::new();
    let root = graph_root(&mut definitions);
    definitions.document(root)
}

/// [`graph_schema`] without its definitions, which are put among the others.
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

/// The `$defs` of a schema that is being put together out of many.
#[derive(Debug, Default)]
pub struct Definitions(IndexMap<String, Value>);

impl Definitions {
    /// None.
    pub fn new() -> Self {
        Self::default()
    }

    /// A reference to one of the registered types of a kind, told by `type`.
    pub fn kind(&mut self, kind: &str) -> Value {
        if !self.0.contains_key(kind) {
            self.0.insert(kind.to_owned(), Value::Null);
            let entries = entries(kind);
            let names: Vec<&str> = entries.iter().map(|entry| entry.name).collect();
            let each: Vec<Value> = entries.into_iter().map(|entry| self.chosen(entry)).collect();
            let any = match names.is_empty() {
                // where nothing is linked, nothing fits
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

    /// The schema of a serde type.
    pub fn of<T: JsonSchema>(&mut self) -> Value {
        self.hoist(schema_for!(T), T::schema_name().as_ref())
    }

    /// The whole schema: the root of the document with these definitions.
    pub fn document(self, root: Value) -> Value {
        let mut schema = Map::from_iter([("$schema".to_owned(), json!(DRAFT))]);
        if let Value::Object(root) = root {
            schema.extend(root);
        }
        schema.insert("$defs".to_owned(), Value::Object(self.0.into_iter().collect()));
        Value::Object(schema)
    }

    /// A registered type, where it is the one that `type` names: so a mistake in its fields is told once, and not as one of
    /// each type that the table is not.
    fn chosen(&mut self, entry: &Entry) -> Value {
        let name = format!("{}.{}", entry.kind, entry.name);
        let mut schema = self.hoist((entry.schema)(), &name);
        tag(&mut schema, entry.name, &self.0);
        self.0.insert(name.clone(), schema);
        let named = json!({ "properties": { "type": { "const": entry.name } }, "required": ["type"] });
        json!({ "if": named, "then": reference(&name) })
    }

    /// Puts in the kinds of registered types that a schema refers to.
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

    /// The schema without its own definitions, which move here; those whose name is taken by another get one with
    /// `owner` before it.
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

/// Puts the tag among the properties of an object, and of each of its alternatives.
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
