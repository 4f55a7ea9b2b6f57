//! Condition number of the linear system.
use crate::inspect::null_space::name;
use crate::inspect::{Factorized, WeakDirection};
use crate::linear::system::{dot, norm};
use crate::problem::Problem;

/// Maximum number of steps of the power iteration and of the inverse power iteration.
const MAX_STEPS: usize = 30;
/// Relative change of an eigenvalue estimate below which an iteration stops.
const EIGENVALUE_TOLERANCE: f64 = 0.01;

impl Problem {
    /// Estimates the condition number of H = JᵀJ at the estimate, scaled to a unit diagonal. It is the
    /// ratio of the largest to the smallest eigenvalue, by power iteration and inverse power iteration.
    /// `None` if H is not positive definite.
    ///
    /// The scaling removes the units of the variables. Each iteration approaches its eigenvalue from inside
    /// the spectrum, so the condition is usually underestimated by a few percent. A condition number of 10ⁿ
    /// costs about n of the 16 digits of a solution.
    pub fn condition(&mut self) -> Option<f64> {
        self.factorized().ok()?.condition()
    }
}

impl Factorized<'_> {
    /// See [`Problem::condition`].
    pub fn condition(&mut self) -> Option<f64> {
        self.extremes().map(|(condition, ..)| condition)
    }

    /// Returns the direction with the weakest constraint, and the condition number.
    pub(crate) fn weakest(&mut self) -> Option<WeakDirection> {
        let (condition, v, diagonal) = self.extremes()?;
        Some(WeakDirection { condition, direction: name(&self.problem.model, &v, &diagonal) })
    }

    /// Returns the condition number, the direction with the weakest constraint, and the diagonal of H.
    fn extremes(&mut self) -> Option<(f64, Vec<f64>, Vec<f64>)> {
        let Problem { system, .. } = &mut *self.problem;
        let diagonal: Vec<f64> = system.diagonal().copied().collect();
        if !diagonal.iter().all(|d| *d > 0.0) {
            return None;
        }
        let scale: Vec<f64> = diagonal.iter().map(|d| d.sqrt()).collect();
        let scaled =
            |x: &mut [f64], by: fn(f64) -> f64| x.iter_mut().zip(&scale).for_each(|(x, d)| *x *= by(*d));
        let (largest, _) = dominant(scale.len(), |x| {
            scaled(x, f64::recip);
            let product = system.multiply(x);
            x.copy_from_slice(&product);
            scaled(x, f64::recip);
        });
        let cholesky = system.cholesky()?;
        let (smallest, mut weakest) = dominant(scale.len(), |x| {
            scaled(x, |d| d);
            cholesky.solve(x);
            scaled(x, |d| d);
        });
        scaled(&mut weakest, f64::recip);
        Some((largest * smallest, weakest, diagonal)).filter(|(condition, ..)| condition.is_finite())
    }
}

/// Returns the largest eigenvalue of a symmetric positive definite matrix, approached from below by
/// Rayleigh quotients, and an approximate eigenvector.
fn dominant(n: usize, mut multiply: impl FnMut(&mut [f64])) -> (f64, Vec<f64>) {
    // a start vector with a component in every direction
    let mut x: Vec<f64> = (0..n).map(|i| ((i * 7919 % 104_729) as f64 + 1.0).sin()).collect();
    let (mut before, mut value) = (vec![], 0.0);
    for _ in 0..MAX_STEPS {
        let length = norm(&x);
        x.iter_mut().for_each(|x| *x /= length);
        before.clone_from(&x);
        multiply(&mut x);
        let next = dot(&before, &x);
        let settled = (next - value).abs() <= EIGENVALUE_TOLERANCE * next;
        value = next;
        if settled || !value.is_finite() {
            break;
        }
    }
    (value, x)
}
