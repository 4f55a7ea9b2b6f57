//! Linear steps of a linearized problem: damped, undamped, and along the gradient.
use crate::linear::memory;
use crate::linear::{Cholesky, Damped, Method, NotPositiveDefinite, Qr};
use crate::problem::Problem;
use manifactor_graph::batch::FactorRows;
use std::time::Instant;

impl Problem {
    /// Factorizes H + diag(added), and takes -g half the way to the step.
    pub(crate) fn factorize(&mut self, added: Option<&[f64]>) -> Result<(), NotPositiveDefinite> {
        self.factorize_while(added, &mut || true)
    }

    /// The same; iterations end where `go_on` is false, with the step as far as it is.
    pub(crate) fn factorize_while(
        &mut self,
        added: Option<&[f64]>,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<(), NotPositiveDefinite> {
        let clock = Instant::now();
        self.forward.clear();
        self.forward.extend(self.g.iter().map(|g| -g));
        let system = Damped { layout: &self.layout, h: &self.h, added };
        let done = match &mut self.method {
            Method::Cholesky(cholesky) => cholesky.factorize(&self.h, added, &mut self.forward),
            Method::ConjugateGradients(iterative) => iterative.solve(system, &mut self.forward, go_on),
            Method::Qr(qr) => {
                qr.clear();
                let (batches, columns) = (&self.batches, &self.columns);
                batches.iter().for_each(|b| b.rows(columns, &mut |factor| push_rows(qr, &factor)));
                let held = self.held.iter().map(|i| (*i, 1.0));
                let damped = added.into_iter().flatten().enumerate().map(|(i, a)| (i, a.sqrt()));
                held.chain(damped).for_each(|entry| qr.push([entry].into_iter(), 0.0));
                qr.solve(&mut self.forward)
            }
        };
        if self.refinements > 0 {
            let kept = self.added.get_or_insert_default();
            kept.clear();
            kept.extend(added.into_iter().flatten());
        }
        self.times.factorize += clock.elapsed().as_secs_f64();
        done
    }

    /// -(H + diag(added))⁻¹ g of the last factorization, into `step`, refined as often as is asked for, as long as each
    /// correction is less than half of the one before (Higham, *Accuracy and Stability of Numerical Algorithms*,
    /// chapter 12): what follows is rounding.
    pub(crate) fn newton_step(&mut self, step: &mut Vec<f64>, go_on: &mut dyn FnMut() -> bool) {
        let clock = Instant::now();
        step.clear();
        step.extend_from_slice(&self.forward);
        if let Method::Cholesky(cholesky) = &mut self.method {
            cholesky.solve_upper(step);
            let mut before = f64::INFINITY;
            for _ in 0..self.refinements {
                if !go_on() {
                    break;
                }
                // what is left of -g - (H + diag(added)) δ
                let added = self.added.as_deref().filter(|added| !added.is_empty());
                Damped { layout: &self.layout, h: &self.h, added }.multiply(step, &mut self.forward);
                self.forward.iter_mut().zip(&self.g).for_each(|(r, g)| *r = -g - *r);
                cholesky.solve(&mut self.forward);
                let correction = norm(&self.forward);
                if correction.is_nan() || 2.0 * correction > before {
                    break;
                }
                step.iter_mut().zip(&self.forward).for_each(|(s, r)| *s += r);
                if correction == 0.0 {
                    break;
                }
                before = correction;
            }
        }
        self.times.solve += clock.elapsed().as_secs_f64();
    }

    /// Runs what needs a factorization by Cholesky, with one in the method's place meanwhile; `None` where there is no
    /// memory for it.
    pub(crate) fn directly<R>(&mut self, run: impl FnOnce(&mut Self) -> R) -> Option<R> {
        if self.cholesky().is_some() {
            return Some(run(self));
        }
        let structure = self.layout.structure(false);
        if structure.bytes() > memory::for_factor(self.layout.row_idx.len()) {
            return None;
        }
        let direct = Method::Cholesky(Cholesky::new(structure)?);
        let method = std::mem::replace(&mut self.method, direct);
        let step = std::mem::take(&mut self.forward);
        let result = run(self);
        (self.method, self.forward) = (method, step);
        Some(result)
    }

    /// The last factorization, where it is one by Cholesky.
    pub(crate) fn cholesky(&mut self) -> Option<&mut Cholesky> {
        match &mut self.method {
            Method::Cholesky(cholesky) => Some(cholesky),
            _ => None,
        }
    }

    /// The diagonal of H, into `out`.
    pub(crate) fn diagonal(&self, out: &mut Vec<f64>) {
        out.clear();
        out.extend(self.layout.diagonal().iter().map(|i| self.h[*i]));
    }

    /// H x.
    pub(crate) fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        self.layout.multiply_add(&self.h, x, &mut y);
        y
    }
}

/// Rows of a factor, one by one.
fn push_rows(qr: &mut Qr, factor: &FactorRows<'_>) {
    let rows = factor.residual.len();
    for (row, residual) in factor.residual.iter().enumerate() {
        let entries = factor.blocks.iter().flat_map(|(start, block)| {
            let entries = block.iter().skip(row).step_by(rows);
            entries.enumerate().map(move |(c, x)| (start + c, *x))
        });
        qr.push(entries, *residual);
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(crate) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}
