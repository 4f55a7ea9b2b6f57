//! A factor whose numbers of rows and variables are only known at run time.
use crate::toy::Spot;
use manifactor_graph::{Dynamic, DynamicBlocks, DynamicResidual, ErasedResidual, Factor};
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use std::any::{Any, TypeId};

/// The products a · b of each spot with the next one.
#[derive(Debug, Clone)]
pub(crate) struct Products {
    types: Vec<TypeId>,
    dimensions: Vec<usize>,
}

impl Products {
    fn spots<'a>(&self, variables: &[&'a dyn Any]) -> Vec<&'a Vector2<f64>> {
        variables.iter().map(|v| &v.downcast_ref::<Spot>().unwrap().0).collect()
    }
}

impl DynamicResidual for Products {
    fn rows(&self) -> usize {
        self.types.len() - 1
    }
    fn variables(&self) -> &[TypeId] {
        &self.types
    }
    fn dimensions(&self) -> &[usize] {
        &self.dimensions
    }
    fn residual(&self, variables: &[&dyn Any], residual: &mut [f64]) {
        let spots = self.spots(variables);
        residual.iter_mut().zip(spots.windows(2)).for_each(|(r, pair)| *r = pair[0].dot(pair[1]));
    }
    fn linearize(
        &self,
        variables: &[&dyn Any],
        free: &[bool],
        residual: &mut [f64],
        blocks: &mut DynamicBlocks,
    ) {
        self.residual(variables, residual);
        let (spots, rows) = (self.spots(variables), self.rows());
        for variable in (0..spots.len()).filter(|v| free[*v]) {
            let block = blocks.block_mut(variable);
            block.fill(0.0);
            for c in 0..2 {
                if variable > 0 {
                    block[variable - 1 + c * rows] = spots[variable - 1][c];
                }
                if variable < rows {
                    block[variable + c * rows] = spots[variable + 1][c];
                }
            }
        }
    }
}

#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(from = "usize", into = "usize")]
pub(crate) struct Chain(Dynamic<Products>);

impl From<usize> for Chain {
    fn from(spots: usize) -> Self {
        let products = Products { types: vec![TypeId::of::<Spot>(); spots], dimensions: vec![2; spots] };
        Self(Dynamic::new(products).unwrap())
    }
}
impl From<Chain> for usize {
    fn from(chain: Chain) -> usize {
        chain.0.get().types.len()
    }
}

#[typetag::serialize(name = "chain_of_spots")]
impl Factor for Chain {
    fn erased(&self) -> &dyn ErasedResidual {
        &self.0
    }
}

#[test]
fn a_number_of_rows_that_no_loop_is_made_for_is_refused() {
    let of = |spots: usize| {
        Dynamic::new(Products { types: vec![TypeId::of::<Spot>(); spots], dimensions: vec![2; spots] })
    };
    assert!(of(1).is_err() && of(2).is_ok() && of(49).is_ok() && of(50).is_err());
}
