//! Constants of a formula.
use manifactor_graph::Variable;
use manifactor_graph::quantity::{Quantity, Shape, variable_quantity};
use nalgebra::{Vector2, Vector3, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A number, a vector of two, three or six numbers, or a value of any variable type with its `type`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, a list of 2, 3 or 6 numbers, or a value with its `type`")]
pub enum Constant {
    /// A number.
    Number(f64),
    /// A vector.
    Vector(Vec<f64>),
    /// A value such as `{ type = "se3", … }`.
    Value(#[schemars(with = "std::collections::BTreeMap<String, serde_json::Value>")] Box<dyn Variable>),
}

impl Constant {
    /// Returns the shape and the flat form, or the expected input as an error message.
    pub(crate) fn flat(&self) -> Result<(Shape, Vec<f64>), String> {
        match self {
            Self::Number(x) => Ok((f64::SHAPE, vec![*x])),
            Self::Vector(v) => match v.len() {
                2 => Ok((Vector2::<f64>::SHAPE, v.clone())),
                3 => Ok((Vector3::<f64>::SHAPE, v.clone())),
                6 => Ok((Vector6::<f64>::SHAPE, v.clone())),
                n => Err(format!("expected a vector of 2, 3 or 6 numbers, found one of {n}")),
            },
            Self::Value(value) => {
                let Some(quantity) = variable_quantity(value.erased().type_id()) else {
                    return Err(format!("formulas know nothing of the type `{}`", value.typetag_name()));
                };
                let mut flat = vec![0.0; quantity.shape.size];
                (quantity.values)(value.erased().as_any(), &mut flat);
                Ok((quantity.shape, flat))
            }
        }
    }
}
