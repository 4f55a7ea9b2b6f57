//! Removal of factors from a batch, and changes of their fixed variables.
use super::BatchOf;
use crate::factor::kernel::Kernel;
use crate::variable::column::FIXED;
use std::ops::Range;

/// Replaces list `index` by the last list, for lists that are stored one after the next: list i ends at
/// `ends[i]`.
fn swap_list(ends: &mut Vec<u32>, index: usize, mut replace: impl FnMut(Range<usize>, Range<usize>)) {
    let begin = |i: usize| if i == 0 { 0 } else { ends[i - 1] as usize };
    let last = ends.len() - 1;
    let (removed, moved) = (begin(index)..ends[index] as usize, begin(last)..ends[last] as usize);
    let (before, after) = (removed.len(), moved.len());
    replace(removed, moved);
    ends.pop();
    if before != after && index < last {
        ends[index..].iter_mut().for_each(|end| *end = (*end as usize + after - before) as u32);
    }
}

/// Replaces `list[removed]` by `list[moved]`, the end of the list, which is removed.
fn swap<T: Copy>(list: &mut Vec<T>, removed: Range<usize>, moved: Range<usize>) {
    let last: Vec<T> = list.drain(moved).collect();
    let end = removed.end.min(list.len());
    if removed.start < end {
        list.splice(removed.start..end, last);
    }
}

impl<F: Kernel> BatchOf<F> {
    /// Removes factor `index` and moves the last factor to its position. Returns the graph index of the
    /// moved factor, or `None` if the removed factor was the last.
    pub(super) fn swap_remove(&mut self, index: usize) -> Option<usize> {
        if index >= self.factors.len() {
            return None;
        }
        swap_list(&mut self.ends, index, |removed, moved| {
            swap(&mut self.index, removed.clone(), moved.clone());
            swap(&mut self.starts, removed.clone(), moved.clone());
            swap(&mut self.free, removed.clone(), moved.clone());
            if !self.fixed.is_empty() {
                swap(&mut self.fixed, removed, moved);
            }
        });
        swap_list(&mut self.slot_ends, index, |removed, moved| {
            swap(&mut self.slots, removed, moved);
        });
        self.factors.swap_remove(index);
        self.entries.swap_remove(index);
        self.active.swap_remove(index);
        self.whiteners.swap_remove(index);
        if let Some(losses) = &mut self.losses {
            losses.swap_remove(index);
        }
        if !self.weights.is_empty() {
            self.weights.swap_remove(index);
        }
        if !self.augmentations.is_empty() {
            self.augmentations.swap_remove(index);
        }
        self.entries.get(index).map(|entry| *entry as usize)
    }

    /// Sets the fixed variables and directions of a factor.
    pub(super) fn set_fixed_directions(&mut self, index: usize, starts: &[u32], fixed: &[u32]) {
        let range = Self::range(&self.ends, index);
        if self.fixed.is_empty() && fixed.iter().any(|h| *h != 0) {
            self.fixed.resize(self.index.len(), 0);
        }
        if !self.fixed.is_empty() {
            self.fixed[range.clone()].copy_from_slice(fixed);
        }
        self.starts[range.clone()].copy_from_slice(starts);
        let free = starts.iter().map(|start| *start != FIXED);
        self.free[range].iter_mut().zip(free).for_each(|(to, free)| *to = free);
    }
}
