//! Smooth manifolds: the types that variables of a graph have.
use crate::algebra::{Dimension, Vector};
use crate::algebra::{JetOf, Scalar};
use std::fmt::Debug;

/// A smooth manifold with a chart around each of its points.
///
/// `retract(x, δ)` maps a tangent vector at `x` to a point, `local` is its inverse:
/// `x.retract(&x.local(&y)) == y`, and `x.retract(&0) == x`.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be a variable: it is not a `Manifold`",
    label = "not a manifold",
    note = "implement `Manifold` for `{Self}`, or use a registered one such as `Se3`"
)]
pub trait Manifold: Clone + Debug + Send + Sync + 'static {
    /// Dimension of the tangent space, at most 32.
    type Dim: Dimension;
    /// The same point over another scalar; `Of<f64>` need not be `Self`.
    type Of<T: Scalar>;
    /// A name for each tangent direction, in tangent order; what `fixed = [...]` and reports use.
    const TANGENT: &'static [&'static str];

    /// The same point over `T`, with no derivative.
    fn lift<T: Scalar>(&self) -> Self::Of<T>;

    /// `retract(self, δ)` at δ = 0, with its derivative by δ.
    ///
    /// Write the derivative of the chart itself: running the exponential map on duals costs more
    /// and meets its singularity at zero.
    fn seed(&self) -> Self::Of<JetOf<Self::Dim>>;

    /// The point that the tangent vector `delta` leads to.
    fn retract(&self, delta: &Vector<Self::Dim>) -> Self;

    /// The tangent vector that leads to `other`.
    fn local(&self, other: &Self) -> Vector<Self::Dim>;

    /// Returns whether every coordinate is finite.
    fn is_finite(&self) -> bool;
}

/// A tangent vector of `M`.
pub type Tangent<M> = Vector<<M as Manifold>::Dim>;
