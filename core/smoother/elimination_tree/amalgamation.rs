//! Relaxed amalgamation (Ashcraft and Grimes, 1989): fewer and larger fronts with some explicit zeros.
use super::order::Group;

/// Returns whether a merged front of `width` columns may have `zeros` explicit zeros among its `entries`.
///
/// The limits are wider than in the batch solver: each recomputed front also costs assembly and symbolic
/// work.
fn is_worth(width: usize, zeros: usize, entries: usize) -> bool {
    let share = zeros as f64 / entries as f64;
    width <= 18 || (width <= 36 && share < 0.2) || (width <= 72 && share < 0.05) || share < 0.01
}

/// Size of a group, in scalars.
#[derive(Clone, Copy)]
struct Size {
    width: usize,
    below: usize,
    zeros: usize,
}

/// Merges groups into their parents. A merged group is left without blocks.
///
/// `parents` is indexed by group. A parent has a larger index than its children, and a root has
/// [`NONE`](super::NONE). On return, `parents` holds the parents after the merges.
pub(super) fn merge(groups: &mut [Group], parents: &mut [u32], dim: impl Fn(u32) -> usize) {
    let n = groups.len();
    let scalars = |of: &[u32]| of.iter().map(|v| dim(*v)).sum::<usize>();
    let size = |group: &Group| Size { width: scalars(&group.blocks), below: scalars(&group.rows), zeros: 0 };
    let mut sizes: Vec<Size> = groups.iter().map(size).collect();
    let mut into: Vec<u32> = (0..n as u32).collect();
    // sorted by parent; the children with the most rows come first
    let mut children: Vec<(u32, usize, u32)> = (0..n)
        .filter(|g| parents[*g] != super::NONE)
        .map(|g| (parents[g], usize::MAX - sizes[g].below, g as u32))
        .collect();
    children.sort_unstable();
    for (p, _, c) in children {
        let (p, c) = (p as usize, c as usize);
        let (child, parent) = (sizes[c], sizes[p]);
        let width = child.width + parent.width;
        let zeros = child.zeros + parent.zeros + child.width * (parent.width + parent.below - child.below);
        let entries = width * (width + parent.below) - width * (width - 1) / 2;
        if is_worth(width, zeros, entries) {
            let mut blocks = std::mem::take(&mut groups[c].blocks);
            blocks.append(&mut groups[p].blocks);
            (groups[p].blocks, into[c]) = (blocks, p as u32);
            sizes[p] = Size { width, zeros, ..parent };
        }
    }
    // from the roots down, so that the merges of a parent are already resolved
    for g in (0..n).rev() {
        into[g] = into[into[g] as usize];
        if parents[g] != super::NONE {
            parents[g] = into[parents[g] as usize];
        }
    }
}
