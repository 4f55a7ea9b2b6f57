//! A linear prior as factors of a batch: r = √λ Vᵀ δ + Vᵀg/√λ, with H = V diag(λ) Vᵀ and the step δ from the
//! linearization point of the prior.
use crate::model::Prior;
use manifactor_graph::__private::typetag;
use manifactor_graph::{
    Dynamic, DynamicBlocks, DynamicResidual, ErasedResidual, Factor, Variable, as_variable,
};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use serde::Serialize;
use std::any::{Any, TypeId};
use std::sync::Arc;

/// Rows per factor: few, so that no padding with zeros is needed.
const ROWS_PER_FACTOR: usize = 9;

/// Eigenvalues below this share of the largest one are rounding error.
const MIN_EIGENVALUE_SHARE: f64 = 1e-13;
/// Half of the difference for the derivative of the chart.
const HALF_DIFFERENCE: f64 = 1e-6;

/// Some rows of a prior.
#[derive(Debug, Clone)]
struct Rows {
    points: Arc<[Box<dyn Variable>]>,
    types: Arc<[TypeId]>,
    dimensions: Arc<[usize]>,
    /// Rows × scalars (`root`), and the residual at the points (`offset`).
    root: DMatrix<f64>,
    offset: DVector<f64>,
}

/// A linear prior that exists only during a batch solve and is never saved.
#[derive(Debug, Serialize)]
struct BatchPrior {
    #[serde(skip)]
    rows: Dynamic<Rows>,
}

#[typetag::serialize(name = "linear_prior")]
impl Factor for BatchPrior {
    fn erased(&self) -> &dyn ErasedResidual {
        &self.rows
    }
}

/// Returns the factors of a prior. `points` are the linearization points of its variables.
pub(super) fn factors(prior: &Prior, points: Vec<Box<dyn Variable>>) -> Vec<Arc<dyn Factor>> {
    let n = prior.g.len();
    let mut h = DMatrix::zeros(n, n);
    let mut values = prior.h.iter();
    for (c, r) in (0..n).flat_map(|c| (c..n).map(move |r| (c, r))) {
        let value = values.next().copied().unwrap_or_default();
        (h[(r, c)], h[(c, r)]) = (value, value);
    }
    let SymmetricEigen { eigenvectors, eigenvalues } = h.symmetric_eigen();
    let least = MIN_EIGENVALUE_SHARE * eigenvalues.amax();
    let g = DVector::from_column_slice(&prior.g);
    let mut rows: Vec<(DVector<f64>, f64)> = vec![];
    for (value, vector) in
        eigenvalues.iter().zip(eigenvectors.column_iter()).filter(|(value, _)| **value > least)
    {
        rows.push((vector * value.sqrt(), vector.dot(&g) / value.sqrt()));
    }
    // its minimal cost becomes a constant row
    let least_cost = prior.constant - 0.5 * rows.iter().map(|(_, offset)| offset * offset).sum::<f64>();
    rows.push((DVector::zeros(n), (2.0 * least_cost.max(0.0)).sqrt()));
    let types = points.iter().map(|point| point.erased().type_id()).collect();
    let dimensions = points.iter().map(|point| point.erased().dim()).collect();
    let all = Rows {
        points: points.into(),
        types,
        dimensions,
        root: DMatrix::zeros(0, 0),
        offset: DVector::zeros(0),
    };
    let some = |rows: &[(DVector<f64>, f64)]| {
        let root = DMatrix::from_fn(rows.len(), n, |r, c| rows[r].0[c]);
        let offset = DVector::from_fn(rows.len(), |r, _| rows[r].1);
        let rows = Dynamic::new(Rows { root, offset, ..all.clone() }).ok()?;
        Some(Arc::new(BatchPrior { rows }) as Arc<dyn Factor>)
    };
    rows.chunks(ROWS_PER_FACTOR).filter_map(some).collect()
}

impl Rows {
    /// Casts the variables to their trait.
    fn cast<'a>(&self, variables: &[&'a dyn Any]) -> Vec<&'a dyn Variable> {
        let types = self.types.iter().zip(variables);
        types.filter_map(|(id, variable)| (as_variable(*id)?.cast)(*variable)).collect()
    }
}

impl DynamicResidual for Rows {
    fn rows(&self) -> usize {
        self.offset.len()
    }
    fn variables(&self) -> &[TypeId] {
        &self.types
    }
    fn dimensions(&self) -> &[usize] {
        &self.dimensions
    }
    fn residual(&self, variables: &[&dyn Any], residual: &mut [f64]) {
        let steps = self.points.iter().zip(self.cast(variables)).filter_map(|(p, x)| p.erased().local(x));
        let delta: Vec<f64> = steps.flatten().collect();
        if delta.len() == self.root.ncols() {
            let r = &self.root * DVector::from_vec(delta) + &self.offset;
            residual.copy_from_slice(r.as_slice());
        } else {
            residual.fill(f64::NAN);
        }
    }
    fn linearize(
        &self,
        variables: &[&dyn Any],
        _free: &[bool],
        residual: &mut [f64],
        blocks: &mut DynamicBlocks,
    ) {
        self.residual(variables, residual);
        let mut first = 0;
        for (i, x) in self.cast(variables).into_iter().enumerate() {
            let (dim, point) = (self.dimensions[i], self.points[i].erased());
            let root = self.root.columns(first, dim);
            let at = |d: usize, by: f64| {
                let step: Vec<f64> = (0..dim).map(|k| if k == d { by } else { 0.0 }).collect();
                x.erased().retract(&step).and_then(|x| point.local(&*x)).unwrap_or_default()
            };
            let to = blocks.block_mut(i).chunks_exact_mut(self.offset.len());
            for (d, column) in to.enumerate() {
                let (more, less) = (at(d, HALF_DIFFERENCE), at(d, -HALF_DIFFERENCE));
                let slope = more.iter().zip(&less).map(|(a, b)| (a - b) / (2.0 * HALF_DIFFERENCE));
                let slope = DVector::from_iterator(dim, slope);
                column.copy_from_slice((root * slope).as_slice());
            }
            first += dim;
        }
    }
}
