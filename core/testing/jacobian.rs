//! The Jacobian law: analytic = automatic = numeric.
mod kink;

use crate::differences::differentiate;
use crate::error::{LawError, json_of_all, json_of_factor};
use manifactor_graph::{Factor, Linearization, Variable};

pub use kink::Kink;
use kink::{hull, sides};

/// Distance of the nearby points that describe the residual around a point, in units of the tangent.
const NEARBY_DISTANCE: f64 = 1e-4;

/// Settings of the Jacobian law. Tolerances are relative to the largest entry, or to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JacobianLaw {
    /// Longest step of the differences, in units of the tangent. The shortest step is 1/32768 of it.
    pub step: f64,
    /// Tolerance between the analytic and the automatic Jacobian.
    pub analytic: f64,
    /// Tolerance between the automatic and the numeric Jacobian.
    pub numeric: f64,
    /// If true, the residual may have a kink or a jump at the point. The derivative there must then lie
    /// between the derivatives of both sides.
    pub kinks: bool,
}

impl Default for JacobianLaw {
    fn default() -> Self {
        Self { step: 1e-2, analytic: 1e-9, numeric: 1e-6, kinks: false }
    }
}

/// Checks [`JacobianLaw::check`] with the default tolerances.
///
/// # Errors
/// See [`JacobianLaw::check`].
pub fn jacobian_law(factor: &dyn Factor, variables: &[&dyn Variable]) -> Result<(), LawError> {
    JacobianLaw::default().check(factor, variables)
}

/// The result at a point at which the law holds.
#[derive(Debug, Clone)]
pub struct Examined {
    /// The residual and the Jacobian that solvers use.
    pub linearization: Linearization,
    /// The entry with the largest difference from numeric differentiation; `None` if there was no entry to
    /// compare.
    pub worst: Option<JacobianEntry>,
    /// Entries without a derivative at this point.
    pub kinks: Vec<Kink>,
}

/// An entry of a Jacobian, computed in two ways.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JacobianEntry {
    /// Position of the variable, counted from 0.
    pub variable: usize,
    /// The tangent direction, counted from 0.
    pub column: usize,
    /// The row, counted from 0.
    pub row: usize,
    /// Actual value.
    pub found: f64,
    /// Expected value.
    pub expected: f64,
    /// Difference, relative to the largest entry of the block or to 1; infinite if it is NaN.
    pub error: f64,
}

/// A factor at a point.
pub(crate) struct At<'a> {
    pub factor: &'a dyn Factor,
    pub variables: &'a [&'a dyn Variable],
}

impl JacobianLaw {
    /// Checks that the Jacobian in use agrees with the automatic one, and that this agrees with differences
    /// through `retract`. Every entry has to be written and finite, and all methods have to give equal
    /// residuals.
    ///
    /// The differences through `retract` also test the seeds of the manifolds.
    ///
    /// # Errors
    /// The entry with the largest difference. [`LawError::NotDefined`] if the factor is not defined, so that
    /// nothing was checked.
    pub fn check(&self, factor: &dyn Factor, variables: &[&dyn Variable]) -> Result<(), LawError> {
        self.examine(factor, variables).map(|_| ())
    }

    /// Checks the law like [`JacobianLaw::check`] and returns the details of a point at which it holds.
    ///
    /// # Errors
    /// See [`JacobianLaw::check`].
    pub fn examine(&self, factor: &dyn Factor, variables: &[&dyn Variable]) -> Result<Examined, LawError> {
        let (residual, point, at) = (factor.erased(), || json_of_all(variables), At { factor, variables });
        let wrong = || LawError::WrongVariables { factor: json_of_factor(factor), point: point() };
        if !residual.is_defined(variables).ok_or_else(wrong)? {
            return Err(LawError::NotDefined { factor: json_of_factor(factor), point: point() });
        }
        let value = residual.residual(variables).ok_or_else(wrong)?;
        if let Some(row) = value.iter().position(|r| !r.is_finite()) {
            let found = value[row];
            return Err(LawError::NotFinite { row, found, factor: json_of_factor(factor), point: point() });
        }
        let used = residual.linearize(variables).ok_or_else(wrong)?;
        let automatic = residual.autodiff(variables).ok_or_else(wrong)?;
        same_residual("residual of autodiff", factor, variables, &automatic.residual, &value, self.analytic)?;
        same_residual("residual of linearize", factor, variables, &used.residual, &value, self.analytic)?;

        let entries = compare(&used, |v, c, r| Some(automatic.jacobians[v][(r, c)]));
        at.require("analytic against automatic Jacobian", &entries, self.analytic)?;

        let numeric: Vec<Vec<_>> = (0..variables.len())
            .map(|v| {
                let dim = variables[v].erased().dim();
                (0..dim).map(|c| differentiate(value.len(), self.step, |h| at.along(v, c, h))).collect()
            })
            .collect();
        let entries = compare(&automatic, |v, c, r| numeric[v][c].as_ref().map(|column| column[r].value));
        let (entries, kinks) = if self.kinks {
            // close to a singularity the finite difference is inaccurate; its own error estimate says so
            let inexact = |e: &JacobianEntry| {
                numeric[e.variable][e.column].as_ref().is_some_and(|c| {
                    10.0 * c[e.row].error > (e.found - e.expected).abs() && c[e.row].error.is_finite()
                })
            };
            let told = |e: &JacobianEntry| e.error <= self.numeric || !inexact(e);
            self.set_aside(&at, entries.into_iter().filter(told).collect())
        } else {
            (entries, vec![])
        };
        let worst = at.require("automatic Jacobian against differences", &entries, self.numeric)?;
        Ok(Examined { linearization: used, worst, kinks })
    }

    /// Separates the entries that differ because there is no derivative: kinks and jumps.
    fn set_aside(&self, at: &At<'_>, entries: Vec<JacobianEntry>) -> (Vec<JacobianEntry>, Vec<Kink>) {
        let rows = entries.iter().map(|e| e.row + 1).max().unwrap_or(0);
        let mut kinks = vec![];
        let kept = entries.into_iter().filter(|entry| {
            if entry.error <= self.numeric || entry.found.is_nan() {
                return true;
            }
            let of = |h: f64| at.along(entry.variable, entry.column, h);
            let kink = sides(rows, self.step, of).and_then(|sides| sides.kink(entry));
            let kink = kink.or_else(|| hull(&at.nearby(entry), entry));
            kinks.extend(kink);
            kink.is_none()
        });
        (kept.collect(), kinks)
    }
}

impl At<'_> {
    /// Returns the residual at distance `h` along a tangent direction; `None` if it is not defined there.
    pub(crate) fn along(&self, variable: usize, column: usize, h: f64) -> Option<Vec<f64>> {
        let moved = self.step(variable, column, h)?;
        let mut variables = self.variables.to_vec();
        variables[variable] = &*moved;
        let residual = self.factor.erased();
        if residual.is_defined(&variables)? { residual.residual(&variables) } else { None }
    }

    /// Returns the variables at distance `h` along a tangent direction.
    pub(crate) fn moved(&self, variable: usize, column: usize, h: f64) -> Option<Vec<Box<dyn Variable>>> {
        let mut variables: Vec<_> = self.variables.iter().map(|x| x.erased().clone_box()).collect();
        variables[variable] = self.step(variable, column, h)?;
        Some(variables)
    }

    fn step(&self, variable: usize, column: usize, h: f64) -> Option<Box<dyn Variable>> {
        let mut delta = vec![0.0; self.variables[variable].erased().dim()];
        delta[column] = h;
        self.variables[variable].erased().retract(&delta)
    }

    /// Returns this entry of the automatic Jacobian at points nearby. If three pieces of a residual meet,
    /// these show more than both sides along one direction.
    fn nearby(&self, entry: &JacobianEntry) -> Vec<f64> {
        let at = |round: usize| {
            let moved = self.variables.iter().enumerate().map(|(v, x)| {
                // any spread over directions is sufficient
                let part = |i: usize| NEARBY_DISTANCE * ((31 * round + 17 * i + 7 * v + 1) as f64).sin();
                let delta: Vec<f64> = (0..x.erased().dim()).map(part).collect();
                x.erased().retract(&delta)
            });
            let moved: Vec<_> = moved.collect::<Option<_>>()?;
            let moved: Vec<&dyn Variable> = moved.iter().map(|x| &**x).collect();
            let residual = self.factor.erased();
            let defined = residual.is_defined(&moved)?;
            let jacobian = residual.autodiff(&moved).filter(|_| defined)?;
            jacobian.jacobians[entry.variable].get((entry.row, entry.column)).copied()
        };
        (0..16).filter_map(at).collect()
    }

    /// Returns the entry with the largest difference, or an error if it exceeds `tolerance`.
    fn require(
        &self,
        law: &'static str,
        entries: &[JacobianEntry],
        tolerance: f64,
    ) -> Result<Option<JacobianEntry>, LawError> {
        let worst = entries.iter().max_by(|a, b| a.error.total_cmp(&b.error)).copied();
        match worst {
            Some(JacobianEntry { variable, column, row, found, expected, error }) if error > tolerance => {
                let of = self.variables[variable];
                Err(LawError::Jacobian {
                    law,
                    row,
                    variable,
                    of: of.typetag_name(),
                    direction: of.erased().tangent().get(column).copied().unwrap_or("?"),
                    found,
                    expected,
                    factor: json_of_factor(self.factor),
                    point: json_of_all(self.variables),
                })
            }
            worst => Ok(worst),
        }
    }
}

/// Compares each entry with `expected(variable, column, row)`. Entries without an expected value are left
/// out.
fn compare(
    found: &Linearization,
    expected: impl Fn(usize, usize, usize) -> Option<f64>,
) -> Vec<JacobianEntry> {
    let mut entries = vec![];
    for (variable, block) in found.jacobians.iter().enumerate() {
        let scale = block.iter().fold(1.0, |max: f64, x| max.max(x.abs()));
        for column in 0..block.ncols() {
            for row in 0..block.nrows() {
                let found = block[(row, column)];
                let Some(expected) = expected(variable, column, row) else { continue };
                let error = (found - expected).abs() / scale;
                // NaN counts as the largest error
                let error = if error.is_nan() { f64::INFINITY } else { error };
                entries.push(JacobianEntry { variable, column, row, found, expected, error });
            }
        }
    }
    entries
}

/// Fails if two residuals differ by more than `tolerance`, relative to the largest entry or to 1.
pub(crate) fn same_residual(
    law: &'static str,
    factor: &dyn Factor,
    variables: &[&dyn Variable],
    found: &[f64],
    expected: &[f64],
    tolerance: f64,
) -> Result<(), LawError> {
    let scale = expected.iter().fold(1.0, |max: f64, x| max.max(x.abs()));
    let errors = found.iter().zip(expected).map(|(f, e)| (f - e).abs() / scale);
    let errors = errors.map(|e| if e.is_nan() { f64::INFINITY } else { e });
    let worst = errors.enumerate().filter(|(_, e)| *e > tolerance).max_by(|a, b| a.1.total_cmp(&b.1));
    let Some((row, _)) = worst else { return Ok(()) };
    Err(LawError::Residual {
        law,
        row,
        found: found[row],
        expected: expected[row],
        factor: json_of_factor(factor),
        point: json_of_all(variables),
    })
}
