//! Symmetric positive definite systems of small dense blocks, A X = B, for callers with their own linear
//! systems.
use crate::linear::Cholesky;
use crate::linear::layout::Layout;
use crate::linear::ordering::Order;

/// A symmetric matrix of blocks with a fixed pattern, and its sparse Cholesky factor.
///
/// The pattern is ordered and analysed once; then the blocks may change and be factorized again. Vectors
/// hold the entries of block 0, then the entries of block 1, and so on.
///
/// ```
/// use manifactor_solve::BlockSystem;
/// let mut system = BlockSystem::new(&[2, 1], &[(0, 1)])?;
/// system.add(0, 0, &[2.0, 0.0, 0.0, 2.0]);
/// system.add(1, 1, &[2.0]);
/// system.add(1, 0, &[1.0, 0.0]);
/// system.factorize()?;
/// let mut x = [5.0, 2.0, 4.0];
/// system.solve(&mut x);
/// assert!((x[0] - 2.0).abs() + (x[1] - 1.0).abs() + (x[2] - 1.0).abs() < 1e-12);
/// # Ok::<(), manifactor_solve::BlockSystemError>(())
/// ```
#[derive(Debug)]
pub struct BlockSystem {
    layout: Layout,
    cholesky: Cholesky,
    /// Lower triangle, in the order of elimination.
    values: Vec<f64>,
    /// Dimension of each block, and its start in the vectors of the caller.
    blocks: Vec<(usize, usize)>,
    /// A vector in the order of elimination.
    ordered: Vec<f64>,
}

/// The error of a block system without a factor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BlockSystemError {
    /// It does not fit into memory.
    #[error("no memory for a linear system of {unknowns} unknowns")]
    OutOfMemory {
        /// Number of scalar unknowns.
        unknowns: usize,
    },
    /// A direction is undetermined, or has negative curvature.
    #[error("the matrix is not positive definite")]
    NotPositiveDefinite,
}

impl BlockSystem {
    /// Makes a zero matrix with diagonal blocks of these dimensions and off-diagonal blocks for `pairs`.
    /// Pairs may be in any order and repeat; pairs with unknown blocks are ignored.
    ///
    /// # Errors
    /// If its factor does not fit into memory.
    pub fn new(dims: &[usize], pairs: &[(u32, u32)]) -> Result<Self, BlockSystemError> {
        let unknowns = dims.iter().sum();
        let known = |(a, b): &&(u32, u32)| (*a as usize) < dims.len() && (*b as usize) < dims.len();
        let pairs = pairs.iter().filter(known).copied().collect();
        let out_of_memory = BlockSystemError::OutOfMemory { unknowns };
        let layout = Layout::new(dims, pairs, &Order::Best).ok_or(out_of_memory)?;
        let cholesky = Cholesky::new(layout.structure(false)).ok_or(out_of_memory)?;
        let values = vec![0.0; layout.row_idx.len()];
        let begin = |end: &mut usize, dim: &usize| {
            *end += dim;
            Some((*dim, *end - dim))
        };
        let blocks = dims.iter().scan(0, begin).collect();
        Ok(Self { layout, cholesky, values, blocks, ordered: vec![0.0; unknowns] })
    }

    /// Returns the number of scalar unknowns.
    pub fn dim(&self) -> usize {
        self.ordered.len()
    }

    /// Sets all blocks to zero.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// A ← A + block at (a, b), and its transpose at (b, a); column-major. Only the lower triangle of a
    /// diagonal block is read. Returns whether the pattern has the block and the size fits.
    pub fn add(&mut self, a: usize, b: usize, block: &[f64]) -> bool {
        let (Some(&(rows, _)), Some(&(columns, _))) = (self.blocks.get(a), self.blocks.get(b)) else {
            return false;
        };
        let Some(slot) = self.layout.slot(a, b).filter(|_| block.len() == rows * columns) else {
            return false;
        };
        let mut add = |r: usize, c: usize, x: f64| self.values[slot.index(r, c)] += x;
        for c in 0..columns {
            for r in if a == b { c } else { 0 }..rows {
                let x = block[r + c * rows];
                if slot.swapped { add(c, r, x) } else { add(r, c, x) }
            }
        }
        true
    }

    /// Factorizes the current matrix.
    ///
    /// # Errors
    /// If it is not positive definite, as far as f64 can tell.
    pub fn factorize(&mut self) -> Result<(), BlockSystemError> {
        let done = self.cholesky.factorize(&self.values, None, &mut self.ordered);
        done.map_err(|_| BlockSystemError::NotPositiveDefinite)
    }

    /// Returns the smallest pivot of the last factorization, as a share of its diagonal entry in A. It is
    /// about 1e-16 if a singular matrix is positive definite only because of rounding.
    pub fn smallest_pivot(&self) -> f64 {
        let mut smallest = f64::INFINITY;
        self.cholesky.pivots(&mut |i, pivot| {
            let diagonal = self.layout.diagonal().get(i).map_or(f64::NAN, |at| self.values[*at]);
            smallest = smallest.min(pivot / diagonal);
        });
        smallest
    }

    /// x ← A⁻¹x, by the last factorization. Entries of `x` beyond the system's dimension stay unchanged.
    pub fn solve(&mut self, x: &mut [f64]) {
        for (&(dim, from), to) in self.blocks.iter().zip(&self.layout.start) {
            let (Some(x), Some(to)) =
                (x.get(from..from + dim), self.ordered.get_mut(*to as usize..*to as usize + dim))
            else {
                return;
            };
            to.copy_from_slice(x);
        }
        self.cholesky.solve(&mut self.ordered);
        for (&(dim, to), from) in self.blocks.iter().zip(&self.layout.start) {
            x[to..to + dim].copy_from_slice(&self.ordered[*from as usize..*from as usize + dim]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn solving_is_multiplying_by_the_inverse(
            dims in prop::collection::vec(1..4usize, 1..8),
            raw in prop::collection::vec((0..8u32, 0..8u32), 0..12),
            numbers in prop::collection::vec(-1.0..1.0f64, 9 * 20),
        ) {
            let count = dims.len() as u32;
            let pairs: Vec<_> = raw.into_iter().map(|(a, b)| (a % count, b % count)).collect();
            let mut system = BlockSystem::new(&dims, &pairs).unwrap();
            let n = system.dim();
            let mut dense = DMatrix::<f64>::identity(n, n) * 40.0;
            let first = |i: usize| dims[..i].iter().sum::<usize>();
            for i in 0..dims.len() {
                let block = DMatrix::<f64>::identity(dims[i], dims[i]) * 40.0;
                prop_assert!(system.add(i, i, block.as_slice()));
            }
            for ((a, b), entries) in pairs.iter().map(|p| (p.0 as usize, p.1 as usize)).zip(numbers.chunks(9)) {
                let mut block = DMatrix::from_column_slice(dims[a], dims[b], &entries[..dims[a] * dims[b]]);
                if a == b {
                    block = &block + block.transpose();
                }
                prop_assert!(system.add(a, b, block.as_slice()));
                let mut view = dense.view_mut((first(a), first(b)), (dims[a], dims[b]));
                view += &block;
                if a != b {
                    let mut view = dense.view_mut((first(b), first(a)), (dims[b], dims[a]));
                    view += block.transpose();
                }
            }
            system.factorize().unwrap();
            let expected = DVector::from_fn(n, |i, _| i as f64 + 1.0);
            let mut x = &dense * &expected;
            system.solve(x.as_mut_slice());
            prop_assert!((x - expected).amax() < 1e-10);
        }
    }

    #[test]
    fn blocks_outside_of_the_pattern_are_refused() {
        let mut system = BlockSystem::new(&[1, 1, 2], &[(0, 1), (7, 0)]).unwrap();
        assert!(
            !system.add(0, 2, &[1.0, 1.0]) && !system.add(9, 0, &[1.0]) && !system.add(0, 0, &[1.0, 2.0])
        );
        assert!(system.add(1, 0, &[1.0]));
    }

    #[test]
    fn an_indefinite_matrix_is_an_error_and_may_be_set_anew() {
        let mut system = BlockSystem::new(&[1, 1], &[(0, 1)]).unwrap();
        for (a, b, x) in [(0, 0, 1.0), (1, 1, 1.0), (0, 1, 2.0)] {
            system.add(a, b, &[x]);
        }
        assert_eq!(system.factorize(), Err(BlockSystemError::NotPositiveDefinite));
        system.clear();
        system.add(0, 0, &[2.0]);
        system.add(1, 1, &[4.0]);
        system.factorize().unwrap();
        let mut x = [1.0, 1.0];
        system.solve(&mut x);
        assert!((x[0] - 0.5).abs() < 1e-15 && (x[1] - 0.25).abs() < 1e-15);
        assert!((system.smallest_pivot() - 1.0).abs() < 1e-12);
        system.add(1, 0, &[2.0]);
        system.factorize().unwrap();
        assert!((system.smallest_pivot() - 0.5).abs() < 1e-12);
    }
}
