//! The interface of a batch to its residual: access to variables, and to slots in the normal equations.
use crate::algebra::{Dimension, Vector};
use crate::residual::Residual;
use crate::residual::Variables;
use crate::residual::normal_equations::{NormalEquations, Places};
use crate::variable::column::Columns;
use std::any::Any;

/// Implemented for every [`Residual`], and for [`DynamicResidual`](crate::DynamicResidual)s by number of
/// rows.
pub(crate) trait Kernel: Clone + Send + Sync + 'static {
    /// Number of rows.
    type Dim: Dimension;
    /// The columns of its variables.
    type Columns<'a>: Copy + Send + Sync;
    /// The variables of one factor, by reference.
    type Refs<'a>: Clone;
    /// The Jacobian blocks of one factor.
    type Blocks: Clone + Send + Sync;

    /// Returns a copy of a factor of this type; `None` for any other type.
    fn of(factor: &dyn Any) -> Option<Self>;
    /// Returns the residual; `None` if a new value may change the number of rows.
    fn residual_mut(&mut self) -> Option<&mut dyn Any> {
        None
    }
    fn columns(columns: &Columns) -> Self::Columns<'_>;
    /// Returns the number of rows of the residual. Rows beyond them are zero.
    fn rows(&self) -> usize {
        Self::Dim::N
    }
    /// Returns the variables at these indices of their columns.
    fn load<'a>(&self, columns: Self::Columns<'a>, index: &[u32]) -> Self::Refs<'a>;
    fn is_defined(&self, x: Self::Refs<'_>) -> bool;
    fn value(&self, x: &Self::Refs<'_>) -> Vector<Self::Dim>;
    /// Returns blocks for [`Kernel::linearize`] to write.
    fn blocks() -> Self::Blocks;
    fn linearize(&self, x: Self::Refs<'_>, free: &[bool], blocks: &mut Self::Blocks) -> Vector<Self::Dim>;
    /// Visits each block.
    fn each(blocks: &mut Self::Blocks, visit: impl FnMut(usize, &mut [f64]));
    /// Adds w JᵀJ to H and w Jᵀr to g.
    fn scatter(blocks: &Self::Blocks, r: &[f64], w: f64, places: Places<'_>, to: &mut NormalEquations<'_>);
}

impl<F: Residual> Kernel for F {
    type Dim = F::Dim;
    type Columns<'a> = <F::Variables as Variables>::Columns<'a>;
    type Refs<'a> = <F::Variables as Variables>::Refs<'a>;
    type Blocks = <F::Variables as Variables>::Jacobians<F::Dim>;

    fn of(factor: &dyn Any) -> Option<Self> {
        factor.downcast_ref::<F>().cloned()
    }
    fn residual_mut(&mut self) -> Option<&mut dyn Any> {
        Some(self)
    }
    fn columns(columns: &Columns) -> Self::Columns<'_> {
        F::Variables::columns(columns)
    }
    #[inline(always)]
    fn load<'a>(&self, columns: Self::Columns<'a>, index: &[u32]) -> Self::Refs<'a> {
        F::Variables::load(columns, index)
    }
    #[inline(always)]
    fn is_defined(&self, x: Self::Refs<'_>) -> bool {
        Residual::is_defined(self, x)
    }
    #[inline(always)]
    fn value(&self, x: &Self::Refs<'_>) -> Vector<F::Dim> {
        self.residual::<f64>(F::Variables::lift(x))
    }
    #[inline(always)]
    fn blocks() -> Self::Blocks {
        F::Variables::blocks::<F::Dim>(0)
    }
    #[inline(always)]
    fn linearize(&self, x: Self::Refs<'_>, free: &[bool], blocks: &mut Self::Blocks) -> Vector<F::Dim> {
        F::Variables::resize::<F::Dim>(blocks, free.len());
        Residual::linearize(self, x, free, blocks)
    }
    #[inline(always)]
    fn each(blocks: &mut Self::Blocks, visit: impl FnMut(usize, &mut [f64])) {
        F::Variables::each::<F::Dim>(blocks, visit);
    }
    #[inline(always)]
    fn scatter(blocks: &Self::Blocks, r: &[f64], w: f64, places: Places<'_>, to: &mut NormalEquations<'_>) {
        F::Variables::scatter::<F::Dim>(blocks, r, w, places, to);
    }
}
