//! Layout of the normal equations: existing blocks, their order, and their positions.
use crate::linear::cholesky::structure::Structure;
use crate::linear::elimination::Pattern;
use crate::linear::ordering::adjacency::Adjacency;
use crate::linear::ordering::{Elimination, Order};
use manifactor_graph::normal_equations::Slot;

/// The lower triangle of H in compressed columns, by scalars, and the position of each block in it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Layout {
    /// Start of block i in g and in the columns of H.
    pub start: Vec<u32>,
    /// Position of block i in the elimination order.
    pub rank: Vec<u32>,
    pub col_ptr: Vec<usize>,
    pub row_idx: Vec<u32>,
    /// For each block column in elimination order, the blocks at and below the diagonal, by rank.
    block_ptr: Vec<usize>,
    block_rows: Vec<u32>,
    /// Index of entry (0, 0) of each of those blocks.
    block_at: Vec<usize>,
    /// First scalar of each block column in elimination order, and one past the last.
    first: Vec<u32>,
}

impl Layout {
    /// Orders blocks with these dimensions, coupled by `pairs` (in any order; repeats are allowed).
    pub(crate) fn new(dims: &[usize], mut pairs: Vec<(u32, u32)>, order: &Order) -> Option<Self> {
        pairs.iter_mut().filter(|(a, b)| a < b).for_each(|p| *p = (p.1, p.0));
        pairs.retain(|(a, b)| a != b);
        // as one number, so that the comparison has no branch
        pairs.sort_unstable_by_key(|(a, b)| u64::from(*a) << 32 | u64::from(*b));
        pairs.dedup();
        let weights = dims.iter().map(|dim| *dim as u32).collect();
        let elimination = order.of(&Adjacency::new(weights, &pairs))?;
        let mut layout = Self { start: vec![0; dims.len()], first: vec![0], ..Self::default() };
        let mut n = 0_usize;
        for &block in &elimination.order {
            layout.start[block] = u32::try_from(n).ok()?;
            n += dims[block];
            layout.first.push(u32::try_from(n).ok()?);
        }
        layout.fill(elimination);
        Some(layout)
    }

    fn fill(&mut self, lower: Elimination) {
        let first = |rank: usize| self.first[rank] as usize;
        self.col_ptr.push(0);
        let column_rows = |column: usize| &lower.rows[lower.ptr[column]..lower.ptr[column + 1]];
        let width = |block: usize| first(block + 1) - first(block);
        let entries = |column: usize| {
            let height: usize = column_rows(column).iter().map(|row| width(*row as usize)).sum();
            let width = width(column);
            height * width - width * width.saturating_sub(1) / 2
        };
        self.row_idx.reserve_exact((0..lower.ptr.len() - 1).map(entries).sum());
        self.block_at.reserve_exact(lower.rows.len());
        self.col_ptr.reserve_exact(self.first[self.first.len() - 1] as usize);
        let mut rows: Vec<u32> = vec![];
        for column in 0..lower.ptr.len() - 1 {
            rows.clear();
            let at = self.row_idx.len();
            for &row in column_rows(column) {
                self.block_at.push(at + rows.len());
                rows.extend(self.first[row as usize]..self.first[row as usize + 1]);
            }
            for c in 0..width(column) {
                self.row_idx.extend_from_slice(&rows[c..]);
                self.col_ptr.push(self.row_idx.len());
            }
        }
        (self.rank, self.block_ptr, self.block_rows) = (lower.rank, lower.ptr, lower.rows);
    }

    /// Returns the structure of the factor for this layout, sparse or `dense`.
    pub(crate) fn structure(&self, dense: bool) -> Structure {
        let blocks = Pattern { ptr: &self.block_ptr, rows: &self.block_rows };
        Structure::new(blocks, &self.first, &self.col_ptr, &self.row_idx, dense)
    }

    /// Returns the number of scalar unknowns.
    pub(crate) fn dim(&self) -> usize {
        self.col_ptr.len() - 1
    }

    /// Returns the first scalar of each block in the order of elimination, and one past the last.
    pub(crate) fn first_scalars(&self) -> Vec<usize> {
        self.first.iter().map(|f| *f as usize).collect()
    }

    /// Visits the blocks below the diagonal: ranks of row and column, and the slot.
    pub(crate) fn couplings(&self, mut visit: impl FnMut(usize, usize, Slot)) {
        for column in 0..self.rank.len() {
            for i in self.block_ptr[column] + 1..self.block_ptr[column + 1] {
                visit(self.block_rows[i] as usize, column, self.slot_at(i, column, false));
            }
        }
    }

    /// y ← y + H x.
    pub(crate) fn multiply_add(&self, h: &[f64], x: &[f64], y: &mut [f64]) {
        for c in 0..x.len() {
            let range = self.col_ptr[c]..self.col_ptr[c + 1];
            let (rows, values) = (&self.row_idx[range.clone()], &h[range]);
            // in a lower triangle the diagonal comes first in its column
            let mut sum = values[0] * x[c];
            for (r, h) in rows[1..].iter().zip(&values[1..]) {
                sum += h * x[*r as usize];
                y[*r as usize] += h * x[c];
            }
            y[c] += sum;
        }
    }

    /// Returns the index of each diagonal entry in the values of H.
    pub(crate) fn diagonal(&self) -> &[usize] {
        // in a lower triangle the diagonal comes first in its column
        &self.col_ptr[..self.dim()]
    }

    /// Returns the slot for the pair of blocks `a` and `b`; `None` if they are not coupled.
    pub(crate) fn slot(&self, a: usize, b: usize) -> Option<Slot> {
        let (row, column) = (self.rank[a].max(self.rank[b]), self.rank[a].min(self.rank[b]) as usize);
        let range = self.block_ptr[column]..self.block_ptr[column + 1];
        let i = range.start + self.block_rows[range.clone()].binary_search(&row).ok()?;
        Some(self.slot_at(i, column, self.rank[a] < self.rank[b]))
    }

    fn slot_at(&self, i: usize, column: usize, swapped: bool) -> Slot {
        let scalar = self.first[column] as usize;
        let stride = (self.col_ptr[scalar + 1] - self.col_ptr[scalar] - 1) as u32;
        Slot { at: self.block_at[i], stride, swapped }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_coupled_pair_has_a_slot_at_its_entries(
            dims in prop::collection::vec(1..5usize, 1..12),
            raw in prop::collection::vec((0..12u32, 0..12u32), 0..40),
        ) {
            let n = dims.len() as u32;
            let pairs: Vec<_> = raw.into_iter().map(|(a, b)| (a % n, b % n)).collect();
            let layout = Layout::new(&dims, pairs.clone(), &Order::Best).unwrap();
            prop_assert_eq!(layout.dim(), dims.iter().sum::<usize>());
            for (a, b) in pairs.into_iter().chain((0..n).map(|i| (i, i))) {
                let (a, b) = (a as usize, b as usize);
                let slot = layout.slot(a, b).unwrap();
                let (row, column) = if slot.swapped { (b, a) } else { (a, b) };
                for c in 0..dims[column] {
                    for r in if a == b { c } else { 0 }..dims[row] {
                        let at = slot.index(r, c);
                        let scalar = layout.start[column] as usize + c;
                        prop_assert!((layout.col_ptr[scalar]..layout.col_ptr[scalar + 1]).contains(&at));
                        prop_assert_eq!(layout.row_idx[at] as usize, layout.start[row] as usize + r);
                    }
                }
            }
        }
    }
}
