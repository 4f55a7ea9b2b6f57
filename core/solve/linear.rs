//! Sparse linear algebra; knows no manifold.
mod cholesky;
pub(crate) mod conjugate_gradients;
mod dense;
pub(crate) mod elimination;
mod inverse;
mod kernel;
mod large;
pub(crate) mod memory;
pub(crate) mod ordering;
mod qr;
pub(crate) mod structure;
mod subtrees;
pub(crate) use cholesky::Cholesky;
pub(crate) use conjugate_gradients::{ConjugateGradients, Damped};
pub(crate) use qr::Qr;

/// The matrix is not positive definite, as far as f64 can tell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NotPositiveDefinite;

/// A linear system by one of the methods.
#[derive(Debug)]
pub(crate) enum Method {
    Cholesky(Cholesky),
    Qr(Qr),
    ConjugateGradients(ConjugateGradients),
}
