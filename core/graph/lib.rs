//! Factor graphs: what a variable is, what a factor is, and how the two are named and stored.
//!
//! Two views of one graph. *Dynamic, for people*: [`Graph`] and [`Values`] hold trait objects by
//! [`Key`], from Rust or from documents. *Columnar, for the machine*: [`batch::Batch`] and
//! [`column::Column`] hold each concrete type contiguously; the loop over them is monomorphised
//! where a type is registered.
//!
//! The way in for authors is [`Residual`]; for new types of variables, [`Manifold`].
mod algebra;
mod factor;
mod graph;
pub mod loss;
pub mod noise;
pub mod prelude;
pub mod quantity;
mod registry;
mod residual;
mod variable;

pub use algebra::{
    Block, Dimension, Direction, Jet, JetOf, Lift, Matrix, NoDirection, Scalar, Up, Vector, abs,
};
pub use factor::{Dynamic, DynamicBlocks, DynamicResidual, MAX_ROWS, WrongRows, batch, invariance};
pub use factor::{ErasedResidual, Factor, FactorEntry, Linearization, signature};
pub use graph::{Fixed, Graph, GraphError, Resolved, VariableIndices, Version};
pub use manifactor_document::TextError;
pub use noise::Noise;
pub use registry::{catalogue, checked};
pub use residual::{Jacobians, Lifted, List, Many, Refs, Residual, Variables, normal_equations};
pub use variable::{AsVariable, ErasedManifold, Variable, as_variable, column, manifold_name};
pub use variable::{Key, Manifold, Tangent, ValueError, Values};

#[doc(hidden)]
pub mod __private {
    pub use {inventory, manifactor_document, schemars, serde, typetag};
}
