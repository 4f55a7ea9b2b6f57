//! Residuals whose number of rows and variable types are known only at run time.
use crate::algebra::{Dimension, Vector};
use crate::factor::batch::{Batch, BatchOf};
use crate::factor::kernel::Kernel;
use crate::factor::{ErasedResidual, Linearization};
use crate::loss::Loss;
use crate::noise::Whitener;
use crate::registry::catalogue::Signature;
use crate::residual::List;
use crate::residual::normal_equations::{NormalEquations, Places};
use crate::variable::Variable;
use crate::variable::column::Columns;
use nalgebra::{Const, DMatrix};
use smallvec::SmallVec;
use std::any::{Any, TypeId};
use std::fmt::Debug;

/// Largest number of rows of a [`DynamicResidual`]. Its loops are compiled for each number of rows up to
/// nine, and for some above. Sizes in between are padded with rows of zeros.
pub const MAX_ROWS: usize = 48;

/// A residual that gives its number of rows and the types of its variables at run time.
///
/// If the types are known at compile time, implement [`Residual`](crate::Residual): the compiler checks it,
/// and it is faster. A factor type holds a [`Dynamic`] of its residual and returns it from
/// [`Factor::erased`](crate::Factor::erased).
pub trait DynamicResidual: Debug + Clone + Send + Sync + 'static {
    /// Returns the number of rows, 1 to [`MAX_ROWS`].
    fn rows(&self) -> usize;
    /// Returns the types of its variables, in order.
    fn variables(&self) -> &[TypeId];
    /// Returns the tangent dimensions of its variables, in order.
    fn dimensions(&self) -> &[usize];
    /// Returns whether the residual is defined at this point; see
    /// [`Residual::is_defined`](crate::Residual::is_defined).
    fn is_defined(&self, _variables: &[&dyn Any]) -> bool {
        true
    }
    /// Writes the unwhitened residual. Variables have the types given by [`DynamicResidual::variables`].
    fn residual(&self, variables: &[&dyn Any], residual: &mut [f64]);
    /// Writes the residual and the blocks of the variables that are `free`. The blocks hold garbage on
    /// entry.
    fn linearize(
        &self,
        variables: &[&dyn Any],
        free: &[bool],
        residual: &mut [f64],
        blocks: &mut DynamicBlocks,
    );
}

/// Jacobian blocks of one factor, with run-time sizes. Up to 64 entries need no allocation.
#[derive(Debug, Clone, Default)]
pub struct DynamicBlocks {
    values: SmallVec<[f64; 64]>,
    ends: List<usize>,
}

impl DynamicBlocks {
    fn resize(&mut self, rows: usize, dimensions: &[usize]) {
        let mut end = 0;
        self.ends.clear();
        self.ends.extend(dimensions.iter().map(|dimension| {
            end += rows * dimension;
            end
        }));
        self.values.resize(end, 0.0);
    }
    /// Appends zeros below the rows of each column.
    fn pad(&mut self, rows: usize, to: usize) {
        let columns = self.values.len() / rows;
        self.values.resize(columns * to, 0.0);
        // from the last column on, so that no column is overwritten before it has moved
        for column in (0..columns).rev() {
            self.values.copy_within(column * rows..(column + 1) * rows, column * to);
            self.values[column * to + rows..(column + 1) * to].fill(0.0);
        }
        self.ends.iter_mut().for_each(|end| *end = *end / rows * to);
    }
    fn range(&self, variable: usize) -> std::ops::Range<usize> {
        let first = if variable == 0 { 0 } else { self.ends[variable - 1] };
        first..self.ends[variable]
    }
    fn block(&self, variable: usize) -> &[f64] {
        &self.values[self.range(variable)]
    }
    /// Returns the block of a variable: rows × tangent dimension, column-major.
    pub fn block_mut(&mut self, variable: usize) -> &mut [f64] {
        let range = self.range(variable);
        &mut self.values[range]
    }
}

/// A [`DynamicResidual`], in the form that [`Factor::erased`](crate::Factor::erased) returns.
#[derive(Debug, Clone)]
pub struct Dynamic<F>(F);

/// The error for a number of rows outside 1 to [`MAX_ROWS`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "expected a residual of 1 to {MAX_ROWS} rows, got {0}; a longer one can be split over several factors"
)]
pub struct WrongRows(pub usize);

impl<F: DynamicResidual> Dynamic<F> {
    /// Wraps a residual.
    ///
    /// # Errors
    /// If it has no rows, or more than [`MAX_ROWS`].
    pub fn new(residual: F) -> Result<Self, WrongRows> {
        let rows = residual.rows();
        if (1..=MAX_ROWS).contains(&rows) { Ok(Self(residual)) } else { Err(WrongRows(rows)) }
    }
    /// Returns the residual.
    pub fn get(&self) -> &F {
        &self.0
    }
}

/// Calls `$call` with the number of rows as a constant, rounded up to the next compiled size.
macro_rules! with_rows {
    ($rows:expr, $n:ident => $call:expr) => {
        with_rows!(@arms $rows, $n => $call, 2=2 3=3 4=4 5=5 6=6 7=7 8=8 9=9 10=12 13=16 17=24 25=48)
    };
    (@arms $rows:expr, $n:ident => $call:expr, $($first:literal = $last:literal)+) => {
        match $rows {
            $($first..=$last => { const $n: usize = $last; $call })+
            _ => { const $n: usize = 1; $call }
        }
    };
}

impl<F: DynamicResidual> ErasedResidual for Dynamic<F> {
    fn as_any(&self) -> &dyn Any {
        &self.0
    }
    fn type_id(&self) -> TypeId {
        with_rows!(self.0.rows(), N => TypeId::of::<Rows<F, N>>())
    }
    fn signature(&self) -> Signature {
        let variables = self.0.variables().to_vec();
        Signature { rows: Some(self.0.rows()), row_names: &[], variables, many: false, tangent: &[] }
    }
    fn new_batch(&self, noise: &Whitener, loss: Option<&dyn Loss>) -> Box<dyn Batch> {
        with_rows!(self.0.rows(), N => Box::new(BatchOf::<Rows<F, N>>::new(noise, loss)))
    }
    fn residual(&self, variables: &[&dyn Variable]) -> Option<Vec<f64>> {
        let mut residual = vec![0.0; self.0.rows()];
        self.0.residual(&self.fit(variables)?, &mut residual);
        Some(residual)
    }
    fn is_defined(&self, variables: &[&dyn Variable]) -> Option<bool> {
        Some(self.0.is_defined(&self.fit(variables)?))
    }
    fn linearize(&self, variables: &[&dyn Variable]) -> Option<Linearization> {
        let (rows, mut blocks) = (self.0.rows(), DynamicBlocks::default());
        blocks.resize(rows, self.0.dimensions());
        blocks.values.fill(f64::NAN);
        let mut residual = vec![0.0; rows];
        self.0.linearize(&self.fit(variables)?, &vec![true; variables.len()], &mut residual, &mut blocks);
        let block = |i| DMatrix::from_column_slice(rows, self.0.dimensions()[i], blocks.block(i));
        Some(Linearization { residual, jacobians: (0..variables.len()).map(block).collect() })
    }
    fn autodiff(&self, variables: &[&dyn Variable]) -> Option<Linearization> {
        ErasedResidual::linearize(self, variables)
    }
}

impl<F: DynamicResidual> Dynamic<F> {
    /// Returns the concrete values of the variables; `None` if their number or types do not fit.
    fn fit<'a>(&self, variables: &[&'a dyn Variable]) -> Option<Vec<&'a dyn Any>> {
        let types = self.0.variables();
        (types.len() == variables.len()).then_some(())?;
        let fit = |(v, id): (&&'a dyn Variable, &TypeId)| {
            (v.erased().type_id() == *id).then(|| v.erased().as_any())
        };
        variables.iter().zip(types).map(fit).collect()
    }
}

/// A [`DynamicResidual`] of up to `N` rows in a batch. Rows beyond its own are zero.
#[derive(Clone)]
struct Rows<F, const N: usize>(F);

impl<F: DynamicResidual, const N: usize> Kernel for Rows<F, N> {
    type Dim = Const<N>;
    type Columns<'a> = &'a Columns;
    type Refs<'a> = List<&'a dyn Any>;
    type Blocks = DynamicBlocks;

    fn of(factor: &dyn Any) -> Option<Self> {
        factor.downcast_ref::<F>().cloned().map(Self)
    }
    fn columns(columns: &Columns) -> &Columns {
        columns
    }
    fn load<'a>(&self, columns: Self::Columns<'a>, index: &[u32]) -> Self::Refs<'a> {
        let types = self.0.variables().iter();
        types.zip(index).filter_map(|(id, i)| columns.value(*id, *i as usize)).collect()
    }
    fn is_defined(&self, x: List<&dyn Any>) -> bool {
        self.0.is_defined(&x)
    }
    fn rows(&self) -> usize {
        self.0.rows()
    }
    fn value(&self, x: &List<&dyn Any>) -> Vector<Const<N>> {
        let mut residual = <Const<N> as Dimension>::vector(|_| 0.0);
        self.0.residual(x, &mut residual.as_mut_slice()[..self.0.rows()]);
        residual
    }
    fn blocks() -> DynamicBlocks {
        DynamicBlocks::default()
    }
    fn linearize(&self, x: List<&dyn Any>, free: &[bool], blocks: &mut DynamicBlocks) -> Vector<Const<N>> {
        let rows = self.0.rows();
        blocks.resize(rows, self.0.dimensions());
        let mut residual = <Const<N> as Dimension>::vector(|_| 0.0);
        self.0.linearize(&x, free, &mut residual.as_mut_slice()[..rows], blocks);
        if rows < N {
            blocks.pad(rows, N);
        }
        residual
    }
    fn each(blocks: &mut DynamicBlocks, mut visit: impl FnMut(usize, &mut [f64])) {
        (0..blocks.ends.len()).for_each(|i| visit(i, blocks.block_mut(i)));
    }
    fn scatter(blocks: &DynamicBlocks, r: &[f64], w: f64, places: Places<'_>, to: &mut NormalEquations<'_>) {
        for a in 0..blocks.ends.len() {
            to.add_dynamic::<N>(places, a, |i| blocks.block(i), r, w);
        }
    }
}
