//! Imports for a file with a factor, a manifold or a loss: `use manifactor_graph::prelude::*;`. Outside of
//! this repository use `manifactor::prelude`, which also has the solvers.
pub use crate::__private::typetag;
pub use crate::checked::Positive;
pub use crate::loss::{Loss, RobustLoss};
pub use crate::quantity::Quantity;
pub use crate::{
    Dimension, Direction, Factor, Graph, Jacobians, Jet, JetOf, Key, Lift, Lifted, Manifold, Many, Noise,
    Refs, Residual, Scalar, Tangent, Unnamed, Up, Values, Variable, Variables, Vector, abs,
};
pub use crate::{
    register, register_factor, register_functions, register_invariance, register_loss, register_manifold,
    register_quantity,
};
pub use nalgebra::{
    Matrix2, Matrix3, Matrix4, U1, U2, U3, U4, U5, U6, U7, U8, U9, Vector1, Vector2, Vector3, Vector4,
    Vector5, Vector6,
};
pub use schemars::JsonSchema;
pub use serde::{Deserialize, Serialize};
