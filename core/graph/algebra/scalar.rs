//! Scalars of residuals: `f64`, or a dual number that carries a derivative.
use crate::algebra::Dimension;
use nalgebra::{RealField, SMatrix, SVector};
use num_dual::{Derivative, DualNum, DualSVec64};

/// A real number that residuals can be differentiated through.
///
/// `x * 2.0` works, `2.0 * x` does not; lift constants with [`Lift::lift`] or `T::from(c)`. Comparisons,
/// `max` and `clamp` use the real part only.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a scalar that residuals can be differentiated through",
    note = "write residuals over `T: Scalar`; lift constants with `T::from(c)` or `.lift()`"
)]
pub trait Scalar: RealField + Copy + DualNum<Primitive = f64> {}
impl<T: RealField + Copy + DualNum<Primitive = f64>> Scalar for T {}

/// Returns |x|. At x = 0 the derivative is 1, as for x > 0.
#[inline(always)]
pub fn abs<T: Scalar>(x: T) -> T {
    if x < T::zero() { -x } else { x }
}

/// A dual number with a derivative part that can be written and read.
pub trait Jet: Scalar {
    /// Makes a value with its gradient; `gradient` has one entry for each direction of the jet.
    fn with_gradient(value: f64, gradient: &[f64]) -> Self;
    /// Returns the gradient; `None` stands for zero, since num-dual drops the derivative part of constants.
    fn gradient(&self) -> Option<&[f64]>;
}

impl<const N: usize> Jet for DualSVec64<N> {
    #[inline(always)]
    fn with_gradient(value: f64, gradient: &[f64]) -> Self {
        DualSVec64::new(value, Derivative::some(SVector::from_column_slice(gradient)))
    }
    #[inline(always)]
    fn gradient(&self) -> Option<&[f64]> {
        self.eps.0.as_ref().map(|e| e.as_slice())
    }
}

/// The jet with one direction for each tangent direction of `D`.
pub type JetOf<D> = <D as Dimension>::Jet;

/// Constants that can be lifted to a scalar type.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be lifted to the scalar of a residual",
    note = "numbers, nalgebra's vectors and matrices, `Direction` and the manifolds can; for another type write `impl Lift for {Self}`"
)]
pub trait Lift {
    /// The lifted type over `T`.
    type Of<T: Scalar>;
    /// Returns the value over `T`, with derivative zero.
    fn lift<T: Scalar>(&self) -> Self::Of<T>;
}

impl Lift for f64 {
    type Of<T: Scalar> = T;
    #[inline(always)]
    fn lift<T: Scalar>(&self) -> T {
        T::from(*self)
    }
}

impl<const R: usize, const C: usize> Lift for SMatrix<f64, R, C> {
    type Of<T: Scalar> = SMatrix<T, R, C>;
    #[inline(always)]
    fn lift<T: Scalar>(&self) -> SMatrix<T, R, C> {
        self.map(T::from)
    }
}
