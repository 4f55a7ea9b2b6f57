//! The linear system of a step: H, g, and their factorization.
use crate::linear::layout::Layout;
use crate::linear::memory;
use crate::linear::{Cholesky, Damped, Method, NotPositiveDefinite, Qr};
use manifactor_graph::batch::FactorRows;
use manifactor_graph::normal_equations::NormalEquations;

/// A visitor of the rows of the whitened and weighted Jacobian, for methods that use J instead of H.
pub(crate) type Rows<'a> = &'a dyn Fn(&mut dyn FnMut(FactorRows<'_>));

/// The error of a Cholesky factorization.
#[derive(Debug, Clone, Copy)]
pub(crate) enum NoFactor {
    NotPositiveDefinite,
    OutOfMemory,
}

/// The system (H + damping) δ = -g. Its structure is analysed once and reused for all steps.
pub(crate) struct LinearSystem {
    pub layout: Layout,
    /// The lower triangle of H, by compressed columns in the order of elimination.
    pub h: Vec<f64>,
    pub g: Vec<f64>,
    /// Held scalar unknowns: one on the diagonal of H, zero in the rest of their rows. The first ones are fixed, the
    /// others are held at a bound until the next linearization.
    pub held: Vec<usize>,
    fixed: usize,
    pub method: Method,
    /// Maximum number of steps of iterative refinement after each solve.
    refinements: usize,
    /// Damping of the last factorization, needed for refinement.
    damping: Vec<f64>,
    /// -L⁻¹g of the last factorization for Cholesky; the step itself for the remaining methods.
    half_step: Vec<f64>,
    /// A Cholesky factor, if the method does not have one.
    direct: Option<Cholesky>,
    /// Whether the Cholesky factor belongs to the current H without damping.
    is_factorized: bool,
}

impl LinearSystem {
    pub(crate) fn new(layout: Layout, fixed: Vec<usize>, method: Method, refinements: usize) -> Self {
        Self {
            h: vec![0.0; layout.row_idx.len()],
            g: vec![0.0; layout.dim()],
            layout,
            fixed: fixed.len(),
            held: fixed,
            method,
            refinements,
            damping: vec![],
            half_step: vec![],
            direct: None,
            is_factorized: false,
        }
    }

    /// Number of scalar unknowns.
    pub(crate) fn dim(&self) -> usize {
        self.g.len()
    }

    /// Sets H and g to zero, for factors to add to.
    pub(crate) fn begin(&mut self) -> NormalEquations<'_> {
        self.is_factorized = false;
        self.direct = None;
        self.h.fill(0.0);
        self.g.fill(0.0);
        self.held.truncate(self.fixed);
        NormalEquations { h: &mut self.h, g: &mut self.g }
    }

    /// Takes the separate Cholesky factor, so that it survives a linearization.
    pub(crate) fn detach_direct(&mut self) -> Option<Cholesky> {
        self.direct.take()
    }

    /// Restores the separate Cholesky factor.
    pub(crate) fn restore_direct(&mut self, direct: Option<Cholesky>) {
        self.direct = direct;
    }

    /// Sets the diagonal of fixed unknowns, after all factors are added.
    pub(crate) fn finish(&mut self) {
        for &i in &self.held {
            self.h[self.layout.diagonal()[i]] = 1.0;
        }
    }

    /// Holds further unknowns until the next linearization.
    pub(crate) fn hold(&mut self, unknowns: impl IntoIterator<Item = usize>) {
        self.is_factorized = false;
        self.direct = None;
        self.held.extend(unknowns);
        let is_held = self.is_held_at_bound();
        for (column, is_column) in is_held.iter().enumerate() {
            let range = self.layout.col_ptr[column]..self.layout.col_ptr[column + 1];
            for (row, entry) in self.layout.row_idx[range.clone()].iter().zip(&mut self.h[range]) {
                if *is_column || is_held[*row as usize] {
                    *entry = 0.0;
                }
            }
        }
        for &i in &self.held[self.fixed..] {
            self.h[self.layout.diagonal()[i]] = 1.0;
            self.g[i] = 0.0;
        }
    }

    /// Returns the unknowns that are held at a bound.
    pub(crate) fn held_at_bound(&self) -> &[usize] {
        &self.held[self.fixed..]
    }

    /// Marks the unknowns that are held at a bound.
    fn is_held_at_bound(&self) -> Vec<bool> {
        let mut is_held = vec![false; self.dim()];
        self.held_at_bound().iter().for_each(|i| is_held[*i] = true);
        is_held
    }

    /// Returns the decrease of the cost by a step, as the quadratic model predicts it: -gᵀδ - ½ δᵀHδ.
    pub(crate) fn predicted_decrease(&self, step: &[f64]) -> f64 {
        -dot(step, &self.g) - 0.5 * dot(step, &self.multiply(step))
    }

    /// Returns whether g and H are finite. In a sum of JᵀJ no entry exceeds the largest diagonal entry, so
    /// only the diagonal is checked.
    pub(crate) fn is_finite(&self) -> bool {
        self.g.iter().chain(self.diagonal()).all(|x| x.is_finite())
    }

    /// Returns the diagonal of H.
    pub(crate) fn diagonal(&self) -> impl Iterator<Item = &f64> {
        self.layout.diagonal().iter().map(|i| &self.h[*i])
    }

    /// Returns the largest entry on the diagonal of H.
    pub(crate) fn largest(&self) -> f64 {
        self.diagonal().fold(0.0, |most, d| f64::max(most, *d))
    }

    /// Returns H x.
    pub(crate) fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        self.layout.multiply_add(&self.h, x, &mut y);
        y
    }

    /// Factorizes H + diag(damping) with the chosen method, and computes the first half of the step from
    /// -g. Iterative methods stop if `go_on` returns false, with the step so far.
    pub(crate) fn factorize(
        &mut self,
        damping: Option<&[f64]>,
        rows: Rows<'_>,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<(), NotPositiveDefinite> {
        self.is_factorized = false;
        self.begin_step(damping);
        let system = Damped { layout: &self.layout, h: &self.h, added: damping };
        let step = &mut self.half_step;
        match &mut self.method {
            Method::Cholesky(cholesky) => {
                cholesky.factorize(&self.h, damping, step)?;
                self.is_factorized = damping.is_none();
                Ok(())
            }
            Method::ConjugateGradients(iterative) => iterative.solve(system, step, go_on),
            Method::Qr(qr) => {
                qr.clear();
                let at_bound = &self.held[self.fixed..];
                rows(&mut |factor| push_rows(qr, &factor, at_bound));
                let held = self.held.iter().map(|i| (*i, 1.0));
                let damped = damping.into_iter().flatten().enumerate().map(|(i, d)| (i, d.sqrt()));
                held.chain(damped).for_each(|entry| qr.push([entry].into_iter(), 0.0));
                qr.solve(step)
            }
        }
    }

    fn begin_step(&mut self, damping: Option<&[f64]>) {
        self.half_step.clear();
        self.half_step.extend(self.g.iter().map(|g| -g));
        self.damping.clear();
        if self.refinements > 0 {
            self.damping.extend(damping.into_iter().flatten());
        }
    }

    /// Writes -(H + diag(damping))⁻¹ g of the last factorization to `step`, with the requested number of
    /// refinements. Stops if a correction is more than half of the previous one, since rounding then
    /// dominates (Higham, *Accuracy and Stability of Numerical Algorithms*, chapter 12).
    pub(crate) fn newton_step(&mut self, step: &mut Vec<f64>, go_on: &mut dyn FnMut() -> bool) {
        step.clear();
        step.extend_from_slice(&self.half_step);
        let Method::Cholesky(cholesky) = &mut self.method else { return };
        cholesky.solve_upper(step);
        let mut before = f64::INFINITY;
        for _ in 0..self.refinements {
            if !go_on() {
                break;
            }
            // the residual -g - (H + diag(damping)) δ
            let added = Some(&self.damping[..]).filter(|damping| !damping.is_empty());
            let rest = &mut self.half_step;
            Damped { layout: &self.layout, h: &self.h, added }.multiply(step, rest);
            rest.iter_mut().zip(&self.g).for_each(|(r, g)| *r = -g - *r);
            cholesky.solve(rest);
            let correction = norm(rest);
            if correction.is_nan() || 2.0 * correction > before {
                break;
            }
            step.iter_mut().zip(rest).for_each(|(s, r)| *s += *r);
            if correction == 0.0 {
                break;
            }
            before = correction;
        }
    }

    /// Factorizes H + diag(damping) by Cholesky, for any method. The factor is valid until the next
    /// linearization.
    pub(crate) fn factorize_directly(&mut self, damping: Option<&[f64]>) -> Result<(), NoFactor> {
        self.is_factorized = false;
        if !matches!(self.method, Method::Cholesky(_)) && self.direct.is_none() {
            let structure = self.layout.structure(false);
            if structure.bytes() > memory::for_factor(self.layout.row_idx.len()) {
                return Err(NoFactor::OutOfMemory);
            }
            self.direct = Some(Cholesky::new(structure).ok_or(NoFactor::OutOfMemory)?);
        }
        if matches!(self.method, Method::Cholesky(_)) {
            self.begin_step(damping);
        }
        let done = match (&mut self.method, &mut self.direct) {
            (Method::Cholesky(cholesky), _) => cholesky.factorize(&self.h, damping, &mut self.half_step),
            // the step of the chosen method stays unchanged
            (_, Some(cholesky)) => cholesky.factorize(&self.h, damping, &mut vec![0.0; self.g.len()]),
            (_, None) => return Err(NoFactor::OutOfMemory),
        };
        self.is_factorized = done.is_ok() && damping.is_none();
        done.map_err(|_| NoFactor::NotPositiveDefinite)
    }

    /// Returns whether the Cholesky factor belongs to the current H without damping.
    pub(crate) fn is_factorized(&self) -> bool {
        self.is_factorized
    }

    /// Visits the pivots of the last Cholesky factor, each with its diagonal entry of H.
    pub(crate) fn pivots(&self, visit: &mut impl FnMut(f64, f64)) {
        let cholesky = match &self.method {
            Method::Cholesky(cholesky) => Some(cholesky),
            _ => self.direct.as_ref(),
        };
        let diagonal = self.layout.diagonal();
        if let Some(cholesky) = cholesky {
            cholesky.pivots(&mut |i, pivot| visit(pivot, self.h[diagonal[i]]));
        }
    }

    /// Returns the last Cholesky factor: the method's own, or the one of
    /// [`factorize_directly`](Self::factorize_directly).
    pub(crate) fn cholesky(&mut self) -> Option<&mut Cholesky> {
        match &mut self.method {
            Method::Cholesky(cholesky) => Some(cholesky),
            _ => self.direct.as_mut(),
        }
    }
}

/// Adds the rows of a factor, without the unknowns that are held at a bound.
fn push_rows(qr: &mut Qr, factor: &FactorRows<'_>, at_bound: &[usize]) {
    let rows = factor.residual.len();
    for (row, residual) in factor.residual.iter().enumerate() {
        let entries = factor.blocks.iter().flat_map(|(start, block)| {
            let entries = block.iter().skip(row).step_by(rows);
            entries.enumerate().map(move |(c, x)| (start + c, *x))
        });
        qr.push(entries.filter(|(unknown, _)| !at_bound.contains(unknown)), *residual);
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(crate) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}
