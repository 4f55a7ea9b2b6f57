//! The catalogue for Python: registered types, and the functions of formulas.
use manifactor::graph::catalogue::{Entry, all};
use manifactor::graph::manifold_name;
use manifactor::graph::quantity::{Function, functions, variable_quantity};
use pyo3::prelude::*;
use serde_json::{Value, json};

fn entry(entry: &Entry) -> Value {
    let signature = (entry.signature)();
    let variables: Vec<_> = signature.variables.iter().map(|id| manifold_name(*id)).collect();
    let quantity = variable_quantity((entry.type_id)()).filter(|_| entry.kind == "variable");
    json!({
        "kind": entry.kind,
        "name": entry.name,
        "summary": entry.summary(),
        "docs": entry.docs(),
        "schema": (entry.schema)(),
        "rows": signature.rows,
        "variables": variables,
        "many": signature.many,
        "tangent": signature.tangent,
        "quantity": quantity.map(|quantity| quantity.shape.name),
    })
}

fn function(function: &Function) -> Value {
    let arguments: Vec<_> = function.arguments.iter().map(|(name, shape)| [*name, shape.name]).collect();
    json!({
        "name": function.name,
        "arguments": arguments,
        "result": function.result.name,
        "size": function.result.size,
        "summary": function.summary.trim(),
    })
}

/// Returns all linked types as JSON: a list of entries.
#[pyfunction]
fn catalogue() -> String {
    Value::from_iter(all().into_iter().map(entry)).to_string()
}

/// Returns the functions of formulas as JSON.
#[pyfunction(name = "functions")]
fn functions_of_formulas() -> String {
    Value::from_iter(functions().into_iter().map(function)).to_string()
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(catalogue, module)?)?;
    module.add_function(wrap_pyfunction!(functions_of_formulas, module)?)
}
