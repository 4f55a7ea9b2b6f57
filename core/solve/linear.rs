//! Sparse linear algebra; knows no manifold.
mod cholesky;
pub(crate) mod elimination;
mod inverse;
mod kernel;
pub(crate) mod ordering;
pub(crate) mod structure;
pub(crate) use cholesky::{Cholesky, NotPositiveDefinite};
