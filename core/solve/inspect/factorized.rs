//! The linear system at the estimate, factorized once for any number of queries.
use crate::inspect::CovarianceError;
use crate::inspect::null_space::undetermined;
use crate::linear::Cholesky;
use crate::linear::system::NoFactor;
use crate::problem::{Problem, ProblemVariable};
use manifactor_graph::Key;
use nalgebra::DMatrix;
use std::time::Instant;

/// The factorization of H = JᵀJ at the estimate, without damping, with the robust weights at the estimate.
/// Covariances are blocks of H⁻¹, in the units of the noise. Fixed variables and directions have zeros, and so have
/// coordinates that are held at a bound.
///
/// ```
/// # use manifactor_solve::Problem;
/// # fn example(problem: &mut Problem) -> Result<(), Box<dyn std::error::Error>> {
/// let mut system = problem.factorized()?;
/// let pose = system.marginal("x7")?;
/// let both = system.joint(&["x7", "l2"])?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Factorized<'a> {
    pub(super) problem: &'a mut Problem,
}

impl Problem {
    /// Returns the factorization of H at the estimate. Reuses the last one if neither the estimate nor a
    /// weight nor a measurement has changed since.
    ///
    /// # Errors
    /// If a direction is undetermined, or there is no memory for a factor.
    pub fn factorized(&mut self) -> Result<Factorized<'_>, CovarianceError> {
        self.linearize_once();
        let revision = Some(self.model.revision());
        if self.determined != revision || !self.system.is_factorized() {
            self.determined = None;
            let failed = match self.factorize_directly() {
                Err(NoFactor::OutOfMemory) => return Err(self.out_of_memory()),
                done => done.is_err(),
            };
            if let Some(open) = undetermined(self, failed, 0.0) {
                return Err(CovarianceError::Indeterminate(open));
            }
            // the search may have replaced the factorization by its own
            if !self.system.is_factorized() {
                self.factorize_directly().map_err(|_| CovarianceError::NotPositiveDefinite)?;
            }
            self.determined = revision;
        }
        Ok(Factorized { problem: self })
    }

    fn factorize_directly(&mut self) -> Result<(), NoFactor> {
        let clock = Instant::now();
        let done = self.system.factorize_directly(None);
        self.times.factorize += clock.elapsed().as_secs_f64();
        done
    }

    pub(crate) fn out_of_memory(&self) -> CovarianceError {
        CovarianceError::OutOfMemory { unknowns: self.dim() }
    }
}

/// Returns the scalar unknown of each tangent direction; `None` for one that is fixed or held at a bound.
fn free_unknowns(place: &ProblemVariable, at_bound: &[usize]) -> impl Iterator<Item = Option<usize>> {
    place.unknowns().map(|unknown| unknown.filter(|unknown| !at_bound.contains(unknown)))
}

impl Factorized<'_> {
    /// Returns the covariance of a variable in its tangent space. Takes one half solve per tangent
    /// dimension, each along one path of the elimination tree.
    ///
    /// # Errors
    /// If there is no such variable.
    pub fn marginal(&mut self, key: &str) -> Result<DMatrix<f64>, CovarianceError> {
        self.joint(&[key])
    }

    /// Returns the joint covariance of several variables, in the order of `keys`.
    ///
    /// # Errors
    /// If a key is unknown.
    pub fn joint(&mut self, keys: &[&str]) -> Result<DMatrix<f64>, CovarianceError> {
        // the unknown of each row of the result, `None` for a direction that is held
        let mut unknowns = vec![];
        for key in keys {
            let place = self.problem.model.place(key);
            let place = place.ok_or_else(|| CovarianceError::Unknown((*key).to_owned()))?;
            unknowns.extend(free_unknowns(place, self.problem.system.held_at_bound()));
        }
        // H⁻¹ = L⁻ᵀL⁻¹: entries are products of columns of L⁻¹, which are zero off their paths
        let dim = self.problem.dim();
        let cholesky = self.cholesky()?;
        let mut half_solved = |unknown: &Option<usize>| {
            let mut x = vec![0.0; if unknown.is_some() { dim } else { 0 }];
            let path = unknown.map_or(vec![], |i| cholesky.solve_unit(i, &mut x));
            (x, path)
        };
        let columns: Vec<_> = unknowns.iter().map(&mut half_solved).collect();
        let product = |r: usize, c: usize| {
            let ((x, path), (y, _)) = (&columns[r], &columns[c]);
            if y.is_empty() {
                return 0.0;
            }
            let along = |range: &std::ops::Range<usize>| -> f64 {
                x[range.clone()].iter().zip(&y[range.clone()]).map(|(a, b)| a * b).sum()
            };
            path.iter().map(along).sum()
        };
        let mut joint = DMatrix::zeros(unknowns.len(), unknowns.len());
        for c in 0..unknowns.len() {
            for r in c..unknowns.len() {
                joint[(r, c)] = product(r, c);
                joint[(c, r)] = joint[(r, c)];
            }
        }
        Ok(joint)
    }

    /// Returns the covariance of each variable, in the order of the values. All of them together take about
    /// as long as ten factorizations.
    ///
    /// # Errors
    /// If there is no memory.
    pub fn marginals(&mut self) -> Result<Vec<(Key, DMatrix<f64>)>, CovarianceError> {
        let out_of_memory = self.problem.out_of_memory();
        let Problem { model, system, .. } = &mut *self.problem;
        let at_bound = system.held_at_bound().to_vec();
        let inverse =
            system.cholesky().and_then(|cholesky| cholesky.selected_inverse()).ok_or(out_of_memory)?;
        let marginals = model.variables.iter().map(|place| {
            let unknowns: Vec<_> = free_unknowns(place, &at_bound).collect();
            let entry = |r: usize, c: usize| match (unknowns[r], unknowns[c]) {
                (Some(row), Some(column)) => inverse.get(row, column).unwrap_or(0.0),
                _ => 0.0,
            };
            (place.key.clone(), DMatrix::from_fn(unknowns.len(), unknowns.len(), entry))
        });
        Ok(marginals.collect())
    }

    pub(super) fn cholesky(&mut self) -> Result<&mut Cholesky, CovarianceError> {
        let out_of_memory = self.problem.out_of_memory();
        self.problem.system.cholesky().ok_or(out_of_memory)
    }
}
