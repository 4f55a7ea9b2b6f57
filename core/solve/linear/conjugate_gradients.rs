//! Preconditioned conjugate gradients, on H or on the Schur complement of some of its blocks.
//!
//! The complement S = H_uu − H_um H_mm⁻¹ H_mu is never formed. H_mm is block-diagonal and is inverted block
//! by block (Agarwal, Snavely, Seitz and Szeliski, *Bundle adjustment in the large*, 2010).
mod diagonal_blocks;

use crate::linear::NotPositiveDefinite;
use crate::linear::layout::Layout;
use crate::linear::settings::ConjugateGradients as Settings;
use diagonal_blocks::DiagonalBlocks;
use manifactor_graph::normal_equations::Slot;

/// Vectors and blocks of an iteration, in reused memory.
#[derive(Debug)]
pub(crate) struct ConjugateGradients {
    settings: Settings,
    /// First scalar of each block, in the order of elimination.
    first: Vec<usize>,
    /// For each block, whether it is eliminated.
    eliminated: Vec<bool>,
    /// For each scalar, whether it is eliminated.
    is_eliminated: Vec<bool>,
    /// Pairs of an eliminated and a remaining block, sorted by the eliminated one, with their slot in H.
    couplings: Vec<Coupling>,
    /// Inverses of the eliminated diagonal blocks, and of the preconditioner's blocks.
    diagonal: DiagonalBlocks,
    r: Vec<f64>,
    z: Vec<f64>,
    p: Vec<f64>,
    q: Vec<f64>,
    eliminated_part: Vec<f64>,
}

#[derive(Debug)]
struct Coupling {
    eliminated: usize,
    left: usize,
    /// Slot of the block (left, eliminated).
    slot: Slot,
}

/// H + diag(added), in the layout's order.
#[derive(Clone, Copy)]
pub(crate) struct Damped<'a> {
    pub layout: &'a Layout,
    pub h: &'a [f64],
    pub added: Option<&'a [f64]>,
}

impl Damped<'_> {
    /// y ← (H + diag(added)) x.
    pub(crate) fn multiply(self, x: &[f64], y: &mut [f64]) {
        match self.added {
            Some(added) => y.iter_mut().zip(added).zip(x).for_each(|((y, a), x)| *y = a * x),
            None => y.fill(0.0),
        }
        self.layout.multiply_add(self.h, x, y);
    }

    /// Returns entry (row, column) of a block.
    fn entry(self, slot: Slot, row: usize, column: usize) -> f64 {
        let (row, column) = if slot.swapped { (column, row) } else { (row, column) };
        self.h[slot.index(row, column)]
    }
}

impl ConjugateGradients {
    /// Allocates memory for matrices with this layout. `eliminated` marks blocks by their position in the
    /// order of elimination; no two of them may be coupled.
    pub(crate) fn new(layout: &Layout, eliminated: Vec<bool>, settings: Settings) -> Self {
        let first = layout.first_scalars();
        let n = layout.dim();
        let mut couplings = vec![];
        layout.couplings(|row, column, slot| match (eliminated[row], eliminated[column]) {
            (true, false) => {
                couplings.push(Coupling { eliminated: row, left: column, slot: slot.transposed() });
            }
            (false, true) => couplings.push(Coupling { eliminated: column, left: row, slot }),
            _ => {}
        });
        couplings.sort_by_key(|c| (c.eliminated, c.left));
        let is_eliminated = (0..eliminated.len())
            .flat_map(|b| std::iter::repeat_n(eliminated[b], first[b + 1] - first[b]))
            .collect();
        let diagonal = DiagonalBlocks::new(&first);
        let zeros = || vec![0.0; n];
        Self {
            settings,
            first,
            eliminated,
            is_eliminated,
            couplings,
            diagonal,
            r: zeros(),
            z: zeros(),
            p: zeros(),
            q: zeros(),
            eliminated_part: zeros(),
        }
    }

    /// x ← (H + diag(added))⁻¹ x; stops early, with an approximate solution, if `go_on` returns false.
    pub(crate) fn solve(
        &mut self,
        system: Damped<'_>,
        x: &mut [f64],
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<(), NotPositiveDefinite> {
        self.precondition(system)?;
        let n = x.len();
        // the right-hand side of the complement: b_u − H_um H_mm⁻¹ b_m
        self.z.copy_from_slice(x);
        clear_other_part(true, &self.is_eliminated, &mut self.z);
        self.diagonal.solve(&mut self.z);
        system.multiply(&self.z, &mut self.q);
        for i in 0..n {
            self.r[i] = if self.is_eliminated[i] { 0.0 } else { x[i] - self.q[i] };
            self.eliminated_part[i] = if self.is_eliminated[i] { x[i] } else { 0.0 };
        }
        let mut step = vec![0.0; n];
        self.iterate(system, &mut step, go_on);
        // back-substitution for the eliminated part: H_mm⁻¹ (b_m − H_mu x_u)
        system.multiply(&step, &mut self.q);
        for i in 0..n {
            self.z[i] = if self.is_eliminated[i] { self.eliminated_part[i] - self.q[i] } else { 0.0 };
        }
        self.diagonal.solve(&mut self.z);
        for i in 0..n {
            x[i] = if self.is_eliminated[i] { self.z[i] } else { step[i] };
        }
        Ok(())
    }

    /// x ← S⁻¹ r, starting from zero.
    fn iterate(&mut self, system: Damped<'_>, x: &mut [f64], go_on: &mut dyn FnMut() -> bool) {
        let mut rho = self.preconditioned_residual();
        let target = rho * self.settings.tolerance.powi(2);
        self.p.copy_from_slice(&self.z);
        for _ in 0..self.settings.max_iterations {
            // `<=` because the right-hand side may be zero
            if rho <= target || !go_on() {
                break;
            }
            self.multiply_complement(system);
            let curvature: f64 = self.p.iter().zip(&self.q).map(|(p, q)| p * q).sum();
            if curvature <= 0.0 || !curvature.is_finite() {
                break;
            }
            let length = rho / curvature;
            for i in 0..x.len() {
                x[i] += length * self.p[i];
                self.r[i] -= length * self.q[i];
            }
            let before = std::mem::replace(&mut rho, 0.0);
            rho = self.preconditioned_residual();
            let share = rho / before;
            self.p.iter_mut().zip(&self.z).for_each(|(p, z)| *p = z + share * *p);
        }
    }

    /// z ← M⁻¹ r; returns rᵀz.
    fn preconditioned_residual(&mut self) -> f64 {
        self.z.copy_from_slice(&self.r);
        self.diagonal.solve(&mut self.z);
        self.r.iter().zip(&self.z).map(|(r, z)| r * z).sum()
    }

    /// q ← S p; p and q are zero in the eliminated part.
    fn multiply_complement(&mut self, system: Damped<'_>) {
        system.multiply(&self.p, &mut self.q);
        if self.couplings.is_empty() {
            return;
        }
        self.z.copy_from_slice(&self.q);
        clear_other_part(true, &self.is_eliminated, &mut self.z);
        self.diagonal.solve(&mut self.z);
        for coupling in &self.couplings {
            let (to, from) = (self.first[coupling.left], self.first[coupling.eliminated]);
            for c in 0..self.first[coupling.eliminated + 1] - from {
                for r in 0..self.first[coupling.left + 1] - to {
                    self.q[to + r] -= system.entry(coupling.slot, r, c) * self.z[from + c];
                }
            }
        }
        clear_other_part(false, &self.is_eliminated, &mut self.q);
    }

    /// Computes the block-Jacobi preconditioner; for blocks that remain after elimination, from the
    /// diagonal blocks of the Schur complement.
    fn precondition(&mut self, system: Damped<'_>) -> Result<(), NotPositiveDefinite> {
        let diagonal = system.layout.diagonal();
        for b in 0..self.eliminated.len() {
            let (first, end) = (self.first[b], self.first[b + 1]);
            let block = self.diagonal.block_mut(b);
            let dim = end - first;
            for c in 0..dim {
                let at = diagonal[first + c];
                block[c * dim + c..(c + 1) * dim].copy_from_slice(&system.h[at..at + dim - c]);
                block[c * dim + c] += system.added.map_or(0.0, |added| added[first + c]);
            }
        }
        for b in (0..self.eliminated.len()).filter(|b| self.eliminated[*b]) {
            self.diagonal.factorize(b)?;
        }
        let mut rows = vec![];
        for coupling in &self.couplings {
            let dim = self.first[coupling.eliminated + 1] - self.first[coupling.eliminated];
            let left = self.first[coupling.left + 1] - self.first[coupling.left];
            // rows of H_um L⁻ᵀ, whose products are subtracted
            rows.clear();
            for r in 0..left {
                rows.extend((0..dim).map(|c| system.entry(coupling.slot, r, c)));
                self.diagonal.solve_lower(coupling.eliminated, &mut rows[r * dim..]);
            }
            let block = self.diagonal.block_mut(coupling.left);
            for c in 0..left {
                for r in c..left {
                    let product = |k: usize| rows[r * dim + k] * rows[c * dim + k];
                    block[c * left + r] -= (0..dim).map(product).sum::<f64>();
                }
            }
        }
        for b in (0..self.eliminated.len()).filter(|b| !self.eliminated[*b]) {
            self.diagonal.factorize(b)?;
        }
        Ok(())
    }
}

/// Sets x to zero outside of the eliminated part, or outside of the remaining part.
fn clear_other_part(eliminated: bool, is_eliminated: &[bool], x: &mut [f64]) {
    x.iter_mut().zip(is_eliminated).filter(|(_, e)| **e != eliminated).for_each(|(x, _)| *x = 0.0);
}
