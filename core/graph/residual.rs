//! The trait for authors of factors: a residual as a function of its variables.
mod many;
pub mod normal_equations;
mod variables;

use crate::algebra::Scalar;
use crate::algebra::{Dimension, Vector};
use std::fmt::Debug;

pub use many::{List, Many};
pub use variables::Variables;

/// The variables `V` over the scalar `T`: the argument of [`Residual::residual`].
pub type Lifted<V, T> = <V as Variables>::Lifted<T>;
/// The variables `V`, by reference.
pub type Refs<'a, V> = <V as Variables>::Refs<'a>;
/// One Jacobian block for each variable of `R`, residual rows × tangent directions.
pub type Jacobians<R> = <<R as Residual>::Variables as Variables>::Jacobians<<R as Residual>::Dim>;

/// A residual, written once over any [`Scalar`]. It is all that the author of a factor has to write.
///
/// Keys, noise and loss belong to the instance in a [`Graph`](crate::Graph), not to the residual. Register
/// it with [`register_factor!`](crate::register_factor) to use it by name.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a residual",
    note = "implement `Residual` for `{Self}`: `type Variables`, `type Dim` and `fn residual`"
)]
pub trait Residual: Debug + Clone + Send + Sync + 'static {
    /// Manifolds of its variables: `(A,)`, `(A, B)`, … up to six, or [`Many<A>`](crate::Many).
    type Variables: Variables;
    /// Number of rows: `U1`, `U2`, …
    type Dim: Dimension;
    /// A name for each row, for messages. Default: none.
    const ROWS: &'static [&'static str] = &[];

    /// Returns the unwhitened residual.
    fn residual<T: Scalar>(&self, variables: Lifted<Self::Variables, T>) -> Vector<Self::Dim, T>;

    /// Returns whether the residual is defined at this point. For example, an object behind a camera has no
    /// box.
    ///
    /// A factor that is undefined at a linearization is excluded from that step. Solvers with step control
    /// reject a step that would make a defined factor undefined.
    fn is_defined(&self, _variables: Refs<'_, Self::Variables>) -> bool {
        true
    }

    /// Returns the residual, and writes the Jacobian blocks of the variables that are `free`.
    ///
    /// Override it for an analytic Jacobian. The blocks hold garbage on entry, so write every entry.
    fn linearize(
        &self,
        variables: Refs<'_, Self::Variables>,
        free: &[bool],
        jacobians: &mut Jacobians<Self>,
    ) -> Vector<Self::Dim> {
        Self::Variables::autodiff(self, variables, free, jacobians)
    }
}
