//! How well the linear system is conditioned.
use crate::inspect::null_space::name;
use crate::inspect::{Factorized, Weak};
use crate::linear::system::{dot, norm};
use crate::problem::Problem;

/// Most steps of either iteration.
const STEPS: usize = 30;
/// An estimate that a step changes by less than this share is good enough.
const SETTLED: f64 = 0.01;

impl Problem {
    /// An estimate of the condition number of H = JᵀJ at the estimate, scaled to ones on its diagonal: the ratio of
    /// its largest eigenvalue to its smallest, by power iteration and inverse power iteration. `None` where H is not
    /// positive definite.
    ///
    /// The scaling takes out the units of the variables. Each iteration approaches its eigenvalue from inside the
    /// spectrum, so the condition is underestimated, as a rule by a few percent. With 16 digits in all, about as many
    /// of a solution are lost as the estimate has.
    pub fn condition(&mut self) -> Option<f64> {
        self.factorized().ok()?.condition()
    }
}

impl Factorized<'_> {
    /// See [`Problem::condition`].
    pub fn condition(&mut self) -> Option<f64> {
        self.extremes().map(|(condition, ..)| condition)
    }

    /// The direction that is constrained least, and the condition number.
    pub(crate) fn weakest(&mut self) -> Option<Weak> {
        let (condition, v, diagonal) = self.extremes()?;
        Some(Weak { condition, direction: name(&self.problem.model, &v, &diagonal) })
    }

    /// The condition number, the direction that is constrained least, and the diagonal of H.
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

/// The largest eigenvalue of a symmetric positive definite matrix, from below, by Rayleigh quotients; and nearly its
/// eigenvector.
fn dominant(n: usize, mut multiply: impl FnMut(&mut [f64])) -> (f64, Vec<f64>) {
    // a start with a part in every direction
    let mut x: Vec<f64> = (0..n).map(|i| ((i * 7919 % 104_729) as f64 + 1.0).sin()).collect();
    let (mut before, mut value) = (vec![], 0.0);
    for _ in 0..STEPS {
        let length = norm(&x);
        x.iter_mut().for_each(|x| *x /= length);
        before.clone_from(&x);
        multiply(&mut x);
        let next = dot(&before, &x);
        let settled = (next - value).abs() <= SETTLED * next;
        value = next;
        if settled || !value.is_finite() {
            break;
        }
    }
    (value, x)
}
