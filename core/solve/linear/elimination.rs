//! The elimination tree of a sparse symmetric matrix, by blocks.
//!
//! Liu, *The role of elimination trees in sparse factorization* (1990).

/// Parent of a root.
pub(crate) const ROOT: u32 = u32::MAX;

/// The pattern of a lower triangle, in compressed columns; the diagonal is optional.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pattern<'a> {
    pub ptr: &'a [usize],
    pub rows: &'a [u32],
}

impl Pattern<'_> {
    /// Returns the number of columns.
    pub(crate) fn len(&self) -> usize {
        self.ptr.len() - 1
    }
    pub(crate) fn column(&self, j: usize) -> &[u32] {
        &self.rows[self.ptr[j]..self.ptr[j + 1]]
    }
    /// Returns, for each row, the columns left of the diagonal, in order.
    fn by_row(&self) -> (Vec<usize>, Vec<u32>) {
        let n = self.len();
        let mut ptr = vec![0; n + 1];
        for j in 0..n {
            self.column(j).iter().filter(|i| **i as usize > j).for_each(|i| ptr[*i as usize + 1] += 1);
        }
        (0..n).for_each(|i| ptr[i + 1] += ptr[i]);
        let (mut next, mut columns) = (ptr.clone(), vec![0; ptr[n]]);
        for j in 0..n {
            for &i in self.column(j).iter().filter(|i| **i as usize > j) {
                columns[next[i as usize]] = j as u32;
                next[i as usize] += 1;
            }
        }
        (ptr, columns)
    }
}

/// The elimination tree of a matrix, and the size of each column of its factor.
#[derive(Debug, Clone)]
pub(crate) struct Tree {
    /// Parent of each block; [`ROOT`] for a root.
    pub parent: Vec<u32>,
    /// For each block, scalar rows of the factor from the block's own on.
    pub height: Vec<usize>,
}

impl Tree {
    /// Computes the tree of a matrix with blocks of these dimensions.
    pub(crate) fn new(lower: Pattern<'_>, dim: impl Fn(usize) -> usize) -> Self {
        let n = lower.len();
        let (ptr, columns) = lower.by_row();
        let mut parent = vec![ROOT; n];
        let mut ancestor = vec![ROOT; n];
        for i in 0..n {
            for &j in &columns[ptr[i]..ptr[i + 1]] {
                // up to the current root, whose parent becomes i; path compression lets the next search jump to i
                let mut j = j as usize;
                loop {
                    let next = std::mem::replace(&mut ancestor[j], i as u32);
                    if next == ROOT {
                        parent[j] = i as u32;
                    }
                    if next == ROOT || next == i as u32 {
                        break;
                    }
                    j = next as usize;
                }
            }
        }
        // row i of the factor has an entry in each column on the path from a column of the matrix to i
        let mut height: Vec<usize> = (0..n).map(&dim).collect();
        let mut seen = vec![ROOT; n];
        for i in 0..n {
            seen[i] = i as u32;
            for &j in &columns[ptr[i]..ptr[i + 1]] {
                let mut j = j as usize;
                while seen[j] != i as u32 {
                    seen[j] = i as u32;
                    height[j] += dim(i);
                    j = parent[j] as usize;
                }
            }
        }
        Self { parent, height }
    }

    /// Returns a postorder: children before parents, subtrees contiguous, and the highest child of a block
    /// last.
    pub(crate) fn postorder(&self) -> Vec<u32> {
        let n = self.parent.len();
        let mut by_height: Vec<u32> = (0..n as u32).collect();
        by_height.sort_by_key(|j| self.height[*j as usize]);
        // child lists with the lowest first: prepend from the highest on
        let (mut first, mut next) = (vec![ROOT; n], vec![ROOT; n]);
        for &j in by_height.iter().rev() {
            if let Some(first) = first.get_mut(self.parent[j as usize] as usize) {
                next[j as usize] = std::mem::replace(first, j);
            }
        }
        let mut order = Vec::with_capacity(n);
        let mut stack = vec![];
        for root in (0..n).filter(|j| self.parent[*j] == ROOT) {
            stack.push(root as u32);
            while let Some(&j) = stack.last() {
                let child = std::mem::replace(&mut first[j as usize], ROOT);
                if child != ROOT {
                    stack.push(child);
                    continue;
                }
                order.push(j);
                stack.pop();
                // a root has no siblings
                if next[j as usize] != ROOT {
                    stack.push(next[j as usize]);
                }
            }
        }
        order
    }
}
