//! Scalars that are numbers or dual numbers, and blocks whose dimensions are known when they are compiled.
mod dimension;
mod direction;
mod scalar;

pub use dimension::{Block, Dimension, Matrix, Vector};
pub use direction::{Direction, NoDirection, Up};
pub use scalar::{Jet, JetOf, Lift, Scalar, abs};
