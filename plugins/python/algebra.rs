//! Arithmetic with values: arrays of values, functions of formulas, steps on manifolds, and groups.
mod array;
mod call;
mod groups;
mod steps;

pub(crate) use array::ValueArray;

use pyo3::prelude::*;

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<ValueArray>()?;
    array::register(module)?;
    call::register(module)?;
    groups::register(module)?;
    steps::register(module)
}
