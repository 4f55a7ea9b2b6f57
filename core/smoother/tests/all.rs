//! The incremental smoother, compared with a new build.
#![allow(missing_docs, clippy::unwrap_used)]
mod clocks;
mod errors;
mod failures;
mod history;
mod idle;
mod outliers;
mod saving;
mod steps;
#[path = "../../solve/tests/toy/mod.rs"]
mod toy;
mod undetermined;
mod windows;
mod world;
