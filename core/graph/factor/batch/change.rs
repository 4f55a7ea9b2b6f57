//! Factors that leave a batch, and variables that are held from now on.
use super::BatchOf;
use crate::factor::kernel::Kernel;
use crate::variable::column::FIXED;
use std::ops::Range;

/// Has the last factor's list replace that of the `index`-th, where lists stand one after the other: that of factor i ends at
/// `ends[i]`.
fn swap_list(ends: &mut Vec<u32>, index: usize, mut replace: impl FnMut(Range<usize>, Range<usize>)) {
    let begin = |i: usize| if i == 0 { 0 } else { ends[i - 1] as usize };
    let last = ends.len() - 1;
    let (gone, moved) = (begin(index)..ends[index] as usize, begin(last)..ends[last] as usize);
    let (before, after) = (gone.len(), moved.len());
    replace(gone, moved);
    ends.pop();
    if before != after && index < last {
        ends[index..].iter_mut().for_each(|end| *end = (*end as usize + after - before) as u32);
    }
}

/// `list[gone] ← list[moved]`, of which the second is the list's end, and goes.
fn swap<T: Copy>(list: &mut Vec<T>, gone: Range<usize>, moved: Range<usize>) {
    let last: Vec<T> = list.drain(moved).collect();
    let end = gone.end.min(list.len());
    if gone.start < end {
        list.splice(gone.start..end, last);
    }
}

impl<F: Kernel> BatchOf<F> {
    /// The last factor takes the place of the `index`-th; returns its place in the graph, `None` where it was the last.
    pub(super) fn swap_remove(&mut self, index: usize) -> Option<usize> {
        if index >= self.factors.len() {
            return None;
        }
        swap_list(&mut self.ends, index, |gone, moved| {
            swap(&mut self.index, gone.clone(), moved.clone());
            swap(&mut self.starts, gone.clone(), moved.clone());
            swap(&mut self.free, gone.clone(), moved.clone());
            if !self.held.is_empty() {
                swap(&mut self.held, gone, moved);
            }
        });
        swap_list(&mut self.slot_ends, index, |gone, moved| {
            swap(&mut self.slots, gone, moved);
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
        self.entries.get(index).map(|entry| *entry as usize)
    }

    /// What is held of a factor's variables from now on.
    pub(super) fn set_held(&mut self, index: usize, starts: &[u32], held: &[u32]) {
        let range = Self::range(&self.ends, index);
        if self.held.is_empty() && held.iter().any(|h| *h != 0) {
            self.held.resize(self.index.len(), 0);
        }
        if !self.held.is_empty() {
            self.held[range.clone()].copy_from_slice(held);
        }
        self.starts[range.clone()].copy_from_slice(starts);
        let free = starts.iter().map(|start| *start != FIXED);
        self.free[range].iter_mut().zip(free).for_each(|(to, free)| *to = free);
    }
}
