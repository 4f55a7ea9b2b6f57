//! Linear steps of a linearized problem: damped, undamped, and along the gradient.
use crate::linear::NotPositiveDefinite;
use crate::problem::Problem;
use std::time::Instant;

impl Problem {
    /// Factorizes H + diag(added), and takes -g half the way to the step.
    pub(crate) fn factorize(&mut self, added: Option<&[f64]>) -> Result<(), NotPositiveDefinite> {
        let clock = Instant::now();
        self.forward.clear();
        self.forward.extend(self.g.iter().map(|g| -g));
        let done = self.cholesky.factorize(&self.h, added, &mut self.forward);
        self.times.factorize += clock.elapsed().as_secs_f64();
        done
    }

    /// -H⁻¹ g of the last factorization, into `step`.
    pub(crate) fn newton_step(&mut self, step: &mut Vec<f64>) {
        let clock = Instant::now();
        step.clear();
        step.extend_from_slice(&self.forward);
        self.cholesky.solve_upper(step);
        self.times.solve += clock.elapsed().as_secs_f64();
    }

    /// The diagonal of H, into `out`.
    pub(crate) fn diagonal(&self, out: &mut Vec<f64>) {
        out.clear();
        out.extend(self.layout.diagonal().iter().map(|i| self.h[*i]));
    }

    /// H x.
    pub(crate) fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        for c in 0..x.len() {
            let range = self.layout.col_ptr[c]..self.layout.col_ptr[c + 1];
            let mut sum = 0.0;
            for (r, h) in self.layout.row_idx[range.clone()].iter().zip(&self.h[range]) {
                sum += h * x[*r];
                if *r != c {
                    y[*r] += h * x[c];
                }
            }
            y[c] += sum;
        }
        y
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(crate) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}
