//! Covariances of estimates.
use crate::Solution;
use crate::outcome::Undetermined;
use crate::problem::CompileError;
use crate::problem::Problem;
use manifactor_graph::{Graph, Key};
use nalgebra::DMatrix;
use serde::{Serialize, Serializer};
use std::collections::HashSet;

/// The error of a covariance computation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CovarianceError {
    /// A direction is undetermined, so its covariance is infinite.
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
    /// The covariances do not fit into memory.
    #[error("no memory for the covariances of {unknowns} unknowns")]
    OutOfMemory {
        /// Size of the linear system.
        unknowns: usize,
    },
    /// The graph differs from the solved one.
    #[error(transparent)]
    Compile(#[from] CompileError),
}

/// Marginals are computed one by one if fewer than one variable in `ONE_BY_ONE_DIVISOR` is requested. Above
/// that, the selected inverse is faster.
const ONE_BY_ONE_DIVISOR: usize = 8;

/// Marginal covariance of one variable.
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
    /// Returns the marginal covariances of the variables in `keys`, or of all variables if `keys` is empty;
    /// see [`Factorized::marginals`](crate::Factorized::marginals).
    ///
    /// # Errors
    /// If a key is unknown, a direction is undetermined, or `graph` is not the solved graph.
    pub fn marginals(&self, graph: &Graph, keys: &[&str]) -> Result<Vec<Marginal>, CovarianceError> {
        if let Some(unknown) = keys.iter().find(|key| !self.values.contains(key)) {
            return Err(CovarianceError::Unknown((*unknown).to_owned()));
        }
        let few = !keys.is_empty() && keys.len() * ONE_BY_ONE_DIVISOR < self.values.len();
        let all = self.query(graph, |problem| {
            let mut system = problem.factorized()?;
            match few {
                true => keys.iter().map(|key| Ok((Key::from(*key), system.marginal(key)?))).collect(),
                false => system.marginals(),
            }
        })??;
        let keys: HashSet<&str> = keys.iter().copied().collect();
        let wanted = all.into_iter().filter(|(key, _)| keys.is_empty() || keys.contains(key.as_str()));
        let marginal = |(key, covariance): (Key, _)| {
            let tangent = self.values.variable(key.as_str())?.erased().tangent();
            Some(Marginal { key, tangent, covariance })
        };
        Ok(wanted.filter_map(marginal).collect())
    }

    /// Returns the leverage of each row of each factor; see [`Problem::leverages`].
    ///
    /// # Errors
    /// As [`Problem::leverages`], or if `graph` is not the solved graph.
    pub fn leverages(&self, graph: &Graph) -> Result<Vec<Vec<f64>>, CovarianceError> {
        self.query(graph, Problem::leverages)?
    }
}

impl Problem {
    /// Returns the marginal covariance of each variable at the estimate; see
    /// [`Factorized::marginals`](crate::Factorized::marginals).
    ///
    /// # Errors
    /// If a direction is undetermined, or there is no memory.
    pub fn marginals(&mut self) -> Result<Vec<(Key, DMatrix<f64>)>, CovarianceError> {
        self.factorized()?.marginals()
    }

    /// Returns the joint covariance of several variables at the estimate; see
    /// [`Factorized::joint`](crate::Factorized::joint).
    ///
    /// # Errors
    /// If a key is unknown, or a direction is undetermined.
    pub fn joint_covariance(&mut self, keys: &[&str]) -> Result<DMatrix<f64>, CovarianceError> {
        self.factorized()?.joint(keys)
    }
}
