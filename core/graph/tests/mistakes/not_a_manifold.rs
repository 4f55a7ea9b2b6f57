//! f64 is not a variable.
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

impl Residual for IsAt {
    type Variables = (f64,);
    type Dim = U1;

    fn residual<T: Scalar>(&self, (x,): Lifted<Self::Variables, T>) -> Vector1<T> {
        Vector1::new(x - self.place)
    }
}
register_factor!("is_at", IsAt);

fn main() {}
