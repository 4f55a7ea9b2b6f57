//! Addition of the children's updates to a front.

/// Consecutive rows of a child's update that are also consecutive in the parent's front.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    /// Rows in the child's update.
    pub(super) start: usize,
    pub(super) end: usize,
    /// First row in the parent's front.
    pub(super) place: usize,
}

/// A front under assembly: a panel of `width` columns, and the update with the remaining columns. The last
/// row of both is the right-hand side.
pub(super) struct FrontAssembly<'a> {
    pub(super) panel: &'a mut [f64],
    pub(super) update: &'a mut [f64],
    pub(super) width: usize,
    pub(super) height: usize,
}

impl FrontAssembly<'_> {
    /// Returns a column with the number of its first row: 0 in the panel, `width` in the update.
    #[inline(always)]
    fn column<const PANEL: bool>(&mut self, column: usize) -> (&mut [f64], usize) {
        let below = self.height - self.width;
        match PANEL {
            true => (&mut self.panel[column * self.height..(column + 1) * self.height], 0),
            false => {
                let column = column - self.width;
                (&mut self.update[column * below..(column + 1) * below], self.width)
            }
        }
    }
}

/// Adds a child's update, a square of `n` columns, to the panel of its parent (`PANEL`) or to the update.
///
/// A kept child may have been built for a different order of elimination. Its runs are then permuted, and
/// entries below the child's diagonal can belong above the parent's diagonal. These are added to the mirrored
/// position.
#[inline(always)]
pub(super) fn assemble<const PANEL: bool>(from: &[f64], n: usize, runs: &[Run], to: &mut FrontAssembly<'_>) {
    let width = to.width;
    for (r, run) in runs.iter().enumerate() {
        let later = &runs[r + 1..];
        for j in run.start..run.end {
            let place = run.place + j - run.start;
            let source = &from[j * n..(j + 1) * n];
            if (place < width) == PANEL {
                let (column, first) = to.column::<PANEL>(place);
                add(&mut column[place - first..], &source[j..run.end]);
                for run in later.iter().filter(|later| later.place > place) {
                    add(&mut column[run.place - first..], &source[run.start..run.end]);
                }
            }
            for run in later.iter().filter(|later| later.place < place) {
                for i in run.start..run.end {
                    let other = run.place + i - run.start;
                    if (other < width) == PANEL {
                        let (column, first) = to.column::<PANEL>(other);
                        column[place - first] += source[i];
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn add(to: &mut [f64], from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, x)| *to += x);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rows_may_be_permuted(order in Just((0..9usize).collect::<Vec<_>>()).prop_shuffle(), width in 1..9usize, n in 1..9usize) {
            // symmetric in the parent's rows; the last row is the right-hand side
            let value = |a: usize, b: usize| (1 + a.min(b)) as f64 + 0.01 * a.max(b) as f64;
            let places: Vec<usize> = order[..n].iter().copied().chain([9]).collect();
            let mut from = vec![f64::NAN; (n + 1) * (n + 1)];
            for j in 0..=n {
                (j..=n).for_each(|i| from[j * (n + 1) + i] = value(places[i], places[j]));
            }
            let mut runs: Vec<Run> = vec![];
            for (i, place) in places.iter().enumerate() {
                match runs.last_mut() {
                    Some(run) if run.place + run.end - run.start == *place => run.end = i + 1,
                    _ => runs.push(Run { start: i, end: i + 1, place: *place }),
                }
            }
            let (height, below) = (10, 10 - width);
            let (mut panel, mut update) = (vec![0.0; width * height], vec![0.0; below * below]);
            let mut open = FrontAssembly { panel: &mut panel, update: &mut update, width, height };
            assemble::<true>(&from, n + 1, &runs, &mut open);
            assemble::<false>(&from, n + 1, &runs, &mut open);
            for c in 0..height {
                for r in c..height {
                    let is_present = places.contains(&r) && places.contains(&c);
                    let found = if c < width { panel[c * height + r] } else { update[(c - width) * below + r - width] };
                    prop_assert_eq!(found, if is_present { value(r, c) } else { 0.0 });
                }
            }
        }
    }
}
