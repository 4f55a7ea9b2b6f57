//! Compile-time sizes, and the vector, matrix and jet types of each size.
use crate::algebra::{Jet, Scalar};
use nalgebra::{Const, SMatrix, SVector};
use num_dual::DualSVec64;
use std::fmt::Debug;

/// A dense array of compile-time size, column-major.
pub trait Block: Copy + Debug + Send + Sync + 'static {
    /// Returns the array with all entries zero.
    fn zeros() -> Self;
    /// Returns the entries, column after column.
    fn as_slice(&self) -> &[f64];
    /// Returns the entries for writing, column after column.
    fn as_mut_slice(&mut self) -> &mut [f64];
}

impl<const R: usize, const C: usize> Block for SMatrix<f64, R, C> {
    #[inline(always)]
    fn zeros() -> Self {
        SMatrix::zeros()
    }
    #[inline(always)]
    fn as_slice(&self) -> &[f64] {
        SMatrix::as_slice(self)
    }
    #[inline(always)]
    fn as_mut_slice(&mut self) -> &mut [f64] {
        SMatrix::as_mut_slice(self)
    }
}

/// `U1`, `U2`, …: a dimension, with the vectors, matrices and jets of that size.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a number of rows or directions",
    note = "write nalgebra's type for it: `type Dim = U1;`, `U2`, `U3`, …"
)]
pub trait Dimension: Debug + Send + Sync + 'static {
    /// The number.
    const N: usize;
    /// A dual number with `N` directions.
    type Jet: Jet;
    /// A column of `N` scalars: nalgebra's `SVector<T, N>`.
    type Vector<T: Scalar>: AsRef<[T]> + Copy + Debug + Send + Sync;
    /// An `N` × `C` matrix: nalgebra's `SMatrix<f64, N, C>`, found through [`Dimension::Rows`].
    type Matrix<C: Dimension>: Block;
    /// `SMatrix<f64, R, N>`: the second step of the double dispatch in [`Dimension::Matrix`].
    type Rows<const R: usize>: Block;
    /// Returns the vector of `f(0), f(1), …`.
    fn vector<T: Scalar>(f: impl FnMut(usize) -> T) -> Self::Vector<T>;
}

impl<const N: usize> Dimension for Const<N> {
    const N: usize = N;
    type Jet = DualSVec64<N>;
    type Vector<T: Scalar> = SVector<T, N>;
    type Matrix<C: Dimension> = C::Rows<N>;
    type Rows<const R: usize> = SMatrix<f64, R, N>;
    #[inline(always)]
    fn vector<T: Scalar>(mut f: impl FnMut(usize) -> T) -> SVector<T, N> {
        SVector::from_fn(|i, _| f(i))
    }
}

/// A column of `D::N` scalars.
pub type Vector<D, T = f64> = <D as Dimension>::Vector<T>;
/// An `R::N` × `C::N` matrix, column-major.
pub type Matrix<R, C> = <R as Dimension>::Matrix<C>;
