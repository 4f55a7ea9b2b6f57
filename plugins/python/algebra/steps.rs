//! Steps on manifolds: x ⊞ δ and y ⊟ x, for values and for arrays of values.
use super::array::{Points, common_rows, into_python};
use crate::errors;
use crate::input::{Numbers, any_numbers, array, to_array};
use manifactor::graph::catalogue::find;
use numpy::{PyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::sync::Arc;

/// Returns the dimension of the tangent space of a type.
fn dimension(name: &str) -> usize {
    find("variable", name).map_or(0, |entry| (entry.signature)().tangent.len())
}

/// Reads tangent vectors: one, shape (dim,), or one per row, shape (n, dim). A number is a vector of one.
fn tangents(name: &str, value: &Bound<'_, PyAny>, dim: usize) -> PyResult<(Numbers, Option<usize>)> {
    let array = array("retract", name, value)?;
    let rows = match array.shape() {
        [] if dim == 1 => None,
        [size] if *size == dim => None,
        [rows, size] if *size == dim => Some(*rows),
        _ => {
            let found = array.getattr("shape")?;
            let message = format!("expected an array of shape ({dim},) or (n, {dim}), got {found}");
            return Err(errors::argument("retract", name, message));
        }
    };
    Ok((any_numbers("retract", name, &array)?, rows))
}

/// Returns the points that are reached along tangent vectors.
#[pyfunction]
fn retract<'py>(x: &Bound<'py, PyAny>, delta: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let points = Points::read("retract", "x", x)?;
    let name = points.array.name;
    let (deltas, count) = tangents("delta", delta, dimension(name))?;
    let rows = common_rows("retract", &[points.rows(), count])?;
    let mut moved = Vec::with_capacity(rows.unwrap_or(1));
    for row in 0..rows.unwrap_or(1) {
        let delta = if count.is_some() { deltas.row(row) } else { &deltas.values };
        let reached = points.row(row).and_then(|x| x.erased().retract(delta));
        let reached = reached.ok_or_else(|| errors::internal("retract"))?;
        if !reached.erased().is_finite() {
            return Err(errors::argument(
                "retract",
                "delta",
                "the step leads to numbers that are not finite",
            ));
        }
        moved.push(Arc::from(reached));
    }
    into_python(x.py(), name, moved, rows.is_some())
}

/// Returns the tangent vectors that lead to the points `to`.
#[pyfunction]
fn local<'py>(x: &Bound<'py, PyAny>, to: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let (from, to) = (Points::read("local", "x", x)?, Points::read("local", "to", to)?);
    let name = from.array.name;
    if name != to.array.name {
        let message = format!("expected a {name}, got a {}", to.array.name);
        return Err(errors::argument("local", "to", message));
    }
    let (rows, dim) = (common_rows("local", &[from.rows(), to.rows()])?, dimension(name));
    let mut deltas = Vec::with_capacity(dim * rows.unwrap_or(1));
    for row in 0..rows.unwrap_or(1) {
        let delta = from.row(row).zip(to.row(row)).and_then(|(x, y)| x.erased().local(&**y));
        deltas.extend(delta.ok_or_else(|| errors::internal("local"))?);
    }
    let shape: Vec<_> = rows.into_iter().chain([dim]).collect();
    to_array(x.py(), &shape, deltas)
}

pub(super) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(retract, module)?)?;
    module.add_function(wrap_pyfunction!(local, module)?)
}
