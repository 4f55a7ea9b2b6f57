//! Factors that read results computed for the whole batch.
use super::evaluate::{Function, Linearized};
use manifactor::graph::{DynamicBlocks, DynamicResidual};
use std::any::{Any, TypeId};
use std::sync::{Arc, RwLock};

/// Results of a pass, by number of the factor.
pub(super) type Results = Arc<RwLock<Linearized>>;

/// One factor of a batch, with its index in the results.
#[derive(Debug, Clone)]
pub(super) struct Cached {
    pub function: Arc<Function>,
    pub number: usize,
    pub results: Results,
}

impl Cached {
    /// Copies this factor's part of the results, or NaN if there is none.
    fn copy(&self, from: &[f64], to: &mut [f64]) {
        let range = self.number * to.len()..(self.number + 1) * to.len();
        match from.get(range) {
            Some(own) => to.copy_from_slice(own),
            None => to.fill(f64::NAN),
        }
    }
}

impl DynamicResidual for Cached {
    fn rows(&self) -> usize {
        self.function.rows
    }
    fn variables(&self) -> &[TypeId] {
        &self.function.types
    }
    fn dimensions(&self) -> &[usize] {
        &self.function.dimensions
    }
    /// A NaN in the residual marks the factor as undefined at this point.
    fn is_defined(&self, variables: &[&dyn Any]) -> bool {
        let mut residual = vec![0.0; self.rows()];
        self.residual(variables, &mut residual);
        residual.iter().all(|x| !x.is_nan())
    }
    fn residual(&self, _: &[&dyn Any], residual: &mut [f64]) {
        match self.results.read() {
            Ok(results) => self.copy(&results.0, residual),
            Err(_) => residual.fill(f64::NAN),
        }
    }
    fn linearize(&self, x: &[&dyn Any], free: &[bool], residual: &mut [f64], blocks: &mut DynamicBlocks) {
        self.residual(x, residual);
        let Ok(results) = self.results.read() else { return };
        for (variable, of_variable) in results.1.iter().enumerate() {
            if free.get(variable) == Some(&true) {
                self.copy(of_variable, blocks.block_mut(variable));
            }
        }
    }
}
