//! Scaled and shifted residuals, for the method of multipliers.
use crate::algebra::{Dimension, Vector};

/// r ← scale r + shift, for a whitened residual r.
#[derive(Clone)]
pub(super) struct Augmentation<D: Dimension> {
    scale: f64,
    shift: Vector<D>,
}

impl<D: Dimension> Augmentation<D> {
    /// Makes the augmentation; `shift` may be shorter than D.
    pub(super) fn new(scale: f64, shift: &[f64]) -> Self {
        Self { scale, shift: D::vector(|i| shift.get(i).copied().unwrap_or(0.0)) }
    }

    pub(super) fn none() -> Self {
        Self::new(1.0, &[])
    }

    #[inline(always)]
    pub(super) fn apply(&self, r: &mut [f64]) {
        r.iter_mut().zip(self.shift.as_ref()).for_each(|(r, shift)| *r = self.scale * *r + shift);
    }

    #[inline(always)]
    pub(super) fn scale(&self, block: &mut [f64]) {
        block.iter_mut().for_each(|x| *x *= self.scale);
    }
}
