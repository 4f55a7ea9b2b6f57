//! Gaussian noise of a measurement, and whitening.
//!
//! Every Gaussian noise has one of four forms of a square-root information W. The whitened residual is W r,
//! the information Ω = WᵀW. Rows that are not observed have a zero row and column in W.
mod whiteners;

use nalgebra::{Cholesky, DMatrix};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

pub(crate) use whiteners::Whiteners;

/// Noise of a measurement. Default: unit.
///
/// In documents one of `{ sigma = 0.1 }`, `{ sigmas = [0.1, 0.2] }`, `{ covariance = [[…], […]] }`,
/// `{ information = [[…], […]] }` or `{}`. Add `observed = [true, false, …]` if some rows of the residual
/// were not measured.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "NoiseDocument", into = "NoiseDocument")]
#[schemars(with = "NoiseDocument")]
pub struct Noise {
    model: NoiseModel,
    observed: Option<Vec<bool>>,
}

#[derive(Debug, Clone, Default, PartialEq)]
enum NoiseModel {
    #[default]
    Unit,
    Isotropic(f64),
    Diagonal(Vec<f64>),
    Covariance(DMatrix<f64>),
    Information(DMatrix<f64>),
}

/// Noise, as written in documents.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Noise")]
struct NoiseDocument {
    /// Standard deviation of every row, in the units of the row.
    #[serde(default, deserialize_with = "present", skip_serializing_if = "Option::is_none")]
    sigma: Option<f64>,
    /// Standard deviation of each row.
    #[serde(default, deserialize_with = "present", skip_serializing_if = "Option::is_none")]
    sigmas: Option<Vec<f64>>,
    /// Covariance matrix, by rows: symmetric and positive definite.
    #[serde(default, deserialize_with = "present", skip_serializing_if = "Option::is_none")]
    covariance: Option<Vec<Vec<f64>>>,
    /// Information matrix, by rows: symmetric and positive definite.
    #[serde(default, deserialize_with = "present", skip_serializing_if = "Option::is_none")]
    information: Option<Vec<Vec<f64>>>,
    /// Mask of the measured rows of the residual. Default: all.
    #[serde(default, deserialize_with = "present", skip_serializing_if = "Option::is_none")]
    observed: Option<Vec<bool>>,
}

/// Reads a field that is given. `null` is an error: programs write it in place of NaN, and it must not mean unit noise.
fn present<'de, T: Deserialize<'de>, D: Deserializer<'de>>(value: D) -> Result<Option<T>, D::Error> {
    T::deserialize(value).map(Some)
}

/// An error in a noise model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoiseError {
    /// A standard deviation that is not a positive number.
    #[error("a standard deviation must be a finite number above zero, got {0}")]
    NotPositive(f64),
    /// A matrix with rows of different lengths.
    #[error("expected a square matrix, got {rows} rows of which row {row} has {columns} entries")]
    NotSquare {
        /// Number of rows.
        rows: usize,
        /// The row whose length differs, from 0.
        row: usize,
        /// Its length.
        columns: usize,
    },
    /// A matrix with an entry that is infinite or NaN.
    #[error("entry ({0}, {1}) of the matrix is not finite")]
    NotFinite(usize, usize),
    /// A matrix that differs from its transpose.
    #[error("the matrix is not symmetric: entry ({row}, {column}) is {upper}, its mirror {lower}")]
    NotSymmetric {
        /// Row, from 0.
        row: usize,
        /// Column, from 0.
        column: usize,
        /// The entry.
        upper: f64,
        /// The entry mirrored at the diagonal.
        lower: f64,
    },
    /// A matrix with a direction of zero or negative variance.
    #[error("the matrix is not positive definite: its smallest eigenvalue is {smallest:e}")]
    NotPositiveDefinite {
        /// Smallest eigenvalue.
        smallest: f64,
    },
    /// More than one form at once.
    #[error("expected one of sigma, sigmas, covariance, information; got {0}")]
    Ambiguous(String),
    /// A noise whose size differs from the number of residual rows.
    #[error("the noise has {}, the residual {expected}{}", rows(.found), in_parentheses(.names))]
    Dimension {
        /// Rows of the residual.
        expected: usize,
        /// Rows of the noise.
        found: usize,
        /// Names of the residual's rows, if it has any.
        names: &'static [&'static str],
    },
    /// A measurement without an observed row.
    #[error("no row is observed; leave the factor out instead")]
    NothingObserved,
}

impl NoiseError {
    /// Returns the error with the names of the residual's rows.
    #[must_use]
    pub fn with_names(self, rows: &'static [&'static str]) -> Self {
        match self {
            Self::Dimension { expected, found, .. } => Self::Dimension { expected, found, names: rows },
            other => other,
        }
    }
}

fn rows(n: &usize) -> String {
    format!("{n} row{}", if *n == 1 { "" } else { "s" })
}

fn in_parentheses(names: &[&str]) -> String {
    if names.is_empty() { String::new() } else { format!(" ({})", names.join(", ")) }
}

fn sigma(s: f64) -> Result<f64, NoiseError> {
    // 1/σ must be finite too
    if s > 0.0 && s.is_finite() && (1.0 / s).is_finite() { Ok(s) } else { Err(NoiseError::NotPositive(s)) }
}

/// Checks that the matrix is symmetric and positive definite, and returns it.
fn spd(m: DMatrix<f64>) -> Result<DMatrix<f64>, NoiseError> {
    let n = m.nrows();
    let scale = m.amax();
    for r in 0..n {
        for c in 0..n {
            if !m[(r, c)].is_finite() {
                return Err(NoiseError::NotFinite(r, c));
            }
            if (m[(r, c)] - m[(c, r)]).abs() > 1e-9 * scale {
                return Err(NoiseError::NotSymmetric {
                    row: r,
                    column: c,
                    upper: m[(r, c)],
                    lower: m[(c, r)],
                });
            }
        }
    }
    if n == 0 || Cholesky::new(m.clone()).is_none() {
        let smallest = if n == 0 { 0.0 } else { m.symmetric_eigenvalues().min() };
        return Err(NoiseError::NotPositiveDefinite { smallest });
    }
    Ok(m)
}

impl Noise {
    /// Makes the noise with standard deviation 1 in every row.
    pub fn unit() -> Self {
        Self::default()
    }
    /// Makes a noise with equal standard deviation in every row.
    ///
    /// # Errors
    /// If it is not a positive number.
    pub fn sigma(s: f64) -> Result<Self, NoiseError> {
        Ok(NoiseModel::Isotropic(sigma(s)?).into())
    }
    /// Makes a noise with one standard deviation for each row.
    ///
    /// # Errors
    /// If one is not a positive number.
    pub fn sigmas(s: &[f64]) -> Result<Self, NoiseError> {
        Ok(NoiseModel::Diagonal(s.iter().map(|s| sigma(*s)).collect::<Result<_, _>>()?).into())
    }
    /// Makes a noise from a covariance matrix.
    ///
    /// # Errors
    /// If it is not symmetric and positive definite.
    pub fn covariance(m: DMatrix<f64>) -> Result<Self, NoiseError> {
        Ok(NoiseModel::Covariance(spd(m)?).into())
    }
    /// Makes a noise from an information matrix, the inverse of a covariance.
    ///
    /// # Errors
    /// If it is not symmetric and positive definite.
    pub fn information(m: DMatrix<f64>) -> Result<Self, NoiseError> {
        Ok(NoiseModel::Information(spd(m)?).into())
    }
    /// Returns this noise for a measurement of the marked rows only. The remaining rows are marginalised.
    #[must_use]
    pub fn observing(mut self, rows: &[bool]) -> Self {
        self.observed = Some(rows.to_vec());
        self
    }
    /// Returns this noise with its information multiplied by `weight`, as for a measurement that counts
    /// `weight` times.
    ///
    /// # Errors
    /// If the result is not positive and finite.
    pub fn weighted(&self, weight: f64) -> Result<Self, NoiseError> {
        let spread = sigma(weight)?.sqrt().recip();
        let model = match &self.model {
            NoiseModel::Unit => NoiseModel::Isotropic(sigma(spread)?),
            NoiseModel::Isotropic(s) => NoiseModel::Isotropic(sigma(s * spread)?),
            NoiseModel::Diagonal(s) => {
                NoiseModel::Diagonal(s.iter().map(|s| sigma(s * spread)).collect::<Result<_, _>>()?)
            }
            NoiseModel::Covariance(m) => NoiseModel::Covariance(spd(m / weight)?),
            NoiseModel::Information(m) => NoiseModel::Information(spd(m * weight)?),
        };
        Ok(Self { model, observed: self.observed.clone() })
    }
    /// Returns the mask of the measured rows; `None` for all.
    pub fn observed(&self) -> Option<&[bool]> {
        self.observed.as_deref()
    }
    /// Returns whether this is unit noise on all rows.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// Returns W in its cheapest form, for a residual with `rows` rows.
    ///
    /// # Errors
    /// If the noise has a different number of rows, or observes none.
    pub fn whitener(&self, rows: usize) -> Result<Whitener, NoiseError> {
        let check = |found: usize| match found == rows {
            true => Ok(()),
            false => Err(NoiseError::Dimension { expected: rows, found, names: &[] }),
        };
        match &self.model {
            NoiseModel::Diagonal(s) => check(s.len())?,
            NoiseModel::Covariance(m) | NoiseModel::Information(m) => check(m.nrows())?,
            NoiseModel::Unit | NoiseModel::Isotropic(_) => {}
        }
        let Some(observed) = self.observed.as_deref().filter(|o| o.iter().any(|o| !o)) else {
            if let Some(o) = &self.observed {
                check(o.len())?;
            }
            return self.model.whitener(None);
        };
        check(observed.len())?;
        if observed.iter().all(|o| !o) {
            return Err(NoiseError::NothingObserved);
        }
        self.model.whitener(Some(observed))
    }

    /// Returns the information matrix Ω for a residual with `rows` rows; zero in rows that are not
    /// observed.
    ///
    /// # Errors
    /// As [`Noise::whitener`].
    pub fn information_matrix(&self, rows: usize) -> Result<DMatrix<f64>, NoiseError> {
        if let (NoiseModel::Information(m), None) = (&self.model, &self.observed)
            && m.nrows() == rows
        {
            return Ok(m.clone());
        }
        let w = self.whitener(rows)?.matrix(rows);
        Ok(w.tr_mul(&w))
    }
}

impl From<NoiseModel> for Noise {
    fn from(model: NoiseModel) -> Self {
        Noise { model, observed: None }
    }
}

impl NoiseModel {
    fn whitener(&self, observed: Option<&[bool]>) -> Result<Whitener, NoiseError> {
        let mask = |s: f64, i: usize| if observed.is_none_or(|o| o[i]) { 1.0 / s } else { 0.0 };
        Ok(match (self, observed) {
            (NoiseModel::Unit, None) => Whitener::Unit,
            (NoiseModel::Unit, Some(o)) => Whitener::Diagonal((0..o.len()).map(|i| mask(1.0, i)).collect()),
            (NoiseModel::Isotropic(s), None) => Whitener::Isotropic(1.0 / s),
            (NoiseModel::Isotropic(s), Some(o)) => {
                Whitener::Diagonal((0..o.len()).map(|i| mask(*s, i)).collect())
            }
            (NoiseModel::Diagonal(s), _) => {
                Whitener::Diagonal(s.iter().enumerate().map(|(i, s)| mask(*s, i)).collect())
            }
            (NoiseModel::Information(m), None) => Whitener::Full(root(m)?),
            (NoiseModel::Covariance(m), None) => Whitener::Full(inverse_root(m)?),
            (NoiseModel::Information(m), Some(o)) => {
                Whitener::Full(marginal_root(&cholesky(m)?.inverse(), o)?)
            }
            (NoiseModel::Covariance(m), Some(o)) => Whitener::Full(marginal_root(m, o)?),
        })
    }
}

fn cholesky(m: &DMatrix<f64>) -> Result<Cholesky<f64, nalgebra::Dyn>, NoiseError> {
    Cholesky::new(m.clone()).ok_or_else(|| not_positive_definite(m))
}

/// Returns the upper triangular W with WᵀW = m. Cholesky by rows in a single allocation, since a graph has
/// one W for each factor.
fn root(m: &DMatrix<f64>) -> Result<DMatrix<f64>, NoiseError> {
    let (n, mut w) = (m.nrows(), m.clone());
    for k in 0..n {
        let pivot = w[(k, k)];
        if pivot.is_nan() || pivot <= 0.0 {
            return Err(not_positive_definite(m));
        }
        let scale = pivot.sqrt().recip();
        for j in k..n {
            w[(k, j)] *= scale;
            w[(j, k)] = if j == k { w[(k, k)] } else { 0.0 };
        }
        for j in k + 1..n {
            for i in k + 1..=j {
                w[(i, j)] -= w[(k, i)] * w[(k, j)];
            }
        }
    }
    Ok(w)
}

fn not_positive_definite(m: &DMatrix<f64>) -> NoiseError {
    NoiseError::NotPositiveDefinite { smallest: m.clone().symmetric_eigenvalues().min() }
}

/// Returns the upper triangular W with WᵀW = m⁻¹: m = U Uᵀ by Cholesky from the last row up, W = U⁻¹.
fn inverse_root(m: &DMatrix<f64>) -> Result<DMatrix<f64>, NoiseError> {
    let n = m.nrows();
    let flip = |m: &DMatrix<f64>| DMatrix::from_fn(n, n, |r, c| m[(n - 1 - r, n - 1 - c)]);
    let u = flip(&cholesky(&flip(m))?.l());
    let w = u.solve_upper_triangular(&DMatrix::identity(n, n));
    w.ok_or(NoiseError::NotPositiveDefinite { smallest: 0.0 })
}

/// Returns W for the observed rows of a covariance; zero elsewhere.
fn marginal_root(covariance: &DMatrix<f64>, observed: &[bool]) -> Result<DMatrix<f64>, NoiseError> {
    let rows: Vec<usize> = (0..observed.len()).filter(|i| observed[*i]).collect();
    let small = DMatrix::from_fn(rows.len(), rows.len(), |r, c| covariance[(rows[r], rows[c])]);
    let root = inverse_root(&small)?;
    let mut w = DMatrix::zeros(observed.len(), observed.len());
    for (r, &row) in rows.iter().enumerate() {
        for (c, &column) in rows.iter().enumerate() {
            w[(row, column)] = root[(r, c)];
        }
    }
    Ok(w)
}

impl TryFrom<NoiseDocument> for Noise {
    type Error = NoiseError;
    fn try_from(spec: NoiseDocument) -> Result<Self, NoiseError> {
        let given: Vec<&str> = [
            ("sigma", spec.sigma.is_some()),
            ("sigmas", spec.sigmas.is_some()),
            ("covariance", spec.covariance.is_some()),
            ("information", spec.information.is_some()),
        ]
        .into_iter()
        .filter_map(|(name, given)| given.then_some(name))
        .collect();
        if given.len() > 1 {
            return Err(NoiseError::Ambiguous(given.join(" and ")));
        }
        let noise = match (spec.sigma, spec.sigmas, spec.covariance, spec.information) {
            (Some(s), ..) => Noise::sigma(s)?,
            (_, Some(s), ..) => Noise::sigmas(&s)?,
            (_, _, Some(m), _) => Noise::covariance(matrix(&m)?)?,
            (_, _, _, Some(m)) => Noise::information(matrix(&m)?)?,
            _ => Noise::unit(),
        };
        Ok(Noise { observed: spec.observed, ..noise })
    }
}

impl From<Noise> for NoiseDocument {
    fn from(noise: Noise) -> NoiseDocument {
        let rows = |m: DMatrix<f64>| m.row_iter().map(|r| r.iter().copied().collect()).collect();
        let mut spec = NoiseDocument { observed: noise.observed, ..NoiseDocument::default() };
        match noise.model {
            NoiseModel::Unit => {}
            NoiseModel::Isotropic(s) => spec.sigma = Some(s),
            NoiseModel::Diagonal(s) => spec.sigmas = Some(s),
            NoiseModel::Covariance(m) => spec.covariance = Some(rows(m)),
            NoiseModel::Information(m) => spec.information = Some(rows(m)),
        }
        spec
    }
}

fn matrix(rows: &[Vec<f64>]) -> Result<DMatrix<f64>, NoiseError> {
    let n = rows.len();
    match rows.iter().position(|r| r.len() != n) {
        Some(row) => Err(NoiseError::NotSquare { rows: n, row, columns: rows[row].len() }),
        None => Ok(DMatrix::from_fn(n, n, |r, c| rows[r][c])),
    }
}

/// The square-root information W of one factor.
#[derive(Debug, Clone, PartialEq)]
pub enum Whitener {
    /// The identity.
    Unit,
    /// A multiple of the identity.
    Isotropic(f64),
    /// The diagonal; zero in rows that are not observed.
    Diagonal(Vec<f64>),
    /// Upper triangular.
    Full(DMatrix<f64>),
}

impl Whitener {
    /// Returns W as a matrix with `rows` rows.
    pub fn matrix(&self, rows: usize) -> DMatrix<f64> {
        match self {
            Whitener::Unit => DMatrix::identity(rows, rows),
            Whitener::Isotropic(w) => DMatrix::identity(rows, rows) * *w,
            Whitener::Diagonal(w) => DMatrix::from_diagonal(&w.clone().into()),
            Whitener::Full(w) => w.clone(),
        }
    }
}
