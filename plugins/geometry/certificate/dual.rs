//! The dual certificate matrix of a pose graph. It keeps the translations and so stays sparse, with one block
//! per pose.
//!
//! With X = Rᵀ and y = tᵀ stacked to V, the chordal cost is ½ tr(VᵀMV), M the data matrix. Λ, with one block
//! per pose, is the dual variable of XXᵀ = I. For every Λ and every V', tr(V'ᵀMV') ≥ tr Λ + Σ λ d_i D if λ
//! d_i bounds M - Λ from below. The bound holds at any values, but is tight only at a minimum. With one
//! translation of each part held, M - Λ is positive definite if and only if its Schur complement on the
//! rotations is: SE-Sync's S = Q - Λ. The inverse of S is the block of the rotations in the inverse of M - Λ.
use super::lanczos;
use crate::initialise::network::Edge;
use manifactor_solve::{BlockSystem, BlockSystemError};
use nalgebra::{DMatrix, SMatrix, SVector};

/// Weights of an edge: κ ‖R_b - R_a Z‖² + τ ‖t_b - t_a - R_a z‖².
#[derive(Clone, Copy)]
pub(super) struct Weights {
    pub kappa: f64,
    pub tau: f64,
}

/// The matrix M - Λ, to be shifted and factorized.
pub(super) struct Dual<const D: usize> {
    system: BlockSystem,
    /// (row, column, block) of M - Λ.
    blocks: Vec<(usize, usize, DMatrix<f64>)>,
    /// Dimension of each node's block, one less if its translation is held, and the index at which the block
    /// begins.
    dims: Vec<(usize, usize)>,
    /// Mean diagonal entry of each pose's rotational block of M. Shifts are in units of it.
    scale: Vec<f64>,
    /// Chordal cost ½ tr(VᵀMV).
    pub cost: f64,
    /// Trace of Λ.
    trace: f64,
}

impl<const D: usize> Dual<D> {
    /// Builds the matrix at these rotations and translations. The translation of every `grounded` node is
    /// held, one per connected part.
    pub(super) fn new(
        edges: &[(&Edge<D>, Weights)],
        rotations: &[SMatrix<f64, D, D>],
        translations: &[SVector<f64, D>],
        grounded: &[bool],
    ) -> Result<Self, BlockSystemError> {
        let n = rotations.len();
        let mut diagonal = vec![DMatrix::<f64>::zeros(D + 1, D + 1); n];
        let mut product = vec![SMatrix::<f64, D, D>::zeros(); n];
        let (mut blocks, mut cost) = (vec![], 0.0);
        for (edge, Weights { kappa, tau }) in edges.iter().copied() {
            let (a, b, turn, shift) = (edge.a, edge.b, &edge.rotation, &edge.translation);
            // In terms of X and y, which are transposed.
            let chord = rotations[b].transpose() - turn.tr_mul(&rotations[a].transpose());
            let way = translations[b] - translations[a] - rotations[a] * shift;
            cost += 0.5 * (kappa * chord.norm_squared() + tau * way.norm_squared());
            product[b] += chord * kappa;
            product[a] -= turn * chord * kappa + shift * way.transpose() * tau;
            let inner = SMatrix::<f64, D, D>::identity() * kappa + shift * shift.transpose() * tau;
            diagonal[a] += stacked::<D>(&inner, &(shift * tau), &(shift * tau), tau);
            diagonal[b] +=
                stacked::<D>(&(SMatrix::identity() * kappa), &SVector::zeros(), &SVector::zeros(), tau);
            blocks.push((a, b, stacked::<D>(&(turn * -kappa), &(shift * -tau), &SVector::zeros(), -tau)));
        }
        let scale: Vec<f64> = diagonal.iter().map(|m| m.diagonal().rows(0, D).mean()).collect();
        let mut trace = 0.0;
        for (i, (mut m, product)) in diagonal.into_iter().zip(product).enumerate() {
            let lambda = product * rotations[i];
            trace += lambda.trace();
            let mut view = m.view_mut((0, 0), (D, D));
            view -= (lambda + lambda.transpose()) * 0.5;
            if scale[i] == 0.0 {
                // No measurement involves this node: an identity block decouples it.
                m.fill_with_identity();
            }
            blocks.push((i, i, m));
        }
        let dim = |grounded: &bool| if *grounded { D } else { D + 1 };
        let sizes: Vec<usize> = grounded.iter().map(dim).collect();
        let pairs: Vec<_> = edges.iter().map(|(e, _)| (e.a as u32, e.b as u32)).collect();
        let system = BlockSystem::new(&sizes, &pairs)?;
        let begin = |end: &mut usize, dim: &usize| {
            *end += dim;
            Some((*dim, *end - dim))
        };
        let dims = sizes.iter().scan(0, begin).collect();
        Ok(Self { system, blocks, dims, scale, cost, trace })
    }

    /// Returns whether S + shift·diag(d) is positive definite, with d the scale of each pose. Keeps the
    /// factorization.
    fn is_positive(&mut self, shift: f64) -> bool {
        self.system.clear();
        for (a, b, block) in &self.blocks {
            let (rows, columns) = (self.dims[*a].0, self.dims[*b].0);
            let mut block = block.view((0, 0), (rows, columns)).into_owned();
            if a == b {
                (0..D).for_each(|i| block[(i, i)] += shift * self.scale[*a]);
            }
            self.system.add(*a, *b, block.as_slice());
        }
        self.system.factorize().is_ok()
    }

    /// Returns the smallest eigenvalue of S, scaled to diag(d)^-½ S diag(d)^-½, and a small shift at which S
    /// was found positive definite. `None` if no shift makes it positive definite.
    pub(super) fn smallest_eigenvalue(&mut self) -> Option<(f64, f64)> {
        let mut shift = (0..14).map(|k| 1e-13 * 10_f64.powi(k)).find(|shift| self.is_positive(*shift))?;
        let n = self.scale.len() * D;
        let ends = self.dims.last().map_or(0, |(dim, begin)| dim + begin);
        let mut whole = vec![0.0; ends];
        let (system, dims) = (&mut self.system, &self.dims);
        let roots: Vec<f64> = self.scale.iter().map(|d| d.sqrt()).collect();
        let inverse = lanczos::largest(n, 60, 1e-6, |x| {
            whole.fill(0.0);
            for (i, (_, begin)) in dims.iter().enumerate() {
                (0..D).for_each(|k| whole[begin + k] = x[i * D + k] * roots[i]);
            }
            system.solve(&mut whole);
            for (i, (_, begin)) in dims.iter().enumerate() {
                (0..D).for_each(|k| x[i * D + k] = whole[begin + k] * roots[i]);
            }
        });
        let smallest = 1.0 / inverse - shift;
        let tighter = -1.01 * smallest;
        if tighter > 1e-13 && tighter < 0.9 * shift && self.is_positive(tighter) {
            shift = tighter;
        }
        Some((smallest, shift))
    }

    /// Returns a lower bound on the chordal cost over all values; valid as S + shift·diag(d) is positive
    /// definite.
    pub(super) fn lower_bound(&self, shift: f64) -> f64 {
        0.5 * (self.trace - shift * D as f64 * self.scale.iter().sum::<f64>())
    }
}

/// Returns the block matrix [m, right; belowᵀ, corner].
fn stacked<const D: usize>(
    m: &SMatrix<f64, D, D>,
    right: &SVector<f64, D>,
    below: &SVector<f64, D>,
    corner: f64,
) -> DMatrix<f64> {
    DMatrix::from_fn(D + 1, D + 1, |r, c| match (r < D, c < D) {
        (true, true) => m[(r, c)],
        (true, false) => right[r],
        (false, true) => below[c],
        (false, false) => corner,
    })
}
