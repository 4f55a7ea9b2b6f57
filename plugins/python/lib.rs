//! Manifactor for Python: the native part of the package `manifactor`.
//!
//! Registered types cross the boundary as in documents, by type and fields; arrays of numbers cross it as
//! NumPy arrays. Type hints, documentation and display are written in Python, in the folder `manifactor`
//! next to this file.
// this crate reads untrusted input, so no index may be taken for granted
#![warn(clippy::indexing_slicing)]
#![allow(clippy::needless_pass_by_value, reason = "arguments of functions that Python calls are owned")]
mod algebra;
mod batch;
mod catalogue;
mod chosen;
mod errors;
mod graph;
mod input;
mod log;
mod raised;
mod runs;
mod smoother;
mod solution;
mod threads;

use pyo3::prelude::*;

/// The native items that the Python modules of the package use.
#[pymodule(gil_used = true)]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<chosen::Chosen>()?;
    module.add_class::<graph::Noise>()?;
    module.add_class::<graph::Graph>()?;
    module.add_class::<graph::Values>()?;
    module.add_class::<solution::Solution>()?;
    module.add_class::<smoother::Smoother>()?;
    module.add_class::<smoother::FactorId>()?;
    catalogue::register(module)?;
    chosen::register(module)?;
    algebra::register(module)?;
    graph::register(module)?;
    solution::register(module)?;
    runs::register(module)?;
    batch::register(module)?;
    log::register(module)
}
