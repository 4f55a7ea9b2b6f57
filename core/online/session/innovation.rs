//! How factors that are not in the session agree with it.
use super::{CovarianceError, Session};
use manifactor_graph::{FactorEntry, GraphError, Key, Variable};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;
use std::ops::Range;

/// Why there is no innovation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InnovationError {
    /// Factors that do not fit the session: everything that is wrong, by their places in the list.
    #[error("the factors do not fit the session:{}", GraphError::list(.0))]
    Graph(Vec<GraphError>),
    /// A variable without a covariance.
    #[error(transparent)]
    Covariance(#[from] CovarianceError),
    /// A residual or a derivative that is not finite, or is not defined at the estimate.
    #[error("factor {factor} is not finite, or not defined, at the estimate")]
    NotDefined {
        /// Its place in the list.
        factor: usize,
    },
}

/// The residuals of some factors at the estimate, and how far off these may be where the factors are right: S = J Σ Jᵀ + R, Σ the
/// joint covariance of all their variables, R their noise. All whitened, so that R = I.
#[derive(Debug, Clone, PartialEq)]
pub struct Innovation {
    residual: DVector<f64>,
    covariance: DMatrix<f64>,
    rows: Vec<Range<usize>>,
    /// By factor, ln det 2πR.
    volumes: Vec<f64>,
}

/// What is not linear leaves the place of anything uncertain by this part of a measurement's standard deviation.
const KNOWN_TO: f64 = 0.1;

/// A factor, looked up and linearized at the estimate.
pub(crate) struct Linearized {
    pub(crate) variables: Vec<u32>,
    /// Whitened; rows that are not observed are left out.
    pub(crate) residual: DVector<f64>,
    pub(crate) jacobians: Vec<DMatrix<f64>>,
    /// ln det 2πR.
    pub(crate) volume: f64,
}

/// The joint covariance of some variables.
pub(crate) struct Joint {
    /// Where each has its block, by variable; they ascend.
    blocks: Vec<(u32, Range<usize>)>,
    covariance: DMatrix<f64>,
}

impl Session {
    /// How factors that are not in the session agree with it; all are between variables that are. Losses do not count.
    ///
    /// # Errors
    /// Where a factor does not fit the session or is not defined at the estimate, or a variable has no covariance.
    pub fn innovation(&self, factors: &[FactorEntry]) -> Result<Innovation, InnovationError> {
        let linearized: Vec<Linearized> = factors
            .iter()
            .enumerate()
            .map(|(i, entry)| self.linearized(i, entry))
            .collect::<Result<_, _>>()?;
        Ok(Innovation::new(&linearized, &self.joint_of(&linearized)?))
    }

    /// The joint covariance of all variables of some factors.
    pub(crate) fn joint_of(&self, factors: &[Linearized]) -> Result<Joint, CovarianceError> {
        let mut variables: Vec<u32> = factors.iter().flat_map(|one| &one.variables).copied().collect();
        variables.sort_unstable();
        variables.dedup();
        let covariance = self.covariance_of(&variables)?;
        let mut end = 0;
        let blocks = variables.into_iter().map(|v| {
            let first = end;
            end += self.dim(v);
            (v, first..end)
        });
        Ok(Joint { blocks: blocks.collect(), covariance })
    }

    pub(crate) fn is_parked(&self, variable: u32) -> bool {
        self.model.place(variable).parked
    }

    /// Looks a factor up, the `place`-th of a list, and linearizes it at the estimate.
    pub(crate) fn linearized(
        &self,
        place: usize,
        entry: &FactorEntry,
    ) -> Result<Linearized, InnovationError> {
        let mut errors = vec![];
        let resolved = entry.resolve(place, |key| self.find(key), &mut errors);
        let resolved = resolved.ok_or(InnovationError::Graph(errors))?;
        let undefined = InnovationError::NotDefined { factor: place };
        // what is still to come with the next update has no estimate yet
        let point = |key: &Key| {
            let missing = || CovarianceError::NoVariable { key: key.clone() };
            self.estimate(key.as_str()).ok_or_else(missing)
        };
        let points: Vec<Box<dyn Variable>> = entry.keys.iter().map(point).collect::<Result<_, _>>()?;
        let points: Vec<&dyn Variable> = points.iter().map(|point| &**point).collect();
        let residual = entry.factor.erased();
        if residual.is_defined(&points) != Some(true) {
            return Err(undefined);
        }
        let at = residual.linearize(&points).ok_or_else(|| undefined.clone())?;
        let w = resolved.whitener.matrix(at.residual.len());
        let observed: Vec<usize> = (0..w.nrows()).filter(|r| w[(*r, *r)] != 0.0).collect();
        let w = w.select_rows(&observed);
        let jacobians: Vec<DMatrix<f64>> = at.jacobians.iter().map(|j| &w * j).collect();
        let whitened = &w * DVector::from_vec(at.residual);
        let is_finite = whitened.iter().chain(jacobians.iter().flatten()).all(|x| x.is_finite());
        let scales: f64 = observed.iter().enumerate().map(|(i, r)| w[(i, *r)].abs().ln()).sum();
        let volume = observed.len() as f64 * TAU.ln() - 2.0 * scales;
        let variables = resolved.variables.to_vec();
        if is_finite {
            Ok(Linearized { variables, residual: whitened, jacobians, volume })
        } else {
            Err(undefined)
        }
    }
}

impl Innovation {
    /// Of factors, with the joint covariance of their variables.
    pub(crate) fn new(factors: &[Linearized], joint: &Joint) -> Self {
        let mut total = 0;
        let rows = factors.iter().map(|factor| {
            let first = total;
            total += factor.residual.len();
            first..total
        });
        let rows: Vec<Range<usize>> = rows.collect();
        let mut residual = DVector::zeros(total);
        let mut jacobian = DMatrix::zeros(total, joint.covariance.nrows());
        for (factor, rows) in factors.iter().zip(&rows) {
            residual.rows_range_mut(rows.clone()).copy_from(&factor.residual);
            for (v, block) in factor.variables.iter().zip(&factor.jacobians) {
                jacobian.view_range_mut(rows.clone(), joint.range(*v)).copy_from(block);
            }
        }
        let covariance =
            &jacobian * &joint.covariance * jacobian.transpose() + DMatrix::identity(total, total);
        Self { residual, covariance, rows, volumes: factors.iter().map(|factor| factor.volume).collect() }
    }

    /// What a factor costs at least, whatever is given.
    pub(crate) fn least_cost(&self, factor: usize) -> f64 {
        self.volumes[factor]
    }

    /// How far apart two factors of one measurement see what they are to, beside what is known: the measurement's own noise is in
    /// neither. `None` where they have other rows.
    pub(crate) fn apart(&self, a: usize, b: usize) -> Option<Misfit> {
        let (a_rows, b_rows) = (self.rows[a].clone(), self.rows[b].clone());
        let n = a_rows.len();
        if b_rows.len() != n {
            return None;
        }
        let block = |r: &Range<usize>, c: &Range<usize>| {
            self.covariance.view_range(r.clone(), c.clone()).into_owned()
        };
        let both = block(&a_rows, &b_rows);
        // each has the noise once: all of it but a part goes out again
        let noise = DMatrix::identity(n, n) * (2.0 - KNOWN_TO * KNOWN_TO);
        let s = block(&a_rows, &a_rows) + block(&b_rows, &b_rows) - &both - both.transpose() - noise;
        let apart = self.residual.rows_range(a_rows) - self.residual.rows_range(b_rows);
        let s = s.cholesky()?;
        let squared = apart.dot(&s.solve(&apart));
        let volume = self.volumes[a] + 2.0 * s.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>();
        Some(Misfit { squared, volume })
    }
}

impl Joint {
    fn range(&self, variable: u32) -> Range<usize> {
        let place = self.blocks.binary_search_by_key(&variable, |(v, _)| *v);
        place.map_or(0..0, |place| self.blocks[place].1.clone())
    }

    /// The covariance of one of the variables.
    pub(crate) fn own(&self, variable: u32) -> DMatrix<f64> {
        let range = self.range(variable);
        self.covariance.view_range(range.clone(), range).into_owned()
    }
}

/// Factors that are taken for right, one after the other, each given those before it: a Cholesky factorization of S by rows.
#[derive(Debug, Clone)]
pub struct Given<'a> {
    of: &'a Innovation,
    /// Rows of L, and L⁻¹r.
    factor: Vec<Vec<f64>>,
    rest: Vec<f64>,
    /// The rows of S that they are of.
    rows: Vec<usize>,
    /// How many rows each factor has added.
    added: Vec<usize>,
}

/// How a factor agrees with what is given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Misfit {
    /// The squared Mahalanobis distance of its residual: χ² of its rows, where it is right.
    pub squared: f64,
    /// ln det 2πS.
    pub volume: f64,
}

impl Misfit {
    /// -2 ln p of the residual.
    pub fn cost(&self) -> f64 {
        self.squared + self.volume
    }
}

impl<'a> Given<'a> {
    /// Nothing is given but the session.
    pub fn nothing(of: &'a Innovation) -> Self {
        Self { of, factor: vec![], rest: vec![], rows: vec![], added: vec![] }
    }

    /// Takes a factor for right, and tells how it agrees with those that were given before.
    pub fn push(&mut self, factor: usize) -> Misfit {
        let mut misfit = Misfit { squared: 0.0, volume: self.of.volumes[factor] };
        for row in self.of.rows[factor].clone() {
            let mut l = Vec::with_capacity(self.rows.len() + 1);
            for (j, other) in self.rows.iter().enumerate() {
                let known: f64 = l.iter().zip(&self.factor[j]).map(|(a, b): (&f64, &f64)| a * b).sum();
                l.push((self.of.covariance[(row, *other)] - known) / self.factor[j][j]);
            }
            // S = I + …, so that what is left is 1 or more but for rounding
            let pivot =
                (self.of.covariance[(row, row)] - l.iter().map(|x| x * x).sum::<f64>()).max(1.0).sqrt();
            let expected: f64 = l.iter().zip(&self.rest).map(|(a, b)| a * b).sum();
            let rest = (self.of.residual[row] - expected) / pivot;
            l.push(pivot);
            misfit.squared += rest * rest;
            misfit.volume += 2.0 * pivot.ln();
            self.factor.push(l);
            self.rest.push(rest);
            self.rows.push(row);
        }
        self.added.push(self.of.rows[factor].len());
        misfit
    }

    /// Takes the last factor back.
    pub fn pop(&mut self) {
        let left = self.rows.len() - self.added.pop().unwrap_or(0);
        self.factor.truncate(left);
        self.rest.truncate(left);
        self.rows.truncate(left);
    }
}
