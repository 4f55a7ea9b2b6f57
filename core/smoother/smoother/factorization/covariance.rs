//! Covariances from the stored fronts along paths of the tree, without a new factorization.
use super::Factorization;
use crate::elimination_tree::{Couplings, NONE};
use crate::model::Model;
use manifactor_graph::Key;
use nalgebra::DMatrix;
use std::cmp::Reverse;

/// Error of a covariance.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SmootherCovarianceError {
    /// A key without a variable.
    #[error("there is no variable `{key}`")]
    NoVariable {
        /// The key of the call.
        key: Key,
    },
    /// An undetermined variable, which its factors do not determine yet.
    #[error("the covariance of `{key}` is infinite: its factors do not determine it yet")]
    UndeterminedVariable {
        /// The variable.
        key: Key,
    },
    /// A direction that no factor constrains, and on which the variables depend.
    #[error("the covariance is infinite: nothing constrains `{key}.{direction}`; add a prior, or fix it")]
    UndeterminedDirection {
        /// The variable of the direction.
        key: Key,
        /// Name of the tangent direction.
        direction: &'static str,
    },
    /// A covariance that overflows.
    #[error("the covariance of `{key}` overflows; scale the noise of its factors")]
    Overflow {
        /// The variable.
        key: Key,
    },
}

impl Factorization {
    /// Returns the joint covariance of variables; see [`Smoother::covariance`](crate::Smoother::covariance).
    pub(in crate::smoother) fn covariance(
        &self,
        model: &Model,
        variables: &[u32],
    ) -> Result<DMatrix<f64>, SmootherCovarianceError> {
        if let Some(v) = variables.iter().find(|v| model.is_undetermined(**v)) {
            return Err(SmootherCovarianceError::UndeterminedVariable { key: model.record(*v).key.clone() });
        }
        // Σᵢⱼ = (L⁻¹eᵢ)ᵀ(L⁻¹eⱼ); such a column is zero except on the path from its front to the root
        let path = self.path(model, variables);
        for step in &path.steps {
            if let Some((v, direction)) = self.fronts.undetermined_directions(step.front).first() {
                let direction = model.record(*v).tangent[*direction as usize];
                return Err(SmootherCovarianceError::UndeterminedDirection {
                    key: model.record(*v).key.clone(),
                    direction,
                });
            }
        }
        let covariance = self.along(model, &path, variables);
        let mut ends = variables.iter().scan(0, |end, v| {
            *end += model.dim(*v);
            Some((*v, *end))
        });
        let bad = covariance.column_iter().position(|column| column.iter().any(|x| !x.is_finite()));
        match bad.and_then(|bad| ends.find(|(_, end)| bad < *end)) {
            Some((v, _)) => Err(SmootherCovarianceError::Overflow { key: model.record(v).key.clone() }),
            None => Ok(covariance),
        }
    }

    /// Returns the joint covariance of variables. Directions that no factor constrains are held; usually this
    /// is a gauge.
    pub(in crate::smoother) fn gauged_covariance(&self, model: &Model, variables: &[u32]) -> DMatrix<f64> {
        self.along(model, &self.path(model, variables), variables)
    }

    fn along(&self, model: &Model, path: &Path, variables: &[u32]) -> DMatrix<f64> {
        let mut columns = vec![];
        for v in variables {
            let held = model.record(*v).held;
            for d in 0..model.dim(*v) {
                let is_free = held >> d & 1 == 0;
                columns.push(if is_free { self.column(path, *v, d) } else { vec![0.0; path.scalars] });
            }
        }
        let dot = |r: usize, c: usize| columns[r].iter().zip(&columns[c]).map(|(a, b)| a * b).sum::<f64>();
        DMatrix::from_fn(columns.len(), columns.len(), |r, c| dot(r.max(c), r.min(c)))
    }

    /// Returns the fronts on the paths from variables to their roots.
    fn path(&self, model: &Model, variables: &[u32]) -> Path {
        let mut fronts = vec![];
        for v in variables {
            let first = fronts.len();
            let mut f = self.tree.front_of(*v);
            while f != NONE {
                fronts.push((0, f));
                f = self.tree.fronts[f as usize].parent;
            }
            let depth = fronts.len();
            (first..depth).for_each(|i| fronts[i].0 = depth - i);
        }
        // children before parents; front numbers depend on history, so fronts are sorted by their variables
        fronts.sort_unstable_by_key(|(depth, f)| (Reverse(*depth), self.tree.fronts[*f as usize].lowest));
        fronts.dedup();
        let mut path = Path::default();
        for (_, front) in fronts {
            let mut at = path.scalars as u32;
            path.steps.push(Step { front, first: at, rows: vec![] });
            for v in &self.tree.fronts[front as usize].blocks {
                path.first.push((*v, at));
                at += model.dim(*v) as u32;
            }
            path.scalars = at as usize;
        }
        path.first.sort_unstable();
        for i in 0..path.steps.len() {
            let rows = &self.tree.fronts[path.steps[i].front as usize].rows;
            path.steps[i].rows = rows.iter().map(|v| (path.first(*v), model.dim(*v) as u32)).collect();
        }
        path.of_front = path.steps.iter().enumerate().map(|(i, step)| (step.front, i as u32)).collect();
        path.of_front.sort_unstable();
        path
    }

    /// Returns L⁻¹e along the path, with the unit vector e of one direction of a variable.
    fn column(&self, path: &Path, variable: u32, direction: usize) -> Vec<f64> {
        let mut x = vec![0.0; path.scalars];
        x[path.first(variable) as usize + direction] = 1.0;
        let mut f = self.tree.front_of(variable);
        let mut below = vec![];
        while let Some(step) = path.step(f) {
            let front = &self.tree.fronts[f as usize];
            let first = step.first as usize;
            below.clear();
            below.resize(front.below, 0.0);
            self.fronts.forward(front, f, &mut x[first..first + front.width], &mut below);
            let mut rest = &below[..];
            for (at, dim) in &step.rows {
                let (of_row, after) = rest.split_at(*dim as usize);
                rest = after;
                x[*at as usize..].iter_mut().zip(of_row).for_each(|(x, b)| *x += b);
            }
            f = front.parent;
        }
        x
    }
}

/// Fronts on paths to the root, children before parents.
#[derive(Default)]
struct Path {
    steps: Vec<Step>,
    /// The first scalar of each variable on the path, and the step of each front. Both ascend.
    first: Vec<(u32, u32)>,
    of_front: Vec<(u32, u32)>,
    scalars: usize,
}

/// A front on a path.
struct Step {
    front: u32,
    /// Its first scalar on the path, and the first scalar and dimension of each of its rows.
    first: u32,
    rows: Vec<(u32, u32)>,
}

impl Path {
    /// Returns the first scalar of a variable on the path; 0 for a held variable.
    fn first(&self, variable: u32) -> u32 {
        let place = self.first.binary_search_by_key(&variable, |(v, _)| *v);
        place.map_or(0, |place| self.first[place].1)
    }
    fn step(&self, front: u32) -> Option<&Step> {
        let place = self.of_front.binary_search_by_key(&front, |(f, _)| *f).ok()?;
        self.steps.get(self.of_front[place].1 as usize)
    }
}
