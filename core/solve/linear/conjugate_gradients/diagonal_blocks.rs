//! Small dense diagonal blocks and their Cholesky factors.
use crate::linear::NotPositiveDefinite;

/// Diagonal blocks of a matrix, overwritten by their Cholesky factors: lower triangles, column-major.
#[derive(Debug)]
pub(crate) struct DiagonalBlocks {
    /// First scalar of each block, and one past the last.
    first: Vec<usize>,
    /// Start of each block's values.
    at: Vec<usize>,
    values: Vec<f64>,
}

impl DiagonalBlocks {
    /// Allocates blocks that begin at these scalars; the last entry is one past the end.
    pub(crate) fn new(first: &[usize]) -> Self {
        let sizes = first.windows(2).map(|w| (w[1] - w[0]).pow(2));
        let mut at = vec![0];
        at.extend(sizes.scan(0, |end, size| {
            *end += size;
            Some(*end)
        }));
        Self { first: first.to_vec(), values: vec![0.0; at[at.len() - 1]], at }
    }

    fn dim(&self, b: usize) -> usize {
        self.first[b + 1] - self.first[b]
    }

    pub(crate) fn block_mut(&mut self, b: usize) -> &mut [f64] {
        &mut self.values[self.at[b]..self.at[b + 1]]
    }

    /// Replaces a block by its Cholesky factor.
    pub(crate) fn factorize(&mut self, b: usize) -> Result<(), NotPositiveDefinite> {
        let n = self.dim(b);
        let a = self.block_mut(b);
        for c in 0..n {
            let pivot = a[c * n + c];
            // rejects NaN too
            if !(pivot > 0.0 && pivot < f64::INFINITY) {
                return Err(NotPositiveDefinite);
            }
            let root = pivot.sqrt();
            a[c * n + c..(c + 1) * n].iter_mut().for_each(|x| *x /= root);
            a[c * n + c] = root;
            for k in c + 1..n {
                let factor = a[c * n + k];
                for r in k..n {
                    a[k * n + r] -= factor * a[c * n + r];
                }
            }
        }
        Ok(())
    }

    /// x ← L⁻¹ x, for one block.
    pub(crate) fn solve_lower(&self, b: usize, x: &mut [f64]) {
        let n = self.dim(b);
        let l = &self.values[self.at[b]..self.at[b + 1]];
        for c in 0..n {
            x[c] /= l[c * n + c];
            for r in c + 1..n {
                x[r] -= l[c * n + r] * x[c];
            }
        }
    }

    /// x ← A⁻¹ x, block by block.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        for b in 0..self.at.len() - 1 {
            let n = self.dim(b);
            let x = &mut x[self.first[b]..self.first[b + 1]];
            self.solve_lower(b, x);
            let l = &self.values[self.at[b]..self.at[b + 1]];
            for c in (0..n).rev() {
                let below: f64 = (c + 1..n).map(|r| l[c * n + r] * x[r]).sum();
                x[c] = (x[c] - below) / l[c * n + c];
            }
        }
    }
}
