//! Manifactor for Python: the native half of the package `manifactor`.
//!
//! What can be chosen by name crosses the border as it stands in documents, by its type and its fields; arrays of numbers
//! as arrays of numpy. What is typed, documented or shown is written in Python, in the folder `manifactor` beside this file.
// strangers' input comes in here: no place of it is taken for granted
#![warn(clippy::indexing_slicing)]
#![allow(clippy::needless_pass_by_value, reason = "arguments of functions that Python calls are owned")]
mod batch;
mod catalogue;
mod chosen;
mod errors;
mod graph;
mod input;
mod log;
mod raised;
mod runs;
mod session;
mod solution;
mod threads;

use pyo3::prelude::*;

/// What the Python modules of the package are made of.
#[pymodule(gil_used = true)]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<chosen::Chosen>()?;
    module.add_class::<graph::Noise>()?;
    module.add_class::<graph::Graph>()?;
    module.add_class::<graph::Values>()?;
    module.add_class::<solution::Solution>()?;
    module.add_class::<session::Session>()?;
    module.add_class::<session::FactorId>()?;
    catalogue::register(module)?;
    chosen::register(module)?;
    graph::register(module)?;
    solution::register(module)?;
    runs::register(module)?;
    batch::register(module)?;
    log::register(module)
}
