//! Scalars (numbers or dual numbers) and matrix blocks with compile-time dimensions.
mod dimension;
mod direction;
mod scalar;

pub use dimension::{Block, Dimension, Matrix, Vector};
pub use direction::{Direction, NoDirection, Up};
pub use scalar::{Jet, JetOf, Lift, Scalar, abs};
