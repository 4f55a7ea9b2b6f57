//! Dense kernels for fronts. Small fronts use the kernels here, because a call would cost more than the
//! work; large ones use faer.
use crate::linear::cholesky::large::{self, Scratch};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// Number of columns that are eliminated together, and columns of a product that are accumulated in
/// registers.
const COLUMNS: usize = 4;
/// Multiplications above which a front counts as large.
const LARGE_FRONT: usize = 1 << 24;
/// Threads share an update from this number of multiplications on, and from this number per entry of the
/// update. Below these, collecting the entries takes longer than the threads save. Debug builds use small
/// limits, so that tests cover small problems too.
const SHARED: (usize, usize) = if cfg!(debug_assertions) { (1 << 14, 4) } else { (1 << 21, 48) };
/// Columns of an update per thread task.
const SHARE: usize = 8 * COLUMNS;

/// Factorizes the first `width` columns of a front. Writes L to `panel`. Writes −L₂₁L₂₁ᵀ to the lower
/// triangle of `update`, or adds it if `REPLACE` is not set. Both are column-major. Entries above their
/// diagonals are garbage afterwards.
///
/// # Errors
/// The column with a pivot that is not positive.
#[inline(always)]
pub fn eliminate<S: Simd, const REPLACE: bool>(
    simd: S,
    panel: &mut [f64],
    update: &mut [f64],
    width: usize,
    memory: &mut Scratch,
) -> Result<(), usize> {
    let height = panel.len() / width;
    if height * height * width >= LARGE_FRONT {
        return large::eliminate::<REPLACE>(panel, update, width, memory);
    }
    for first in (0..width).step_by(COLUMNS) {
        let n = COLUMNS.min(width - first);
        let (left, rest) = panel.split_at_mut(first * height);
        if first > 0 {
            product::<S, false>(simd, left, height, (first, first), &mut rest[first..], height, n);
        }
        factorize_columns(&mut rest[..n * height], height, first).map_err(|c| first + c)?;
    }
    let below = height - width;
    let is_shared = below * below * width >= SHARED.0 && width >= SHARED.1;
    if !is_shared || rayon::current_num_threads() == 1 {
        Update::<REPLACE> { panel, width, first: 0, columns: update }.with_simd(simd);
    } else {
        update.par_chunks_mut(SHARE * below).enumerate().for_each(|(i, columns)| {
            simd.vectorize(Update::<REPLACE> { panel, width, first: i * SHARE, columns });
        });
    }
    Ok(())
}

/// Some columns of an update, from `first` on. Each entry is a separate sum, so the result does not depend
/// on the distribution of columns to threads.
struct Update<'a, const REPLACE: bool> {
    panel: &'a [f64],
    width: usize,
    first: usize,
    columns: &'a mut [f64],
}

impl<const REPLACE: bool> WithSimd for Update<'_, REPLACE> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let height = self.panel.len() / self.width;
        let below = height - self.width;
        for (i, columns) in self.columns.chunks_mut(COLUMNS * below.max(1)).enumerate() {
            let at = self.first + i * COLUMNS;
            let (rows, n) = ((self.width + at, self.width + at), columns.len() / below);
            product::<S, REPLACE>(simd, self.panel, height, rows, &mut columns[at..], below, n);
        }
    }
}

/// Adds the columns of a child's update that belong to the panel of its parent. Row i of the update is row
/// `places[i]` of the parent's front.
#[inline(always)]
pub(crate) fn assemble_panel(from: &[f64], places: &[u32], panel: &mut [f64], width: usize) {
    let height = panel.len() / width;
    for (j, column) in from.chunks_exact(places.len()).enumerate() {
        let at = places[j] as usize;
        if at >= width {
            return;
        }
        add_column(&column[j..], &places[j..], &mut panel[at * height..(at + 1) * height], 0);
    }
}

/// Adds the remaining columns of a child's update to the update of its parent.
#[inline(always)]
pub(crate) fn assemble_update(from: &[f64], places: &[u32], update: &mut [f64], below: usize, width: usize) {
    let inside = places.partition_point(|place| (*place as usize) < width);
    for (j, column) in from.chunks_exact(places.len()).enumerate().skip(inside) {
        let at = places[j] as usize - width;
        add_column(&column[j..], &places[j..], &mut update[at * below..(at + 1) * below], width);
    }
}

/// Adds a column to column `to`, whose entry i is in row i + `first` of the front.
#[inline(always)]
fn add_column(column: &[f64], places: &[u32], to: &mut [f64], first: usize) {
    let (at, last) = (places[0] as usize - first, places[places.len() - 1] as usize - first);
    if last - at + 1 == places.len() {
        to[at..=last].iter_mut().zip(column).for_each(|(to, x)| *to += x);
    } else {
        places.iter().zip(column).for_each(|(place, x)| to[*place as usize - first] += x);
    }
}

/// Factorizes several columns from row `first` on, which is the diagonal of the first column.
#[inline(always)]
fn factorize_columns(columns: &mut [f64], height: usize, first: usize) -> Result<(), usize> {
    for c in 0..columns.len() / height {
        let (column, right) = columns[c * height..].split_at_mut(height);
        let column = &mut column[first + c..];
        let pivot = column[0];
        // rejects NaN too
        if !(pivot > 0.0 && pivot < f64::INFINITY) {
            return Err(c);
        }
        column[0] = pivot.sqrt();
        let inverse = 1.0 / column[0];
        column[1..].iter_mut().for_each(|x| *x *= inverse);
        for (k, other) in right.chunks_exact_mut(height).enumerate() {
            let factor = column[k + 1];
            other[first + c..].iter_mut().zip(&*column).for_each(|(x, l)| *x -= l * factor);
        }
    }
    Ok(())
}

/// C ← C − A Bᵀ, or C ← −A Bᵀ if `REPLACE` is set, for up to [`COLUMNS`] columns of C. A has the rows from
/// `rows.0` on of a matrix with `height` rows. B has one row per column of C, from `rows.1` on. `to` begins
/// at the first entry of C.
#[inline(always)]
fn product<S: Simd, const REPLACE: bool>(
    simd: S,
    of: &[f64],
    height: usize,
    rows: (usize, usize),
    to: &mut [f64],
    stride: usize,
    columns: usize,
) {
    match columns {
        1 => product_columns::<S, REPLACE, 1>(simd, of, height, rows, to, stride),
        2 => product_columns::<S, REPLACE, 2>(simd, of, height, rows, to, stride),
        3 => product_columns::<S, REPLACE, 3>(simd, of, height, rows, to, stride),
        _ => product_columns::<S, REPLACE, 4>(simd, of, height, rows, to, stride),
    }
}

#[inline(always)]
fn product_columns<S: Simd, const REPLACE: bool, const C: usize>(
    simd: S,
    of: &[f64],
    height: usize,
    (from, beside): (usize, usize),
    to: &mut [f64],
    stride: usize,
) {
    let lanes = S::F64_LANES;
    let n = height - from;
    let mut row = 0;
    while row + 2 * lanes <= n {
        tile::<S, REPLACE, 2, C>(simd, of, height, (from + row, beside), &mut to[row..], stride, 2 * lanes);
        row += 2 * lanes;
    }
    if row + lanes <= n {
        tile::<S, REPLACE, 1, C>(simd, of, height, (from + row, beside), &mut to[row..], stride, lanes);
        row += lanes;
    }
    if row < n {
        tail::<S, REPLACE, C>(simd, of, height, (from + row, beside), &mut to[row..], stride, n - row);
    }
}

/// Computes a tile of R registers of rows by C columns.
#[inline(always)]
fn tile<S: Simd, const REPLACE: bool, const R: usize, const C: usize>(
    simd: S,
    of: &[f64],
    height: usize,
    (from, beside): (usize, usize),
    to: &mut [f64],
    stride: usize,
    rows: usize,
) {
    let mut sum = [[simd.splat_f64s(0.0); R]; C];
    for column in of.chunks_exact(height) {
        let a = S::as_simd_f64s(&column[from..from + rows]).0;
        let b = &column[beside..beside + C];
        for c in 0..C {
            let b = simd.splat_f64s(b[c]);
            for r in 0..R {
                sum[c][r] = simd.mul_add_f64s(a[r], b, sum[c][r]);
            }
        }
    }
    for c in 0..C {
        let to = S::as_mut_simd_f64s(&mut to[c * stride..c * stride + rows]).0;
        for r in 0..R {
            let before = if REPLACE { simd.splat_f64s(0.0) } else { to[r] };
            to[r] = simd.sub_f64s(before, sum[c][r]);
        }
    }
}

/// Computes the rows that do not fill a register.
#[inline(always)]
fn tail<S: Simd, const REPLACE: bool, const C: usize>(
    simd: S,
    of: &[f64],
    height: usize,
    (from, beside): (usize, usize),
    to: &mut [f64],
    stride: usize,
    rows: usize,
) {
    let mut sum = [simd.splat_f64s(0.0); C];
    for column in of.chunks_exact(height) {
        let a = simd.partial_load_f64s(&column[from..from + rows]);
        let b = &column[beside..beside + C];
        for c in 0..C {
            sum[c] = simd.mul_add_f64s(a, simd.splat_f64s(b[c]), sum[c]);
        }
    }
    for c in 0..C {
        let to = &mut to[c * stride..c * stride + rows];
        let before = if REPLACE { simd.splat_f64s(0.0) } else { simd.partial_load_f64s(to) };
        simd.partial_store_f64s(to, simd.sub_f64s(before, sum[c]));
    }
}

/// x ← L⁻¹ x for the panel's columns. Writes the subtrahend for the rows below to `below`.
#[inline(always)]
pub(crate) fn solve_lower(panel: &[f64], x: &mut [f64], below: &mut [f64]) {
    let (width, height) = (x.len(), x.len() + below.len());
    below.fill(0.0);
    for (c, column) in panel.chunks_exact(height).enumerate() {
        x[c] /= column[c];
        let value = x[c];
        x[c + 1..].iter_mut().zip(&column[c + 1..width]).for_each(|(x, l)| *x -= l * value);
        below.iter_mut().zip(&column[width..]).for_each(|(x, l)| *x += l * value);
    }
}

/// x ← L⁻ᵀ (x − L₂ᵀ below) for the panel's columns; L₂ are its rows below.
#[inline(always)]
pub(crate) fn solve_upper(panel: &[f64], x: &mut [f64], below: &[f64]) {
    let (width, height) = (x.len(), x.len() + below.len());
    for (c, column) in panel.chunks_exact(height).enumerate().rev() {
        let lower: f64 = column[c + 1..width].iter().zip(&x[c + 1..]).map(|(l, x)| l * x).sum();
        let rest: f64 = column[width..].iter().zip(below).map(|(l, x)| l * x).sum();
        x[c] = (x[c] - lower - rest) / column[c];
    }
}
