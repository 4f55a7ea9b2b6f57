//! The fields of a registered type, from its JSON Schema.
use manifactor::graph::catalogue;
use serde_json::Value;

/// A field, described in words.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Field {
    /// Name of the field; `stop.step` inside a table, `variables[].key` inside the items of a list.
    pub name: String,
    pub kind: String,
    pub default: Option<String>,
    pub required: bool,
    pub docs: String,
}

/// The fields of an object, including those of nested objects.
pub(crate) fn fields(schema: &Value) -> Vec<Field> {
    let mut out = Vec::new();
    collect(schema, schema, "", &mut out);
    out
}

fn collect(root: &Value, schema: &Value, prefix: &str, out: &mut Vec<Field>) {
    let schema = resolve(root, schema);
    let Some(properties) = schema.get("properties").and_then(Value::as_object) else { return };
    let required = |name: &str| {
        let list = schema.get("required").and_then(Value::as_array);
        list.is_some_and(|list| list.iter().any(|r| r == name))
    };
    for (name, property) in properties {
        let path = format!("{prefix}{name}");
        let target = resolve(root, property);
        let docs = property.get("description").or_else(|| target.get("description"));
        let docs = docs.and_then(Value::as_str).unwrap_or_default();
        let docs = docs.split("\n\n").next().unwrap_or_default().replace('\n', " ");
        let mut within = if prefix.matches('.').count() < 3 { within(root, property) } else { Vec::new() };
        within.dedup();
        let nested = !within.is_empty();
        let default = property.get("default").filter(|default| !nested && !default.is_null()).map(value);
        let kind = kind(root, property);
        out.push(Field { name: path.clone(), kind, default, required: required(name), docs });
        for (table, item) in within {
            collect(root, table, &format!("{path}{item}."), out);
        }
    }
}

/// The tables in a field or in its list, each with the suffix for the names of its fields. Empty for
/// registered types and for noise, which have their own sections.
fn within<'a>(root: &'a Value, schema: &'a Value) -> Vec<(&'a Value, &'static str)> {
    if registered(schema).is_some() {
        return Vec::new();
    }
    let schema = resolve(root, schema);
    if schema.get("properties").is_some() {
        return if is_noise(root, schema) { Vec::new() } else { vec![(schema, "")] };
    }
    if let Some(items) = schema.get("items") {
        return within(root, items).into_iter().map(|(table, _)| (table, "[]")).collect();
    }
    let alternatives = schema.get("anyOf").and_then(Value::as_array).into_iter().flatten();
    alternatives.flat_map(|alternative| within(root, alternative)).collect()
}

/// The kind of registered types that a schema refers to.
fn registered(schema: &Value) -> Option<&'static str> {
    let name = schema.get("$ref")?.as_str()?.strip_prefix("#/$defs/")?;
    catalogue::all().iter().map(|entry| entry.kind).find(|kind| *kind == name)
}

/// Returns whether a schema is the noise, either inline or as the shared definition.
fn is_noise(root: &Value, schema: &Value) -> bool {
    let defined = || root.pointer("/$defs/Noise").is_some_and(|noise| noise == schema);
    schema.get("title").is_some_and(|title| title == "Noise") || defined()
}

/// A default in its usual notation: `1e15` and not a one with fifteen zeros, and only the name of a
/// registered type.
fn value(default: &Value) -> String {
    if let Some(Value::String(name)) = default.get("type") {
        return name.clone();
    }
    if let Value::Object(fields) = default {
        let fields: Vec<_> = fields.iter().map(|(name, x)| format!("{name} = {}", value(x))).collect();
        return if fields.is_empty() { "{}".into() } else { format!("{{ {} }}", fields.join(", ")) };
    }
    match default.as_f64() {
        Some(x) if x != 0.0 && !(1e-3..1e6).contains(&x.abs()) => format!("{x:e}"),
        _ => default.to_string(),
    }
}

/// Follows a `$ref` into the definitions.
fn resolve<'a>(root: &'a Value, schema: &'a Value) -> &'a Value {
    let target = schema.get("$ref").and_then(Value::as_str).and_then(|r| r.strip_prefix('#'));
    target.and_then(|pointer| root.pointer(pointer)).unwrap_or(schema)
}

/// The type in words.
fn kind(root: &Value, schema: &Value) -> String {
    if let Some(kind) = registered(schema) {
        return kind.to_owned();
    }
    let schema = resolve(root, schema);
    if is_noise(root, schema) {
        return "noise".into();
    }
    let list = |key| schema.get(key).and_then(Value::as_array);
    if let Some(values) = list("enum") {
        return values.iter().map(ToString::to_string).collect::<Vec<_>>().join(" or ");
    }
    if let Some(value) = schema.get("const") {
        return value.to_string();
    }
    if let Some(alternatives) = list("anyOf").or_else(|| list("oneOf")) {
        let mut words: Vec<_> = alternatives.iter().map(|s| kind(root, s)).filter(|k| k != "null").collect();
        words.dedup();
        return words.join(" or ");
    }
    match schema.get("type") {
        Some(Value::String(name)) if name == "array" => {
            let count = |key| schema.get(key).and_then(Value::as_u64);
            let items = schema.get("items").map(|items| kind(root, items)).unwrap_or_default();
            match (count("minItems"), count("maxItems")) {
                (Some(least), Some(most)) if least == most => format!("{least} × {items}"),
                _ => format!("list of {items}"),
            }
        }
        Some(Value::String(name)) => in_words(name).into(),
        Some(Value::Array(names)) => {
            let names = names.iter().filter_map(Value::as_str).filter(|n| *n != "null");
            names.map(in_words).collect::<Vec<_>>().join(" or ")
        }
        _ => "anything".into(),
    }
}

fn in_words(name: &str) -> &str {
    match name {
        "object" => "table",
        "string" => "text",
        "array" => "list",
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn fields_of_fields_have_their_path() {
        let schema = json!({
            "properties": {
                "stop": { "$ref": "#/$defs/Stop", "description": "When to stop." },
                "scale": { "type": ["number", "null"], "default": null },
                "up": { "type": "array", "items": { "type": "number" }, "minItems": 3, "maxItems": 3 },
            },
            "required": ["up"],
            "$defs": { "Stop": { "type": "object", "properties": { "step": { "type": "number", "default": 0.1 } } } },
        });
        let found = fields(&schema);
        let short: Vec<_> = found.iter().map(|f| (f.name.as_str(), f.kind.as_str(), f.required)).collect();
        assert_eq!(
            short,
            [
                ("stop", "table", false),
                ("stop.step", "number", false),
                ("scale", "number", false),
                ("up", "3 × number", true)
            ]
        );
        assert_eq!(found[1].default.as_deref(), Some("0.1"));
        assert_eq!(found[0].docs, "When to stop.");
    }

    #[test]
    fn fields_of_items_are_told_and_those_of_registered_types_are_elsewhere() {
        let schema = json!({ "properties": { "rules": { "anyOf": [{ "type": "string" }, { "type": "array", "items": { "type": "object",
            "properties": { "factor": { "$ref": "#/$defs/factor" }, "noise": { "title": "Noise", "properties": {} } }
        } }] } } });
        let found = fields(&schema);
        let short: Vec<_> = found.iter().map(|f| (f.name.as_str(), f.kind.as_str())).collect();
        assert_eq!(
            short,
            [("rules", "text or list of table"), ("rules[].factor", "factor"), ("rules[].noise", "noise")]
        );
    }
}
