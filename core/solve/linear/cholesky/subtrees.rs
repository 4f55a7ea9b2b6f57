//! Subtrees of supernodes that can be factorized in parallel.
use crate::linear::cholesky::structure::Structure;
use std::ops::Range;

/// Largest share of the total work in one subtree, so that the work divides evenly among several threads.
const MAX_SUBTREE_SHARE: f64 = 1.0 / 12.0;
/// Smallest share of the total work that is worth a task.
const MIN_TASK_SHARE: f64 = 1.0 / 400.0;

/// Smallest share of the total work that parallelism must save, because threads have to synchronize.
const MIN_SAVED_SHARE: f64 = 0.05;
/// Work per value of an update that a subtree passes on, because the value has left the caches by then.
const WORK_PER_VALUE: f64 = 20.0;

/// Returns disjoint ranges of nodes. Each is a whole subtree with the root as its last node. The remaining
/// nodes are above these, or in small subtrees. Empty if more threads would save almost nothing.
pub(crate) fn subtrees(structure: &Structure, threads: usize) -> Vec<Range<usize>> {
    let n = structure.nodes.len();
    let (mut work, mut begin, mut parent) = (vec![0.0; n], vec![0; n], vec![None; n]);
    let mut open: Vec<usize> = vec![];
    for (i, node) in structure.nodes.iter().enumerate() {
        let (m, k) = (node.height() as f64, node.width as f64);
        (work[i], begin[i]) = (k * m * m, i);
        for child in open.drain(open.len() - node.children..) {
            work[i] += work[child];
            begin[i] = begin[i].min(begin[child]);
            parent[child] = Some(i);
        }
        open.push(i);
    }
    let total: f64 = open.iter().map(|root| work[*root]).sum();
    let mut is_above = vec![false; n];
    let mut found = vec![];
    let (mut shared, mut largest, mut handed_on) = (0.0, 0.0_f64, 0.0);
    for i in (0..n).rev() {
        let is_free = parent[i].is_none_or(|p: usize| is_above[p]);
        if is_free && work[i] > MAX_SUBTREE_SHARE * total {
            is_above[i] = true;
        } else if is_free && work[i] > MIN_TASK_SHARE * total {
            found.push(begin[i]..i + 1);
            (shared, largest) = (shared + work[i], largest.max(work[i]));
            handed_on += (structure.nodes[i].below as f64).powi(2);
        }
    }
    let saved = shared - largest.max(shared / threads as f64) - WORK_PER_VALUE * handed_on;
    if saved < MIN_SAVED_SHARE * total {
        return vec![];
    }
    found.reverse();
    found
}
