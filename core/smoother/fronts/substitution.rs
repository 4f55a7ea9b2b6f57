//! Triangular solves with the panel of a front. Its last row is the right-hand side.
use pulp::{Simd, WithSimd};

/// Number of columns whose sums run in parallel; they do not depend on each other.
const PARALLEL_COLUMNS: usize = 4;

/// Computes x ← L₁⁻ᵀ (y − L₂ᵀ x₂). `x` holds `width` unknowns of the panel's columns, then x₂, the values of
/// its rows. y is the last row of the panel.
pub(super) struct Backward<'a> {
    pub(super) panel: &'a [f64],
    pub(super) width: usize,
    pub(super) x: &'a mut [f64],
}

impl WithSimd for Backward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { panel, width, x } = self;
        let height = panel.len() / width;
        let mut end = width;
        while end > 0 {
            let first = (end - 1) / PARALLEL_COLUMNS * PARALLEL_COLUMNS;
            let columns = &panel[first * height..end * height];
            let sums = dots(simd, columns, height, end, &x[end..height - 1]);
            for c in (first..end).rev() {
                let column = &columns[(c - first) * height..][..height];
                let inside: f64 = (c + 1..end).map(|r| column[r] * x[r]).sum();
                x[c] = (column[height - 1] - sums[c - first] - inside) / column[c];
            }
            end = first;
        }
    }
}

/// Returns the products of up to four columns, from row `from` on, with a vector. It has no closure, because
/// that would be compiled for the baseline instruction set.
#[inline(always)]
fn dots<S: Simd>(simd: S, columns: &[f64], height: usize, from: usize, x: &[f64]) -> [f64; PARALLEL_COLUMNS] {
    // with fewer than four columns, the last one is repeated
    let last = columns.len() / height - 1;
    let (a, a_tail) = S::as_simd_f64s(&columns[from..][..x.len()]);
    let (b, b_tail) = S::as_simd_f64s(&columns[last.min(1) * height + from..][..x.len()]);
    let (c, c_tail) = S::as_simd_f64s(&columns[last.min(2) * height + from..][..x.len()]);
    let (d, d_tail) = S::as_simd_f64s(&columns[last.min(3) * height + from..][..x.len()]);
    let (x, x_tail) = S::as_simd_f64s(x);
    let mut sums = [simd.splat_f64s(0.0); PARALLEL_COLUMNS];
    for ((((x, a), b), c), d) in x.iter().zip(a).zip(b).zip(c).zip(d) {
        sums[0] = simd.mul_add_f64s(*a, *x, sums[0]);
        sums[1] = simd.mul_add_f64s(*b, *x, sums[1]);
        sums[2] = simd.mul_add_f64s(*c, *x, sums[2]);
        sums[3] = simd.mul_add_f64s(*d, *x, sums[3]);
    }
    let mut total = [0.0; PARALLEL_COLUMNS];
    for (total, sum) in total.iter_mut().zip(sums) {
        *total = simd.reduce_sum_f64s(sum);
    }
    for (i, x) in x_tail.iter().enumerate() {
        total[0] += a_tail[i] * x;
        total[1] += b_tail[i] * x;
        total[2] += c_tail[i] * x;
        total[3] += d_tail[i] * x;
    }
    total
}

/// Computes x ← L₁⁻¹ x for the panel's columns, and subtracts their contribution from `below`.
pub(super) fn forward(panel: &[f64], x: &mut [f64], below: &mut [f64]) {
    let width = x.len();
    for (c, column) in panel.chunks_exact(width + below.len() + 1).enumerate() {
        x[c] /= column[c];
        let value = x[c];
        x[c + 1..].iter_mut().zip(&column[c + 1..width]).for_each(|(x, l)| *x -= l * value);
        below.iter_mut().zip(&column[width..]).for_each(|(x, l)| *x -= l * value);
    }
}
