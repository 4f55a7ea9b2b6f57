//! Covariances of estimates.
use crate::Solution;
use crate::inspect::null_space::undetermined;
use crate::linear::Method;
use crate::outcome::Undetermined;
use crate::problem::CompileError;
use crate::problem::Problem;
use manifactor_graph::{Graph, Key};
use nalgebra::DMatrix;
use serde::{Serialize, Serializer};
use std::collections::HashSet;

/// Why there are no covariances.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CovarianceError {
    /// Something is not constrained: its covariance is infinite.
    #[error("the covariance is infinite: {0}")]
    Indeterminate(Undetermined),
    /// The Hessian is not positive definite to working precision.
    #[error(
        "the Hessian is not positive definite at this estimate: solve to a minimum first, or scale the problem better"
    )]
    NotPositiveDefinite,
    /// A variable that the problem does not have.
    #[error("there is no variable `{0}`")]
    Unknown(String),
    /// They do not fit into memory.
    #[error("no memory for the covariances of {unknowns} unknowns")]
    OutOfMemory {
        /// Size of the linear system.
        unknowns: usize,
    },
    /// A graph that is not the one that was solved.
    #[error(transparent)]
    Compile(#[from] CompileError),
}

/// The uncertainty of one variable.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Marginal {
    /// The variable.
    pub key: Key,
    /// Names of its tangent directions.
    pub tangent: &'static [&'static str],
    /// Covariance in these directions, by rows.
    #[serde(serialize_with = "by_rows")]
    pub covariance: DMatrix<f64>,
}

fn by_rows<S: Serializer>(matrix: &DMatrix<f64>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(matrix.row_iter().map(|row| row.iter().copied().collect::<Vec<f64>>()))
}

impl Solution {
    /// The marginal covariances of the variables that `keys` names, or of all where it names none; see
    /// [`Problem::marginals`].
    ///
    /// # Errors
    /// Where a key is unknown, something is not constrained, or `graph` is not the one that was solved.
    pub fn marginals(&self, graph: &Graph, keys: &[&str]) -> Result<Vec<Marginal>, CovarianceError> {
        if let Some(unknown) = keys.iter().find(|key| !self.values.contains(key)) {
            return Err(CovarianceError::Unknown((*unknown).to_owned()));
        }
        let keys: HashSet<&str> = keys.iter().copied().collect();
        let all = self.ask(graph, Problem::marginals)??;
        let wanted = all.into_iter().filter(|(key, _)| keys.is_empty() || keys.contains(key.as_str()));
        let marginal = |(key, covariance): (Key, _)| {
            let tangent = self.values.variable(key.as_str())?.erased().tangent();
            Some(Marginal { key, tangent, covariance })
        };
        Ok(wanted.filter_map(marginal).collect())
    }

    /// The leverage of each row of each factor; see [`Problem::leverages`].
    ///
    /// # Errors
    /// Those of [`Problem::leverages`], and where `graph` is not the one that was solved.
    pub fn leverages(&self, graph: &Graph) -> Result<Vec<Vec<f64>>, CovarianceError> {
        self.ask(graph, Problem::leverages)?
    }
}

impl Problem {
    /// The marginal covariance of each variable at the estimate, in its tangent space and the order of the values:
    /// the blocks on the diagonal of (JᵀJ)⁻¹, in the units of the noise.
    ///
    /// By Gauss-Newton's Hessian without damping, robust weights as they are at the estimate. What is held, whole or
    /// in part, has zeros. All of them together take about as long as ten factorizations.
    ///
    /// # Errors
    /// Where something is not constrained, or there is no memory.
    pub fn marginals(&mut self) -> Result<Vec<(Key, DMatrix<f64>)>, CovarianceError> {
        self.directly(Self::marginals_directly).unwrap_or(Err(self.out_of_memory()))
    }

    fn marginals_directly(&mut self) -> Result<Vec<(Key, DMatrix<f64>)>, CovarianceError> {
        let out_of_memory = self.out_of_memory();
        self.factorize_for_covariance()?;
        let Method::Cholesky(cholesky) = &self.method else { return Err(out_of_memory) };
        let inverse = cholesky.selected_inverse().ok_or(out_of_memory)?;
        let mut marginals = Vec::with_capacity(self.variables.len());
        for place in &self.variables {
            let dim = place.tangent.len();
            let held = |d: usize| place.held >> d & 1 == 1;
            let entry = |r: usize, c: usize| match place.start {
                Some(start) if !held(r) && !held(c) => inverse.get(start + r, start + c).unwrap_or(0.0),
                _ => 0.0,
            };
            marginals.push((place.key.clone(), DMatrix::from_fn(dim, dim, entry)));
        }
        Ok(marginals)
    }

    /// The joint covariance of a few variables at the estimate, in the order of `keys`; see
    /// [`marginals`](Self::marginals).
    ///
    /// # Errors
    /// Where a key is unknown, or something is not constrained.
    pub fn joint_covariance(&mut self, keys: &[&str]) -> Result<DMatrix<f64>, CovarianceError> {
        // by row of the result: its unknown, `None` for what is held
        let mut unknowns = vec![];
        for key in keys {
            let place = self.variables.iter().find(|p| p.key.as_str() == *key);
            let place = place.ok_or_else(|| CovarianceError::Unknown((*key).to_owned()))?;
            let free = |d: usize| place.start.filter(|_| place.held >> d & 1 == 0).map(|start| start + d);
            unknowns.extend((0..place.tangent.len()).map(free));
        }
        self.directly(|problem| problem.joint_directly(&unknowns)).unwrap_or(Err(self.out_of_memory()))
    }

    fn joint_directly(&mut self, unknowns: &[Option<usize>]) -> Result<DMatrix<f64>, CovarianceError> {
        self.factorize_for_covariance()?;
        let mut joint = DMatrix::zeros(unknowns.len(), unknowns.len());
        let mut column = vec![0.0; self.dim()];
        for (c, unknown) in unknowns.iter().enumerate() {
            let Some(unknown) = unknown else { continue };
            column.fill(0.0);
            column[*unknown] = 1.0;
            if let Some(cholesky) = self.cholesky() {
                cholesky.solve(&mut column);
            }
            for (r, row) in unknowns.iter().enumerate() {
                joint[(r, c)] = row.map_or(0.0, |row| column[row]);
            }
        }
        Ok(joint)
    }

    pub(crate) fn out_of_memory(&self) -> CovarianceError {
        CovarianceError::OutOfMemory { unknowns: self.dim() }
    }

    fn factorize_for_covariance(&mut self) -> Result<(), CovarianceError> {
        self.linearize();
        let factorized = self.factorize(None);
        if let Some(open) = undetermined(self, factorized.is_err(), 0.0) {
            return Err(CovarianceError::Indeterminate(open));
        }
        // the search may have left another factorization
        self.factorize(None).map_err(|_| CovarianceError::NotPositiveDefinite)
    }
}
