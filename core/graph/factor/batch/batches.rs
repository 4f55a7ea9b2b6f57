//! The batches of a problem, found by what belongs together.
use super::Batch;
use crate::factor::ErasedResidual;
use crate::loss::Loss;
use crate::noise::Whitener;
use std::any::TypeId;
use std::collections::HashMap;

/// Batches, by residual type, kind of noise and type of loss.
#[derive(Default)]
pub struct Batches {
    all: Vec<Box<dyn Batch>>,
    of_type: HashMap<TypeId, Vec<u32>>,
}

impl Batches {
    /// The place of the batch that such a factor belongs to; a new batch, where it is the first of its kind.
    pub fn place(
        &mut self,
        residual: &dyn ErasedResidual,
        noise: &Whitener,
        loss: Option<&dyn Loss>,
    ) -> usize {
        let of_type = self.of_type.entry(residual.type_id()).or_default();
        let fits = |batch: &dyn Batch| batch.fits(noise, loss) && batch.takes(residual.as_any());
        let found = of_type.iter().copied().find(|b| fits(&*self.all[*b as usize]));
        let place = found.unwrap_or_else(|| {
            self.all.push(residual.new_batch(noise, loss));
            of_type.push(self.all.len() as u32 - 1);
            self.all.len() as u32 - 1
        });
        place as usize
    }
    /// The batches, in the order in which they were made.
    pub fn as_slice(&self) -> &[Box<dyn Batch>] {
        &self.all
    }
    /// The batches, to be changed.
    pub fn as_mut_slice(&mut self) -> &mut [Box<dyn Batch>] {
        &mut self.all
    }
    /// The batches by themselves.
    pub fn into_vec(self) -> Vec<Box<dyn Batch>> {
        self.all
    }
}
