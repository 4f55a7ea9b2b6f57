//! Factor graphs: what a variable is, what a factor is, and how the two are named and stored.
//!
//! Two views of one graph. *Dynamic, for people*: [`Graph`] and [`Values`] hold trait objects by
//! [`Key`], from Rust or from documents. *Columnar, for the machine*: [`batch::Batch`] and
//! [`column::Column`] hold each concrete type contiguously; the loop over them is monomorphised
//! where a type is registered.
//!
//! The way in for authors is [`Residual`]; for new types of variables, [`Manifold`].
pub mod batch;
pub mod catalogue;
pub mod checked;
pub mod column;
mod dimension;
mod direction;
mod dynamic;
mod factor;
mod graph;
pub mod invariance;
mod kernel;
mod key;
pub mod loss;
mod manifold;
mod many;
pub mod noise;
pub mod normal_equations;
pub mod quantity;
mod registered;
mod residual;
mod scalar;
mod values;
mod variable;
mod variables;
mod version;

pub use dimension::{Block, Dimension, Matrix, Vector};
pub use direction::{Direction, NoDirection};
pub use dynamic::{Dynamic, DynamicBlocks, DynamicResidual, MAX_ROWS, WrongRows};
pub use factor::{ErasedResidual, Factor, FactorEntry, Linearization, signature};
pub use graph::{Fixed, Graph, GraphError, Resolved, VariableIndices};
pub use key::Key;
pub use manifactor_tree::TextError;
pub use manifold::{Manifold, Tangent};
pub use many::{List, Many};
pub use noise::Noise;
pub use residual::{Jacobians, Lifted, Refs, Residual};
pub use scalar::{Jet, JetOf, Lift, Scalar};
pub use values::{ValueError, Values};
pub use variable::{AsVariable, ErasedManifold, Variable, as_variable};
pub use variables::Variables;
pub use version::Version;

#[doc(hidden)]
pub mod __private {
    pub use {inventory, manifactor_tree, schemars, serde, typetag};
}
