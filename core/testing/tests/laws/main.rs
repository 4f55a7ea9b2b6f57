//! Tests on toy variables and factors: the laws find each flaw, and the graph core keeps its contracts.
#![allow(clippy::unwrap_used, reason = "helpers of tests may panic too")]
mod batch;
mod dynamic;
mod factors;
mod manifolds;
mod noise;
mod toy;
