//! The registered type has no residual.
#![allow(unused_imports)]
#[path = "toy/number.rs"]
mod number;

use manifactor_graph::{Graph, Lifted, Residual, Scalar, register_factor};
use nalgebra::{U1, U2, Vector1};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use number::Number;

#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
struct IsAt {
    place: f64,
}

register_factor!("is_at", IsAt);

fn main() {}
