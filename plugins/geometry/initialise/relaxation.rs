//! Linear least squares on the nodes of a network: one block per free node, any number of right-hand sides.
use super::network::Edge;
use manifactor_solve::{BlockSystem, BlockSystemError};
use nalgebra::{SMatrix, SVector};

/// Cost term of an edge: ½ eᵀWe - gᵀe with e = x_b - Aᵀx_a, for each of `C` columns x.
pub(crate) struct Term<const D: usize, const C: usize> {
    pub a: SMatrix<f64, D, D>,
    pub w: SMatrix<f64, D, D>,
    pub g: SMatrix<f64, D, C>,
}

/// Smallest share of its diagonal that a pivot may have; smaller pivots are rounding.
const MIN_RELATIVE_PIVOT: f64 = 1e-14;

/// Structure of a sum of cost terms: one block per free node.
pub(crate) struct Relaxation<const D: usize> {
    system: BlockSystem,
    /// Block index of each node; `None` for a node that stays fixed.
    block: Vec<Option<usize>>,
    /// Nodes that stay fixed; they determine the structure.
    anchored: Vec<bool>,
}

impl<const D: usize> Relaxation<D> {
    /// Builds the structure; `anchored` nodes are constants.
    pub(crate) fn new(edges: &[Edge<D>], anchored: Vec<bool>) -> Result<Self, BlockSystemError> {
        let mut free = 0;
        let block: Vec<Option<usize>> = anchored
            .iter()
            .map(|held| {
                free += usize::from(!held);
                (!held).then(|| free - 1)
            })
            .collect();
        let pair = |e: &Edge<D>| Some((block[e.a]? as u32, block[e.b]? as u32));
        let pairs: Vec<_> = edges.iter().filter_map(pair).collect();
        let system = BlockSystem::new(&vec![D; free], &pairs)?;
        Ok(Self { system, block, anchored })
    }

    /// Returns whether the structure matches these anchors.
    pub(crate) fn fits(&self, anchored: &[bool]) -> bool {
        self.anchored == anchored
    }

    /// Minimizes the cost in place. Anchored entries of `x` are constants, and edges without a term are
    /// skipped.
    pub(crate) fn minimize<const C: usize>(
        &mut self,
        edges: &[Edge<D>],
        x: &mut [SMatrix<f64, D, C>],
        term: impl Fn(&Edge<D>) -> Option<Term<D, C>>,
    ) -> Result<(), BlockSystemError> {
        let n = self.system.dim();
        let mut right = vec![0.0; n * C];
        let mut diagonal = vec![SMatrix::<f64, D, D>::zeros(); n / D];
        self.system.clear();
        for edge in edges {
            let Some(Term { a, w, mut g }) = term(edge) else { continue };
            let (aw, block_a, block_b) = (a * w, self.block[edge.a], self.block[edge.b]);
            if block_a.is_none() {
                g += aw.tr_mul(&x[edge.a]);
            }
            if block_b.is_none() {
                g -= w * x[edge.b];
            }
            if let Some(i) = block_a {
                diagonal[i] += aw * a.transpose();
                add(&mut right, n, i, &(-a * g));
            }
            if let Some(i) = block_b {
                diagonal[i] += w;
                add(&mut right, n, i, &g);
            }
            if let (Some(i), Some(k)) = (block_a, block_b) {
                self.system.add(i, k, (-aw).as_slice());
            }
        }
        for (i, block) in diagonal.iter().enumerate() {
            self.system.add(i, i, block.as_slice());
        }
        if n > 0 {
            self.system.factorize()?;
            if self.system.smallest_pivot() < MIN_RELATIVE_PIVOT {
                return Err(BlockSystemError::NotPositiveDefinite);
            }
            right.chunks_exact_mut(n).for_each(|column| self.system.solve(column));
        }
        for (x, block) in x.iter_mut().zip(&self.block) {
            let Some(i) = block else { continue };
            for c in 0..C {
                x.set_column(c, &SVector::from_column_slice(&right[c * n + i * D..][..D]));
            }
        }
        Ok(())
    }
}

fn add<const D: usize, const C: usize>(to: &mut [f64], n: usize, block: usize, x: &SMatrix<f64, D, C>) {
    for c in 0..C {
        for r in 0..D {
            to[c * n + block * D + r] += x[(r, c)];
        }
    }
}
