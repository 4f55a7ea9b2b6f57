//! The structure of the normal equations: which blocks there are, in which order, and where.
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;
use manifactor_graph::normal_equations::Slot;

/// The lower triangle of H in compressed columns, by scalars, and the place of each block in it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Layout {
    /// Where block i begins in g and in the columns of H.
    pub start: Vec<u32>,
    /// Place of block i in the elimination order.
    pub rank: Vec<u32>,
    pub col_ptr: Vec<usize>,
    pub row_idx: Vec<usize>,
    /// By block column in elimination order: blocks at and below the diagonal, by rank.
    block_ptr: Vec<usize>,
    block_rows: Vec<u32>,
    /// Index of entry (0, 0) of each of those blocks.
    block_at: Vec<usize>,
}

impl Layout {
    /// Orders blocks of these dimensions, coupled by `pairs` (in any order, repeats welcome).
    pub(crate) fn new(dims: &[usize], mut pairs: Vec<(u32, u32)>) -> Option<Self> {
        pairs.iter_mut().filter(|(a, b)| a < b).for_each(|p| *p = (p.1, p.0));
        pairs.retain(|(a, b)| a != b);
        pairs.sort_unstable();
        pairs.dedup();
        let order = minimum_degree(dims.len(), &pairs)?;
        let mut layout = Self { rank: vec![0; dims.len()], start: vec![0; dims.len()], ..Self::default() };
        let mut n = 0_usize;
        for (rank, &block) in order.iter().enumerate() {
            layout.rank[block] = rank as u32;
            layout.start[block] = u32::try_from(n).ok()?;
            n += dims[block];
        }
        // (column, row) by rank, the diagonal included
        let rank = &layout.rank;
        let mut lower: Vec<(u32, u32)> = pairs
            .iter()
            .map(|&(a, b)| (rank[a as usize], rank[b as usize]))
            .map(|(a, b)| (a.min(b), a.max(b)))
            .chain((0..dims.len() as u32).map(|r| (r, r)))
            .collect();
        lower.sort_unstable();
        layout.fill(dims, &order, &lower);
        Some(layout)
    }

    fn fill(&mut self, dims: &[usize], order: &[usize], lower: &[(u32, u32)]) {
        self.block_rows = lower.iter().map(|(_, row)| *row).collect();
        self.block_ptr = vec![0];
        self.col_ptr = vec![0];
        let mut rest = lower;
        let mut rows: Vec<usize> = vec![];
        for (column, &block) in order.iter().enumerate() {
            let len = rest.partition_point(|(c, _)| *c as usize == column);
            let (own, after) = rest.split_at(len);
            rest = after;
            rows.clear();
            let first = self.row_idx.len();
            for (_, row) in own {
                let block = order[*row as usize];
                self.block_at.push(first + rows.len());
                rows.extend((0..dims[block]).map(|r| self.start[block] as usize + r));
            }
            self.block_ptr.push(self.block_rows.len() - rest.len());
            for c in 0..dims[block] {
                self.row_idx.extend_from_slice(&rows[c..]);
                self.col_ptr.push(self.row_idx.len());
            }
        }
    }

    /// Number of scalar unknowns.
    pub(crate) fn dim(&self) -> usize {
        self.col_ptr.len() - 1
    }

    /// Index of each diagonal entry in the values of H.
    pub(crate) fn diagonal(&self) -> &[usize] {
        // in a lower triangle the diagonal comes first in its column
        &self.col_ptr[..self.dim()]
    }

    /// Where the block of blocks `a` and `b` goes.
    pub(crate) fn slot(&self, a: usize, b: usize) -> Option<Slot> {
        let (row, column) = (self.rank[a].max(self.rank[b]), self.rank[a].min(self.rank[b]) as usize);
        let range = self.block_ptr[column]..self.block_ptr[column + 1];
        let i = range.start + self.block_rows[range.clone()].binary_search(&row).ok()?;
        let at = self.block_at[i];
        let scalar = self.start[if self.rank[a] < self.rank[b] { a } else { b }] as usize;
        let stride = (self.col_ptr[scalar + 1] - self.col_ptr[scalar] - 1) as u32;
        Some(Slot { at, stride, swapped: self.rank[a] < self.rank[b] })
    }
}

/// Approximate minimum degree on blocks; `None` where there is no memory for it.
fn minimum_degree(n: usize, pairs: &[(u32, u32)]) -> Option<Vec<usize>> {
    let mut ptr = vec![0; n + 1];
    for &(a, b) in pairs {
        ptr[a as usize + 1] += 1;
        ptr[b as usize + 1] += 1;
    }
    (0..n).for_each(|i| ptr[i + 1] += ptr[i]);
    let mut next = ptr.clone();
    let mut rows = vec![0; 2 * pairs.len()];
    // sorted pairs (a, b < a): first the smaller neighbours of each column, then the larger, in order
    for &(a, b) in pairs {
        rows[next[a as usize]] = b as usize;
        next[a as usize] += 1;
    }
    for &(a, b) in pairs {
        rows[next[b as usize]] = a as usize;
        next[b as usize] += 1;
    }
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, &ptr, None, &rows);
    let (mut order, mut inverse) = (vec![0; n], vec![0; n]);
    let mut memory = MemBuffer::try_new(amd::order_scratch::<usize>(n, rows.len())).ok()?;
    amd::order(&mut order, &mut inverse, pattern, amd::Control::default(), MemStack::new(&mut memory))
        .ok()?;
    Some(order)
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
            let layout = Layout::new(&dims, pairs.clone()).unwrap();
            prop_assert_eq!(layout.dim(), dims.iter().sum::<usize>());
            for (a, b) in pairs.into_iter().chain((0..n).map(|i| (i, i))) {
                let (a, b) = (a as usize, b as usize);
                let slot = layout.slot(a, b).unwrap();
                let (row, column) = if slot.swapped { (b, a) } else { (a, b) };
                for c in 0..dims[column] {
                    for r in if a == b { c } else { 0 }..dims[row] {
                        let at = slot.at + c * slot.stride as usize - c * c.saturating_sub(1) / 2 + r;
                        let scalar = layout.start[column] as usize + c;
                        prop_assert!((layout.col_ptr[scalar]..layout.col_ptr[scalar + 1]).contains(&at));
                        prop_assert_eq!(layout.row_idx[at], layout.start[row] as usize + r);
                    }
                }
            }
        }
    }
}
