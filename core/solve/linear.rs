//! Sparse linear algebra; knows no manifold.
mod cholesky;
pub(crate) use cholesky::{Cholesky, NotPositiveDefinite};
