//! The laws find what is broken, and the graph core keeps its word, on toy variables and factors.
#![allow(clippy::unwrap_used, reason = "helpers of tests may panic too")]
mod batch;
mod dynamic;
mod factors;
mod manifolds;
mod noise;
mod toy;
