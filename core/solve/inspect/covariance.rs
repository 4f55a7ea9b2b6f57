//! Covariances of estimates.
use crate::Solution;
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

/// If fewer than one variable in this many is asked for, each is computed by itself; else the selected inverse is faster.
const FEW: usize = 8;

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
    /// [`Factorized::marginals`](crate::Factorized::marginals).
    ///
    /// # Errors
    /// If a key is unknown, something is not constrained, or `graph` is not the one that was solved.
    pub fn marginals(&self, graph: &Graph, keys: &[&str]) -> Result<Vec<Marginal>, CovarianceError> {
        if let Some(unknown) = keys.iter().find(|key| !self.values.contains(key)) {
            return Err(CovarianceError::Unknown((*unknown).to_owned()));
        }
        let few = !keys.is_empty() && keys.len() * FEW < self.values.len();
        let all = self.ask(graph, |problem| {
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

    /// The leverage of each row of each factor; see [`Problem::leverages`].
    ///
    /// # Errors
    /// Those of [`Problem::leverages`], and where `graph` is not the one that was solved.
    pub fn leverages(&self, graph: &Graph) -> Result<Vec<Vec<f64>>, CovarianceError> {
        self.ask(graph, Problem::leverages)?
    }
}

impl Problem {
    /// The marginal covariance of each variable at the estimate; see [`Factorized::marginals`](crate::Factorized::marginals).
    ///
    /// # Errors
    /// If something is not constrained, or there is no memory.
    pub fn marginals(&mut self) -> Result<Vec<(Key, DMatrix<f64>)>, CovarianceError> {
        self.factorized()?.marginals()
    }

    /// The joint covariance of a few variables at the estimate; see [`Factorized::joint`](crate::Factorized::joint).
    ///
    /// # Errors
    /// If a key is unknown, or something is not constrained.
    pub fn joint_covariance(&mut self, keys: &[&str]) -> Result<DMatrix<f64>, CovarianceError> {
        self.factorized()?.joint(keys)
    }
}
