//! Writing of graph documents, with one line for each value, factor, noise and loss.
use crate::format::Format;
use crate::write::{WriteError, tree};
use ::toml::Value;
use manifactor_graph::{Bounds, FactorEntry, Fixed, Graph, Key, Values, Variable};
use serde::Serialize;

#[derive(Serialize)]
struct Literal<'a> {
    variables: Vec<LiteralVariable<'a>>,
    factors: &'a [FactorEntry],
}

#[derive(Serialize)]
struct LiteralVariable<'a> {
    key: &'a Key,
    value: &'a dyn Variable,
    #[serde(skip_serializing_if = "Option::is_none")]
    fixed: Option<&'a Fixed>,
    #[serde(skip_serializing_if = "Option::is_none")]
    bounds: Option<&'a Bounds>,
}

/// Writes a graph and its values as a document. [`read_graph`](crate::read_graph) restores it bit for bit.
///
/// # Errors
/// If a fixed or bounded variable has no value, or a value is not finite.
pub fn write_graph(graph: &Graph, values: &Values, format: Format) -> Result<String, WriteError> {
    if let Some(key) =
        graph.fixed().keys().chain(graph.bounds().keys()).find(|key| !values.contains(key.as_str()))
    {
        return Err(WriteError::MissingValue { key: key.clone() });
    }
    let variables = values
        .iter()
        .map(|(key, value)| {
            let (fixed, bounds) = (graph.fixed().get(key), graph.bounds().get(key));
            LiteralVariable { key, value, fixed, bounds }
        })
        .collect();
    let literal = Literal { variables, factors: graph.factors() };
    match format {
        Format::Toml => Ok(toml(&tree(format, &literal)?)),
        Format::Json => json(&tree(format, &literal)?),
        Format::Yaml => format.write(&literal),
    }
}

/// Formats `[[variables]]` and `[[factors]]`, with one line for each field.
fn toml(literal: &Value) -> String {
    let mut text = String::new();
    for name in ["variables", "factors"] {
        let items = literal.get(name).and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
        if items.is_empty() {
            // an empty array has no header and has to be written before all headers
            text.insert_str(0, &format!("{name} = []\n"));
        }
        for item in items.iter().filter_map(Value::as_table) {
            text += &format!("[[{name}]]\n");
            for (field, value) in item {
                text += &format!("{field} = {value}\n");
            }
            text += "\n";
        }
    }
    text
}

/// Formats one line for each variable and each factor.
fn json(literal: &Value) -> Result<String, WriteError> {
    let fail =
        |e: serde_json::Error| WriteError::Inexpressible { format: Format::Json, message: e.to_string() };
    let mut parts = Vec::new();
    for name in ["variables", "factors"] {
        let items = literal.get(name).and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
        let lines = items.iter().map(serde_json::to_string).collect::<Result<Vec<_>, _>>().map_err(fail)?;
        let lines = if lines.is_empty() { String::new() } else { format!("\n  {}\n", lines.join(",\n  ")) };
        parts.push(format!("\"{name}\": [{lines}]"));
    }
    Ok(format!("{{\n{}\n}}\n", parts.join(",\n")))
}
