//! Structure of a factor: supernodes, their rows, and the position of each entry.
//!
//! ```text
//!            width
//!          ┌───────┐
//!          │ L     │  the supernode's own columns: its part of the factor …
//!  height  ├───────┼─────────┐
//!          │ L     │ update  │  … and the rows below; the update goes to the parent
//!          └───────┴─────────┘
//!            panel    below²
//! ```
//!
//! Adjacent columns of the factor with equal rows below them form a supernode. Its dense panel of columns,
//! together with the dense update for its parent, is a front. The method is multifrontal (Duff and Reid,
//! 1983; Liu, 1992).
use crate::linear::elimination::{Pattern, ROOT, Tree};
use std::ops::Range;

/// Structure of a factor, for a matrix with blocks in a postordered elimination order.
#[derive(Debug, Clone, Default)]
pub(crate) struct Structure {
    pub nodes: Vec<Node>,
    /// Rows of all supernodes below their columns, ascending.
    pub rows: Vec<u32>,
    /// For each entry of `rows`, its row in the parent's front.
    pub places: Vec<u32>,
    /// For each entry of the matrix, its position in the panel of its node.
    pub scatter: Vec<u32>,
    /// Number of values of the factor, including the unused entries above the diagonals of its panels.
    pub values: usize,
    /// Largest number of simultaneously stored update values, of nodes on even and on odd levels.
    pub updates: [usize; 2],
    /// Early fronts, which receive updates one by one: the node before which a front is created, and the
    /// front's node.
    pub early: Vec<(u32, u32)>,
    /// Number of multiplications and additions of a factorization.
    pub flops: f64,
}

/// A supernode. Its panel is column-major, `height` × `width`; its update is square, with `below` rows.
#[derive(Debug, Clone, Default)]
pub(crate) struct Node {
    /// Its first column.
    pub first: usize,
    /// Number of columns.
    pub width: usize,
    /// Number of rows below its columns.
    pub below: usize,
    /// Start of its panel in the values of the factor.
    pub panel: usize,
    /// Start of its rows in `Structure::rows`.
    pub rows: usize,
    /// Entries of the matrix in its columns.
    pub entries: Range<usize>,
    /// Number of children: the last nodes before it that have no parent yet.
    pub children: usize,
    /// The node that receives its update; [`ROOT`] for a root.
    pub parent: u32,
    /// Whether it receives the updates of its children one by one instead of all at its own elimination.
    pub early: bool,
    /// Distance from its root. Updates of even and of odd levels are on two stacks, so that a parent's
    /// update can be written while its children's updates still exist.
    pub level: u32,
    /// Position of its update on its stack.
    pub update: usize,
}

impl Node {
    pub(crate) fn height(&self) -> usize {
        self.width + self.below
    }
    pub(crate) fn rows<'a>(&self, of: &'a [u32]) -> &'a [u32] {
        &of[self.rows..self.rows + self.below]
    }
}

impl Structure {
    /// Computes the structure for a lower triangle. It is given by blocks, with the first scalar of each
    /// block and one past the last; and by scalars, in compressed columns. A `dense` structure is a single
    /// supernode.
    pub(crate) fn new(
        blocks: Pattern<'_>,
        start: &[u32],
        col_ptr: &[usize],
        row_idx: &[u32],
        dense: bool,
    ) -> Self {
        let groups = if dense { whole(start) } else { merge(groups(blocks, start)) };
        let mut structure = Self::default();
        structure.allocate(blocks, start, &groups, col_ptr);
        structure.place(col_ptr, row_idx);
        structure
    }

    /// Returns the memory of a factorization in bytes.
    pub(crate) fn bytes(&self) -> u64 {
        8 * (self.values + self.updates[0] + self.updates[1]) as u64
    }

    /// Creates the nodes and their rows.
    fn allocate(&mut self, blocks: Pattern<'_>, start: &[u32], groups: &[Group], col_ptr: &[usize]) {
        let mut seen = vec![ROOT; blocks.len()];
        let mut block_rows: Vec<u32> = vec![];
        // block rows of the nodes without a parent so far
        let mut open: Vec<(u32, Range<usize>)> = vec![];
        self.rows.reserve_exact(groups.iter().map(|group| group.below).sum());
        self.nodes.reserve_exact(groups.len());
        for (g, group) in groups.iter().enumerate() {
            let begin = block_rows.len();
            let mut add = |row: u32, rows: &mut Vec<u32>| {
                if row as usize >= group.end && seen[row as usize] != g as u32 {
                    seen[row as usize] = g as u32;
                    rows.push(row);
                }
            };
            for j in group.first..group.end {
                blocks.column(j).iter().for_each(|row| add(*row, &mut block_rows));
            }
            let mut children = 0;
            while let Some((_, rows)) = open.pop_if(|(parent, _)| *parent == g as u32) {
                children += 1;
                for i in rows {
                    add(block_rows[i], &mut block_rows);
                }
            }
            block_rows[begin..].sort_unstable();
            let rows = self.rows.len();
            for &row in &block_rows[begin..] {
                self.rows.extend(start[row as usize]..start[row as usize + 1]);
            }
            let first = start[group.first] as usize;
            let width = start[group.end] as usize - first;
            let node = Node {
                first,
                width,
                below: self.rows.len() - rows,
                panel: self.values,
                rows,
                entries: col_ptr[first]..col_ptr[first + width],
                children,
                parent: group.parent,
                ..Node::default()
            };
            self.values += node.height() * width;
            let (m, k) = (node.height() as f64, width as f64);
            // sum over the columns of the squared number of entries at and below the diagonal
            self.flops += k * m * m - k * k * m + k * k * k / 3.0;
            self.nodes.push(node);
            open.push((group.parent, begin..block_rows.len()));
        }
        for g in (0..groups.len()).rev().filter(|g| groups[*g].parent != ROOT) {
            self.nodes[g].level = self.nodes[groups[g].parent as usize].level + 1;
        }
        self.mark_early_fronts();
    }

    /// Finds the early fronts: fronts whose children's updates would need much more memory than the front,
    /// as of a camera with thousands of points. They must exist before their first descendant.
    fn mark_early_fronts(&mut self) {
        let mut first: Vec<u32> = (0..self.nodes.len() as u32).collect();
        let mut waiting = vec![0_usize; self.nodes.len()];
        for n in 0..self.nodes.len() {
            let (begin, parent) = (first[n], self.nodes[n].parent as usize);
            if let Some(of_parent) = first.get_mut(parent) {
                *of_parent = begin.min(*of_parent);
                waiting[parent] += self.nodes[n].below.pow(2);
            }
            self.nodes[n].early = waiting[n] > EARLY * self.nodes[n].height().pow(2);
            if self.nodes[n].early {
                self.early.push((begin, n as u32));
            }
        }
        // an ancestor before its descendants, as it is closed after them
        self.early.sort_unstable_by_key(|(begin, n)| (*begin, std::cmp::Reverse(*n)));
    }

    /// Computes the positions of rows in parent fronts, of matrix entries in panels, and of updates on
    /// their stacks.
    fn place(&mut self, col_ptr: &[usize], row_idx: &[u32]) {
        self.places = vec![0; self.rows.len()];
        self.scatter = vec![0; row_idx.len()];
        let mut place = vec![0_u32; col_ptr.len() - 1];
        let mut open: Vec<usize> = vec![];
        let mut top = [0; 2];
        let mut early = self.early.clone().into_iter().peekable();
        for n in 0..self.nodes.len() {
            while let Some((_, front)) = early.next_if(|(begin, _)| *begin == n as u32) {
                self.push_update(front as usize, &mut top);
            }
            let node = self.nodes[n].clone();
            let columns = node.first as u32..(node.first + node.width) as u32;
            for (i, row) in columns.chain(node.rows(&self.rows).iter().copied()).enumerate() {
                place[row as usize] = i as u32;
            }
            for c in 0..node.width {
                for i in col_ptr[node.first + c]..col_ptr[node.first + c + 1] {
                    self.scatter[i] = (c * node.height()) as u32 + place[row_idx[i] as usize];
                }
            }
            let level = node.level as usize % 2;
            if !node.early {
                self.push_update(n, &mut top);
            }
            for child in open.drain(open.len() - node.children..).rev() {
                let child = &self.nodes[child];
                for i in child.rows..child.rows + child.below {
                    self.places[i] = place[self.rows[i] as usize];
                }
                if !node.early {
                    top[1 - level] = child.update;
                }
            }
            if self.nodes.get(node.parent as usize).is_some_and(|parent| parent.early) {
                top[level] = self.nodes[n].update;
            }
            open.push(n);
        }
    }

    fn push_update(&mut self, n: usize, top: &mut [usize; 2]) {
        let node = &mut self.nodes[n];
        let level = node.level as usize % 2;
        node.update = top[level];
        top[level] += node.below * node.below;
        self.updates[level] = self.updates[level].max(top[level]);
    }
}

/// A front is early if the updates of its children need this many times its memory.
const EARLY: usize = 2;

/// A supernode whose rows are not known yet.
struct Group {
    /// Block columns `first..end`.
    first: usize,
    end: usize,
    parent: u32,
    /// Scalar columns, and rows below them.
    width: usize,
    below: usize,
    /// Number of zeros in the panel that were added by merging.
    zeros: usize,
}

/// Returns all block columns as one group.
fn whole(start: &[u32]) -> Vec<Group> {
    let (end, width) = (start.len() - 1, start[start.len() - 1] as usize);
    vec![Group { first: 0, end, parent: ROOT, width, below: 0, zeros: 0 }]
}

/// Groups block columns with equal rows.
fn groups(blocks: Pattern<'_>, start: &[u32]) -> Vec<Group> {
    let dim = |b: usize| (start[b + 1] - start[b]) as usize;
    let tree = Tree::new(blocks, dim);
    let mut group_of = vec![0_u32; blocks.len()];
    let mut groups: Vec<Group> = vec![];
    for j in 0..blocks.len() {
        let below = tree.height[j] - dim(j);
        match groups.last_mut() {
            Some(last) if tree.parent[j - 1] == j as u32 && last.below == tree.height[j] => {
                (last.end, last.below, last.width) = (j + 1, below, last.width + dim(j));
            }
            _ => groups.push(Group { first: j, end: j + 1, parent: ROOT, width: dim(j), below, zeros: 0 }),
        }
        group_of[j] = groups.len() as u32 - 1;
    }
    for group in &mut groups {
        group.parent = group_of.get(tree.parent[group.end - 1] as usize).copied().unwrap_or(ROOT);
    }
    groups
}

/// Returns whether a merge into a larger supernode is worth its zeros: relaxed amalgamation (Ashcraft and
/// Grimes, 1989). The limits gave the shortest times on 2D and 3D pose graphs.
fn worth_merging(width: usize, zeros: usize, entries: usize) -> bool {
    let share = zeros as f64 / entries as f64;
    width <= 6 || (width <= 36 && share < 0.2) || (width <= 72 && share < 0.05) || share < 0.01
}

/// Merges groups into the parent if its columns follow directly.
fn merge(mut groups: Vec<Group>) -> Vec<Group> {
    // for each group, the group that it was merged into, and the remaining group before it
    let mut into: Vec<u32> = (0..groups.len() as u32).collect();
    let mut before: Vec<usize> = (0..groups.len()).map(|g| g.wrapping_sub(1)).collect();
    let find = |into: &[u32], mut g: u32| {
        while g != ROOT && into[g as usize] != g {
            g = into[g as usize];
        }
        g
    };
    for p in 0..groups.len() {
        while let Some(child) = groups.get(before[p]) {
            if find(&into, child.parent) != p as u32 {
                break;
            }
            let parent = &groups[p];
            let width = child.width + parent.width;
            let zeros =
                child.zeros + parent.zeros + child.width * (parent.width + parent.below - child.below);
            let entries = width * (width + parent.below) - width * (width - 1) / 2;
            if !worth_merging(width, zeros, entries) {
                break;
            }
            let c = before[p];
            (groups[p].first, groups[p].width, groups[p].zeros) = (groups[c].first, width, zeros);
            into[c] = p as u32;
            before[p] = before[c];
        }
    }
    let mut number = vec![ROOT; groups.len()];
    let left = (0..groups.len()).filter(|g| into[*g] == *g as u32);
    left.enumerate().for_each(|(n, g)| number[g] = n as u32);
    for g in 0..groups.len() {
        let parent = find(&into, groups[g].parent);
        groups[g].parent = number.get(parent as usize).copied().unwrap_or(ROOT);
    }
    let mut g = 0..;
    groups.retain(|_| g.next().is_some_and(|g: usize| into[g] == g as u32));
    groups
}
