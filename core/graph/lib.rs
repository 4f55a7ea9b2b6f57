//! Factor graphs: variables, factors, their names and their storage.
//!
//! A graph has two views. The *dynamic* view is for people: [`Graph`] and [`Values`] hold trait objects by
//! [`Key`], from Rust or from documents. The *columnar* view is for the machine: [`batch::Batch`] and
//! [`column::Column`] store each concrete type contiguously. The loop over them is monomorphised at the
//! registration of a type.
//!
//! Authors of factors begin with [`Residual`], authors of variable types with [`Manifold`].
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
pub use factor::{ErasedResidual, Factor, FactorEntry, Linearization, Unnamed, signature};
pub use graph::{Fixed, Graph, GraphError, Resolved, VariableIndices, Version};
pub use manifactor_document::TextError;
pub use noise::Noise;
pub use registry::{TypeName, UnknownType, catalogue, checked};
pub use residual::{Jacobians, Lifted, List, Many, Refs, Residual, Variables, normal_equations};
pub use variable::{AsVariable, ErasedManifold, Variable, as_variable, column, manifold_name};
pub use variable::{
    Bounds, Interval, IntervalError, Key, Manifold, Motion, OutOfBounds, Tangent, ValueError, Values,
};

#[doc(hidden)]
pub mod __private {
    pub use {inventory, manifactor_document, schemars, serde, typetag};
}
