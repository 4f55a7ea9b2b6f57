//! The structure of the normal equations: which blocks there are, in which order, and where.
use crate::linear::elimination::{Pattern, Tree};
use crate::linear::structure::Structure;
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
    /// By block column in elimination order, its first scalar, and one past the last.
    first: Vec<u32>,
}

impl Layout {
    /// Orders blocks of these dimensions, coupled by `pairs` (in any order, repeats welcome).
    pub(crate) fn new(dims: &[usize], mut pairs: Vec<(u32, u32)>) -> Option<Self> {
        pairs.iter_mut().filter(|(a, b)| a < b).for_each(|p| *p = (p.1, p.0));
        pairs.retain(|(a, b)| a != b);
        pairs.sort_unstable();
        pairs.dedup();
        let order = minimum_degree(dims.len(), &pairs)?;
        // the same fill with subtrees together, so that updates of a factorization are on a stack
        let lower = lower_triangle(&pairs, &order);
        let tree = Tree::new(lower.pattern(), |rank| dims[order[rank]]);
        let order: Vec<usize> = tree.postorder().into_iter().map(|rank| order[rank as usize]).collect();
        let lower = lower_triangle(&pairs, &order);

        let mut layout =
            Self { rank: vec![0; dims.len()], start: vec![0; dims.len()], first: vec![0], ..Self::default() };
        let mut n = 0_usize;
        for (rank, &block) in order.iter().enumerate() {
            layout.rank[block] = rank as u32;
            layout.start[block] = u32::try_from(n).ok()?;
            n += dims[block];
            layout.first.push(u32::try_from(n).ok()?);
        }
        layout.fill(lower);
        Some(layout)
    }

    fn fill(&mut self, lower: Lower) {
        let first = |rank: usize| self.first[rank] as usize;
        self.col_ptr.push(0);
        let mut rows: Vec<usize> = vec![];
        for column in 0..lower.ptr.len() - 1 {
            rows.clear();
            let at = self.row_idx.len();
            for &row in &lower.rows[lower.ptr[column]..lower.ptr[column + 1]] {
                self.block_at.push(at + rows.len());
                rows.extend(first(row as usize)..first(row as usize + 1));
            }
            for c in 0..first(column + 1) - first(column) {
                self.row_idx.extend_from_slice(&rows[c..]);
                self.col_ptr.push(self.row_idx.len());
            }
        }
        (self.block_ptr, self.block_rows) = (lower.ptr, lower.rows);
    }

    /// What the factor of a matrix with this layout looks like.
    pub(crate) fn structure(&self) -> Structure {
        let blocks = Pattern { ptr: &self.block_ptr, rows: &self.block_rows };
        Structure::new(blocks, &self.first, &self.col_ptr, &self.row_idx)
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
        let scalar = self.first[column] as usize;
        let stride = (self.col_ptr[scalar + 1] - self.col_ptr[scalar] - 1) as u32;
        Some(Slot { at, stride, swapped: self.rank[a] < self.rank[b] })
    }
}

/// A lower triangle by ranks, in compressed columns, the diagonal included.
struct Lower {
    ptr: Vec<usize>,
    rows: Vec<u32>,
}

impl Lower {
    fn pattern(&self) -> Pattern<'_> {
        Pattern { ptr: &self.ptr, rows: &self.rows }
    }
}

/// The pattern of blocks in an order of elimination; rows of a column ascending.
fn lower_triangle(pairs: &[(u32, u32)], order: &[usize]) -> Lower {
    let mut rank = vec![0_u32; order.len()];
    order.iter().enumerate().for_each(|(r, block)| rank[*block] = r as u32);
    let by_rank = || pairs.iter().map(|(a, b)| (rank[*a as usize], rank[*b as usize]));
    let mut ptr = vec![0; order.len() + 1];
    by_rank().for_each(|(a, b)| ptr[a.min(b) as usize + 1] += 1);
    (0..order.len()).for_each(|c| ptr[c + 1] += ptr[c] + 1);
    let (mut next, mut rows) = (ptr.clone(), vec![0; pairs.len() + order.len()]);
    for (row, column) in (0..order.len() as u32).map(|r| (r, r)).chain(by_rank()) {
        rows[next[row.min(column) as usize]] = row.max(column);
        next[row.min(column) as usize] += 1;
    }
    (0..order.len()).for_each(|c| rows[ptr[c]..ptr[c + 1]].sort_unstable());
    Lower { ptr, rows }
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
