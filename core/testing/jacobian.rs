//! The Jacobian law: analytic = automatic = numeric.
use crate::differences::differentiate;
use crate::error::{LawError, json_of_all, json_of_factor};
use manifactor_graph::{Factor, Linearization, Variable};

/// How the Jacobian law is checked. Tolerances are relative to the largest entry, or to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JacobianLaw {
    /// The longest step of the differences, in units of the tangent; the shortest is its 32768th.
    pub step: f64,
    /// Between the analytic and the automatic Jacobian.
    pub analytic: f64,
    /// Between the automatic Jacobian and differences.
    pub numeric: f64,
}

impl Default for JacobianLaw {
    fn default() -> Self {
        Self { step: 1e-2, analytic: 1e-9, numeric: 1e-6 }
    }
}

/// [`JacobianLaw::check`] with the usual tolerances.
///
/// # Errors
/// As there.
pub fn jacobian_law(factor: &dyn Factor, variables: &[&dyn Variable]) -> Result<(), LawError> {
    JacobianLaw::default().check(factor, variables)
}

/// One comparison of two Jacobians.
struct Comparison<'a> {
    law: &'static str,
    factor: &'a dyn Factor,
    variables: &'a [&'a dyn Variable],
    tolerance: f64,
}

impl JacobianLaw {
    /// Checks that the Jacobian in use agrees with the automatic one, and that with differences
    /// through `retract`; that every entry is written and finite; that all ways give one residual.
    ///
    /// That differences go through `retract` makes it a law of the manifolds' seeds too.
    ///
    /// # Errors
    /// The entry that is off most. [`LawError::NotDefined`] where the factor is not defined, so that
    /// there was nothing to check.
    pub fn check(&self, factor: &dyn Factor, variables: &[&dyn Variable]) -> Result<(), LawError> {
        let (residual, point) = (factor.erased(), || json_of_all(variables));
        let wrong = || LawError::WrongVariables { factor: json_of_factor(factor), point: point() };
        if !residual.is_defined(variables).ok_or_else(wrong)? {
            return Err(LawError::NotDefined { factor: json_of_factor(factor), point: point() });
        }
        let value = residual.residual(variables).ok_or_else(wrong)?;
        let used = residual.linearize(variables).ok_or_else(wrong)?;
        let automatic = residual.autodiff(variables).ok_or_else(wrong)?;
        same_residual("residual of autodiff", factor, variables, &automatic.residual, &value, self.analytic)?;
        same_residual("residual of linearize", factor, variables, &used.residual, &value, self.analytic)?;

        let law = "analytic against automatic Jacobian";
        let comparison = Comparison { law, factor, variables, tolerance: self.analytic };
        comparison.check(&used, |v, c, r| Some(automatic.jacobians[v][(r, c)]))?;

        let numeric: Vec<Vec<_>> = (0..variables.len())
            .map(|v| {
                let dim = variables[v].erased().dim();
                (0..dim).map(|c| self.numeric(factor, variables, v, c, value.len())).collect()
            })
            .collect();
        let law = "automatic Jacobian against differences";
        let comparison = Comparison { law, factor, variables, tolerance: self.numeric };
        comparison.check(&automatic, |v, c, r| numeric[v][c].as_ref().map(|column| column[r].value))
    }

    fn numeric(
        &self,
        factor: &dyn Factor,
        variables: &[&dyn Variable],
        variable: usize,
        column: usize,
        rows: usize,
    ) -> Option<Vec<crate::Derivative>> {
        differentiate(rows, self.step, |h| {
            let mut delta = vec![0.0; variables[variable].erased().dim()];
            delta[column] = h;
            let moved = variables[variable].erased().retract(&delta)?;
            let mut variables = variables.to_vec();
            variables[variable] = &*moved;
            let residual = factor.erased();
            if residual.is_defined(&variables)? { residual.residual(&variables) } else { None }
        })
    }
}

impl Comparison<'_> {
    /// Compares each entry with `expected(variable, column, row)`; one that cannot be had is left out.
    fn check(
        &self,
        found: &Linearization,
        expected: impl Fn(usize, usize, usize) -> Option<f64>,
    ) -> Result<(), LawError> {
        let mut worst = None;
        for (variable, block) in found.jacobians.iter().enumerate() {
            let scale = block.iter().fold(1.0, |max: f64, x| max.max(x.abs()));
            for column in 0..block.ncols() {
                for row in 0..block.nrows() {
                    let found = block[(row, column)];
                    let Some(expected) = expected(variable, column, row) else { continue };
                    let error = (found - expected).abs() / scale;
                    // so written that NaN is the worst of all
                    let error = if error.is_nan() { f64::INFINITY } else { error };
                    if error > self.tolerance && worst.as_ref().is_none_or(|(e, _)| error > *e) {
                        worst = Some((error, (variable, column, row, found, expected)));
                    }
                }
            }
        }
        let Some((_, (variable, column, row, found, expected))) = worst else { return Ok(()) };
        Err(LawError::Jacobian {
            law: self.law,
            row,
            variable,
            direction: self.variables[variable].erased().tangent().get(column).copied().unwrap_or("?"),
            found,
            expected,
            factor: json_of_factor(self.factor),
            point: json_of_all(self.variables),
        })
    }
}

/// Fails where two residuals differ by more than `tolerance`, relative to the larger of their norm and 1.
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
