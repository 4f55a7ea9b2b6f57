//! Linear systems of steps: structure, settings and solution methods.
mod block_system;
pub(crate) mod cholesky;
mod conjugate_gradients;
mod elimination;
pub(crate) mod layout;
pub(crate) mod memory;
pub(crate) mod ordering;
mod qr;
pub(crate) mod settings;
pub(crate) mod system;

pub use block_system::{BlockSystem, BlockSystemError};
pub(crate) use cholesky::Cholesky;
pub(crate) use conjugate_gradients::{ConjugateGradients, Damped};
pub(crate) use qr::Qr;

/// The error for a matrix that is not positive definite, as far as f64 can tell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NotPositiveDefinite;

/// A linear system with one of the methods.
#[derive(Debug)]
pub(crate) enum Method {
    Cholesky(Cholesky),
    Qr(Qr),
    ConjugateGradients(ConjugateGradients),
}
