//! Whitening of a whole batch.
use super::Whitener;
use crate::algebra::{Block, Dimension, Matrix, Vector};
use nalgebra::U1;

/// The W matrices of a batch, all of one kind.
#[derive(Debug, Clone)]
pub(crate) enum Whiteners<D: Dimension> {
    Unit,
    Isotropic(Vec<f64>),
    Diagonal(Vec<Vector<D>>),
    Full(Vec<Matrix<D, D>>),
}

impl<D: Dimension> Whiteners<D> {
    pub(crate) fn like(one: &Whitener) -> Self {
        match one {
            Whitener::Unit => Self::Unit,
            Whitener::Isotropic(_) => Self::Isotropic(vec![]),
            Whitener::Diagonal(_) => Self::Diagonal(vec![]),
            Whitener::Full(_) => Self::Full(vec![]),
        }
    }
    pub(crate) fn fits(&self, one: &Whitener) -> bool {
        matches!(
            (self, one),
            (Self::Unit, Whitener::Unit)
                | (Self::Isotropic(_), Whitener::Isotropic(_))
                | (Self::Diagonal(_), Whitener::Diagonal(_))
                | (Self::Full(_), Whitener::Full(_))
        )
    }
    pub(crate) fn reserve(&mut self, factors: usize) {
        match self {
            Self::Unit => {}
            Self::Isotropic(all) => all.reserve_exact(factors),
            Self::Diagonal(all) => all.reserve_exact(factors),
            Self::Full(all) => all.reserve_exact(factors),
        }
    }
    pub(crate) fn push(&mut self, one: &Whitener) {
        match (self, one) {
            (Self::Isotropic(all), Whitener::Isotropic(w)) => all.push(*w),
            // rows beyond the size of the noise are not observed
            (Self::Diagonal(all), Whitener::Diagonal(w)) => {
                all.push(D::vector(|i| w.get(i).copied().unwrap_or(0.0)));
            }
            (Self::Full(all), Whitener::Full(w)) => {
                let mut block = <Matrix<D, D> as Block>::zeros();
                let columns = block.as_mut_slice().chunks_exact_mut(D::N).zip(w.column_iter());
                columns.for_each(|(to, from)| {
                    to.iter_mut().zip(from.iter()).for_each(|(to, from)| *to = *from);
                });
                all.push(block);
            }
            _ => {}
        }
    }
    /// Replaces W of factor `i`. Returns `false` if the new one is of a different kind.
    pub(crate) fn set(&mut self, i: usize, one: &Whitener) -> bool {
        let mut single = Self::like(one);
        single.push(one);
        match (self, single) {
            (Self::Unit, Self::Unit) => {}
            (Self::Isotropic(all), Self::Isotropic(one)) => all[i] = one[0],
            (Self::Diagonal(all), Self::Diagonal(mut one)) => all[i] = one.remove(0),
            (Self::Full(all), Self::Full(one)) => all[i] = one[0],
            _ => return false,
        }
        true
    }
    /// Moves the last W to position `i`.
    pub(crate) fn swap_remove(&mut self, i: usize) {
        match self {
            Self::Unit => {}
            Self::Isotropic(all) => drop(all.swap_remove(i)),
            Self::Diagonal(all) => drop(all.swap_remove(i)),
            Self::Full(all) => drop(all.swap_remove(i)),
        }
    }
    /// x ← W x for each column of `x`, in place. Rows that are not observed become zero, whatever they
    /// contain.
    #[inline(always)]
    pub(crate) fn whiten(&self, i: usize, x: &mut [f64]) {
        match self {
            Self::Unit => {}
            Self::Isotropic(w) => x.iter_mut().for_each(|x| *x *= w[i]),
            Self::Diagonal(w) => {
                let w = w[i].as_ref();
                for column in x.chunks_exact_mut(D::N) {
                    for r in 0..D::N {
                        column[r] = if w[r] == 0.0 { 0.0 } else { column[r] * w[r] };
                    }
                }
            }
            Self::Full(w) => {
                let w = w[i].as_slice();
                for column in x.chunks_exact_mut(D::N) {
                    // whole columns of W, though half of W is zero: adjacent entries share a register
                    let mut sum = <Matrix<D, U1> as Block>::zeros();
                    let sum = sum.as_mut_slice();
                    for (k, x) in column.iter().enumerate() {
                        let w = &w[k * D::N..(k + 1) * D::N];
                        // a row that is not observed has a zero column in W, and may contain any value,
                        // even NaN
                        if w[k] != 0.0 {
                            for r in 0..D::N {
                                sum[r] += w[r] * x;
                            }
                        }
                    }
                    column.copy_from_slice(sum);
                }
            }
        }
    }
}
