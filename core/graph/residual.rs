//! The author's trait: a residual as a function of its variables.
mod many;
pub mod normal_equations;
mod variables;

use crate::algebra::Scalar;
use crate::algebra::{Dimension, Vector};
use std::fmt::Debug;

pub use many::{List, Many};
pub use variables::Variables;

/// The variables `V` over the scalar `T`: what [`Residual::residual`] gets.
pub type Lifted<V, T> = <V as Variables>::Lifted<T>;
/// The variables `V`, by reference.
pub type Refs<'a, V> = <V as Variables>::Refs<'a>;
/// One Jacobian block for each variable of `R`, rows by tangent directions.
pub type Jacobians<R> = <<R as Residual>::Variables as Variables>::Jacobians<<R as Residual>::Dim>;

/// A residual, written once over any [`Scalar`]; all that an author of a factor has to write.
///
/// Keys, noise and loss belong to the instance in a [`Graph`](crate::Graph), not to the residual.
/// Register it with [`register_factor!`](crate::register_factor) to use it by name.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a residual",
    note = "implement `Residual` for `{Self}`: `type Variables`, `type Dim` and `fn residual`"
)]
pub trait Residual: Debug + Clone + Send + Sync + 'static {
    /// Manifolds that it depends on: `(A,)`, `(A, B)`, … up to six, or [`Many<A>`](crate::Many).
    type Variables: Variables;
    /// Number of rows: `U1`, `U2`, …
    type Dim: Dimension;
    /// A name for each row, for messages. Default: none.
    const ROWS: &'static [&'static str] = &[];

    /// The residual, not whitened.
    fn residual<T: Scalar>(&self, variables: Lifted<Self::Variables, T>) -> Vector<Self::Dim, T>;

    /// Returns whether the residual means anything at this point; an object behind a camera has no box.
    ///
    /// A factor that is not defined where a problem is linearized takes no part in that step; a
    /// step that would make a defined factor undefined is refused by solvers with step control.
    fn is_defined(&self, _variables: Refs<'_, Self::Variables>) -> bool {
        true
    }

    /// The residual, and the Jacobian blocks of the variables that are `free`.
    ///
    /// Override for an analytic Jacobian; the blocks hold garbage on entry, so write them whole.
    fn linearize(
        &self,
        variables: Refs<'_, Self::Variables>,
        free: &[bool],
        jacobians: &mut Jacobians<Self>,
    ) -> Vector<Self::Dim> {
        Self::Variables::autodiff(self, variables, free, jacobians)
    }
}
