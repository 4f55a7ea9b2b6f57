//! Large fronts: faer's dense kernels, on blocks that threads share.
//!
//! The size of the blocks does not depend on the number of threads, and so neither does the order of the
//! sums.
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{
    LltError, LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

/// Number of columns that are eliminated together, and columns of an update per task.
const COLUMNS: usize = 128;
/// Rows of eliminated columns per task.
const ROWS: usize = 256;

/// Working memory of faer's kernels.
pub struct Scratch(MemBuffer);

impl std::fmt::Debug for Scratch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Scratch({} bytes)", self.0.len())
    }
}

impl Scratch {
    /// Allocates memory for fronts of up to `width` columns.
    pub fn new(width: usize) -> Self {
        let room = cholesky_in_place_scratch::<f64>(width.min(COLUMNS), Par::Seq, Default::default());
        Self(MemBuffer::new(room))
    }
}

/// As [`kernel::eliminate`](crate::linear::cholesky::kernel::eliminate).
pub(super) fn eliminate<const REPLACE: bool>(
    panel: &mut [f64],
    update: &mut [f64],
    width: usize,
    memory: &mut Scratch,
) -> Result<(), usize> {
    let height = panel.len() / width;
    for first in (0..width).step_by(COLUMNS) {
        let n = COLUMNS.min(width - first);
        let (left, block) = panel[..(first + n) * height].split_at_mut(first * height);
        let left = MatRef::from_column_major_slice(left, height, first).split_at_row(first).1;
        let block = MatMut::from_column_major_slice_mut(block, height, n).split_at_row_mut(first).1;
        let (mut top, below) = block.split_at_row_mut(n);
        let (beside_top, beside) = left.split_at_row(n);
        square::<false>(top.as_mut(), beside_top);
        let stack = MemStack::new(&mut memory.0);
        cholesky_in_place(top.as_mut(), LltRegularization::default(), Par::Seq, stack, Default::default())
            .map_err(|LltError::NonPositivePivot { index }| first + index)?;
        let top = top.as_ref();
        let task = |(i, mut rows): (usize, MatMut<'_, f64>)| {
            let beside = beside.subrows(i * ROWS, rows.nrows());
            matmul(rows.as_mut(), Accum::Add, beside, beside_top.transpose(), -1.0, Par::Seq);
            solve_lower_triangular_in_place(top, rows.transpose_mut(), Par::Seq);
        };
        match rayon::current_num_threads() {
            1 => in_turn(below, task),
            _ => below.par_row_chunks_mut(ROWS).enumerate().for_each(task),
        }
    }
    let below = height - width;
    let l = MatRef::from_column_major_slice(panel, height, width).split_at_row(width).1;
    let task = |(i, columns): (usize, &mut [f64])| {
        let first = i * COLUMNS;
        let n = columns.len() / below;
        let columns = MatMut::from_column_major_slice_mut(columns, below, n).split_at_row_mut(first).1;
        let (diagonal, rest) = columns.split_at_row_mut(n);
        let (beside_diagonal, beside) = l.split_at_row(first).1.split_at_row(n);
        square::<REPLACE>(diagonal, beside_diagonal);
        matmul(rest, accumulate::<REPLACE>(), beside, beside_diagonal.transpose(), -1.0, Par::Seq);
    };
    match rayon::current_num_threads() {
        1 => update.chunks_mut(COLUMNS * below.max(1)).enumerate().for_each(task),
        _ => update.par_chunks_mut(COLUMNS * below.max(1)).enumerate().for_each(task),
    }
    Ok(())
}

fn in_turn<'a>(mut rows: MatMut<'a, f64>, task: impl Fn((usize, MatMut<'a, f64>))) {
    for i in 0..rows.nrows().div_ceil(ROWS) {
        let n = ROWS.min(rows.nrows());
        let (these, others) = rows.split_at_row_mut(n);
        task((i, these));
        rows = others;
    }
}

fn accumulate<const REPLACE: bool>() -> Accum {
    if REPLACE { Accum::Replace } else { Accum::Add }
}

/// C ← C − A Aᵀ, or C ← −A Aᵀ if `REPLACE` is set; lower triangle only.
fn square<const REPLACE: bool>(c: MatMut<'_, f64>, a: MatRef<'_, f64>) {
    triangular::matmul(
        c,
        BlockStructure::TriangularLower,
        accumulate::<REPLACE>(),
        a,
        BlockStructure::Rectangular,
        a.transpose(),
        BlockStructure::Rectangular,
        -1.0,
        Par::Seq,
    );
}
