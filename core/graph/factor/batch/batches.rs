//! The batches of a problem, looked up by type of factor.
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
    /// Returns the index of the batch for a factor of this kind, and adds the batch if it is new.
    pub fn place(
        &mut self,
        residual: &dyn ErasedResidual,
        noise: &Whitener,
        loss: Option<&dyn Loss>,
    ) -> usize {
        let of_type = self.of_type.entry(residual.type_id()).or_default();
        let fits = |batch: &dyn Batch| batch.fits(noise, loss) && batch.accepts_parameters(residual.as_any());
        let found = of_type.iter().copied().find(|b| fits(&*self.all[*b as usize]));
        let place = found.unwrap_or_else(|| {
            self.all.push(residual.new_batch(noise, loss));
            of_type.push(self.all.len() as u32 - 1);
            self.all.len() as u32 - 1
        });
        place as usize
    }
    /// Returns the batches, in the order of their creation.
    pub fn as_slice(&self) -> &[Box<dyn Batch>] {
        &self.all
    }
    /// Returns the batches for modification.
    pub fn as_mut_slice(&mut self) -> &mut [Box<dyn Batch>] {
        &mut self.all
    }
    /// Returns the batches by value.
    pub fn into_vec(self) -> Vec<Box<dyn Batch>> {
        self.all
    }
}
