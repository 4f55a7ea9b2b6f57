//! Storage of the normal equations H = JᵀJ and g = Jᵀr.
use crate::algebra::{Block, Dimension, Matrix};
use crate::variable::column::FIXED;
use nalgebra::U1;

/// Position of one block of H in the packed columns of its lower triangle. Each column is one entry shorter
/// than the previous one, so the distance between columns of a block decreases:
///
/// ```text
/// H    h00                 packed by columns:  h00 h10 h20 h30 | h11 h21 h31 | h22 h32 | h33
///      h10 h11             the block of rows 2, 3 and columns 0, 1
///      h20 h21 h22         begins at 2 (h20), and its second column at 2 + stride = 5 (h21): stride 3
///      h30 h31 h32 h33
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Slot {
    /// Index of entry (0, 0).
    pub at: usize,
    /// Distance from the first column to the second. It decreases by one with each further column.
    pub stride: u32,
    /// Whether the transposed block is stored, because the factor's earlier variable comes later in the
    /// ordering.
    pub swapped: bool,
}

impl Slot {
    /// Returns the index of entry (row, column) of the block. In a diagonal block, row ≥ column.
    #[inline(always)]
    pub fn index(self, row: usize, column: usize) -> usize {
        self.at + column * self.stride as usize - column * column.saturating_sub(1) / 2 + row
    }

    /// Returns the slot of the transposed block.
    #[must_use]
    pub fn transposed(self) -> Self {
        Self { swapped: !self.swapped, ..self }
    }
}

/// The values of H (lower triangle, compressed columns) and g.
#[derive(Debug)]
pub struct NormalEquations<'a> {
    /// Values of the lower triangle of JᵀJ, column after column.
    pub h: &'a mut [f64],
    /// Jᵀr.
    pub g: &'a mut [f64],
}

/// Positions of one factor: starts of its variables in g, and slots of its blocks in H.
#[derive(Debug, Clone, Copy)]
pub struct Places<'a> {
    /// Start of each variable; [`FIXED`] for fixed variables.
    pub starts: &'a [u32],
    /// Slot of each pair (a, b ≤ a), at index a(a+1)/2 + b.
    pub slots: &'a [Slot],
}

/// h ← h + s for a few entries, in pairs: a plain loop would compile to masked stores, which are slow.
#[inline(always)]
fn add_short(h: &mut [f64], s: &[f64]) {
    let ((h, last), (s, of_last)) = (h.as_chunks_mut::<2>(), s.as_chunks::<2>());
    h.iter_mut().zip(s).for_each(|(h, s)| (0..2).for_each(|i| h[i] += s[i]));
    last.iter_mut().zip(of_last).for_each(|(h, s)| *h += s);
}

impl NormalEquations<'_> {
    /// g ← g + w Jₐᵀr.
    #[inline(always)]
    pub(crate) fn add_gradient<R: Dimension, A: Dimension>(
        &mut self,
        places: Places<'_>,
        a: usize,
        ja: &Matrix<R, A>,
        r: &[f64],
        w: f64,
    ) {
        let start = places.starts[a];
        if start == FIXED {
            return;
        }
        let (ja, g) = (ja.as_slice(), &mut self.g[start as usize..][..A::N]);
        for (c, g) in g.iter_mut().enumerate() {
            let mut sum = 0.0;
            for k in 0..R::N {
                sum += ja[k + c * R::N] * r[k];
            }
            *g += w * sum;
        }
    }

    /// H ← H + w JₐᵀJₐ, lower triangle.
    #[inline(always)]
    pub(crate) fn add_diagonal<R: Dimension, A: Dimension>(
        &mut self,
        places: Places<'_>,
        a: usize,
        ja: &Matrix<R, A>,
        w: f64,
    ) {
        if places.starts[a] != FIXED {
            self.add_product::<R, A, A>(places.slots[a * (a + 1) / 2 + a], ja, ja, w, true);
        }
    }

    /// H ← H + w JₐᵀJ_b for b < a, in either triangle.
    #[inline(always)]
    pub(crate) fn add_pair<R: Dimension, A: Dimension, B: Dimension>(
        &mut self,
        places: Places<'_>,
        (a, b): (usize, usize),
        ja: &Matrix<R, A>,
        jb: &Matrix<R, B>,
        w: f64,
    ) {
        if places.starts[a] == FIXED || places.starts[b] == FIXED {
            return;
        }
        let slot = places.slots[a * (a + 1) / 2 + b];
        if slot.swapped {
            self.add_product::<R, B, A>(slot, jb, ja, w, false);
        } else {
            self.add_product::<R, A, B>(slot, ja, jb, w, false);
        }
    }

    #[inline(always)]
    fn add_product<R: Dimension, A: Dimension, B: Dimension>(
        &mut self,
        slot: Slot,
        ja: &Matrix<R, A>,
        jb: &Matrix<R, B>,
        w: f64,
        lower: bool,
    ) {
        let (ja, jb) = (ja.as_slice(), jb.as_slice());
        // transpose first, so that the inner loops run over contiguous entries
        let mut at = <Matrix<A, R> as Block>::zeros();
        let at = at.as_mut_slice();
        for k in 0..R::N {
            for r in 0..A::N {
                at[r + k * A::N] = w * ja[k + r * R::N];
            }
        }
        let mut to = slot.at;
        for c in 0..B::N {
            let mut sum = <Matrix<A, U1> as Block>::zeros();
            let sum = sum.as_mut_slice();
            for k in 0..R::N {
                let b = jb[k + c * R::N];
                for r in 0..A::N {
                    sum[r] += at[r + k * A::N] * b;
                }
            }
            let column = &mut self.h[to..to + A::N];
            match lower {
                true => add_short(&mut column[c..], &sum[c..]),
                false => column.iter_mut().zip(&*sum).for_each(|(h, s)| *h += s),
            }
            to += slot.stride as usize - c;
        }
    }

    /// g ← g + w Jₐᵀr and H ← H + w JₐᵀJ_b for all b ≤ a, for blocks with run-time widths.
    pub(crate) fn add_dynamic<'b, const R: usize>(
        &mut self,
        places: Places<'_>,
        a: usize,
        block: impl Fn(usize) -> &'b [f64],
        r: &[f64],
        w: f64,
    ) {
        let (ja, start) = (block(a).as_chunks::<R>().0, places.starts[a]);
        if start == FIXED {
            return;
        }
        let dot = |x: &[f64; R], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        for (g, column) in self.g[start as usize..].iter_mut().zip(ja) {
            *g += w * dot(column, r);
        }
        for b in (0..=a).filter(|b| places.starts[*b] != FIXED) {
            let (jb, slot) = (block(b).as_chunks::<R>().0, places.slots[a * (a + 1) / 2 + b]);
            let (rows, columns) = if slot.swapped { (jb, ja) } else { (ja, jb) };
            let mut to = slot.at;
            for (c, column) in columns.iter().enumerate() {
                let first = if a == b { c } else { 0 };
                for (h, row) in self.h[to + first..].iter_mut().zip(&rows[first..]) {
                    *h += w * dot(row, column);
                }
                to += slot.stride as usize - c;
            }
        }
    }
}
