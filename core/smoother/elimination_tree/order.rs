//! Order of elimination for a part of the graph: minimum degree, with some variables forced to the end.
//!
//! Approximate minimum degree (Amestoy, Davis and Duff, 1996) on a quotient graph. An element is the clique
//! of neighbours that an eliminated pivot leaves behind. The boundaries of kept subtrees are the first
//! elements. The element of a pivot is also the set of rows of its columns, so no symbolic factorization
//! follows.
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Variables that are eliminated in sequence, with a common set of rows below them.
#[derive(Debug, Default)]
pub(super) struct Group {
    pub(super) blocks: Vec<u32>,
    /// Unordered.
    pub(super) rows: Vec<u32>,
}

/// A local graph. Its memory is reused by the next update. Variables count from 0.
#[derive(Debug, Default)]
pub(super) struct Order {
    /// Neighbours and elements of each variable.
    coupled: Vec<Vec<u32>>,
    elements: Vec<Vec<u32>>,
    /// Members of all elements, concatenated. `range` is the part of each element, `left` the number of its
    /// scalars that are not eliminated yet.
    members: Vec<u32>,
    range: Vec<(u32, u32)>,
    left: Vec<u32>,
    absorbed: Vec<bool>,
    /// Indexed by variable, like the next four fields.
    dim: Vec<u32>,
    is_last: Vec<bool>,
    degree: Vec<u32>,
    alive: Vec<bool>,
    mark: Vec<u32>,
    /// By element: the pivot of the last count, and the number of its scalars outside of that pivot's
    /// element.
    outside: Vec<(u32, u32)>,
    /// Variables by degree, last variables at the end. Outdated entries are skipped.
    queue: BinaryHeap<Reverse<(bool, u32, u32)>>,
}

const NONE: u32 = u32::MAX;

impl Order {
    /// Starts a graph of variables with these dimensions. The flag forces a variable to the end.
    pub(super) fn begin(&mut self, variables: impl Iterator<Item = (u32, bool)>) {
        self.dim.clear();
        self.is_last.clear();
        for (dim, is_last) in variables {
            self.dim.push(dim);
            self.is_last.push(is_last);
        }
        let n = self.dim.len();
        for lists in [&mut self.coupled, &mut self.elements] {
            lists.resize_with(lists.len().max(n), Vec::new);
            lists[..n].iter_mut().for_each(Vec::clear);
        }
        self.range.clear();
        self.members.clear();
    }

    /// Adds one direction of an edge. The caller adds both directions.
    pub(super) fn couple(&mut self, variable: usize, other: u32) {
        self.coupled[variable].push(other);
    }

    /// Adds a clique.
    pub(super) fn clique(&mut self, variables: impl Iterator<Item = u32>) {
        let (element, begin) = (self.range.len() as u32, self.members.len() as u32);
        for v in variables {
            self.members.push(v);
            self.elements[v as usize].push(element);
        }
        self.range.push((begin, self.members.len() as u32));
    }

    /// Returns all variables as groups, in an order of elimination.
    pub(super) fn groups(&mut self) -> Vec<Group> {
        let n = self.dim.len();
        let cliques = self.range.len();
        self.range.resize(cliques + n, (0, 0));
        self.left.clear();
        for e in 0..cliques + n {
            let (begin, end) = self.range[e];
            let members = &self.members[begin as usize..end as usize];
            self.left.push(members.iter().map(|v| self.dim[*v as usize]).sum());
        }
        refill(&mut self.absorbed, cliques + n, false);
        refill(&mut self.outside, cliques + n, (NONE, 0));
        refill(&mut self.alive, n, true);
        refill(&mut self.mark, n, NONE);
        self.degrees();
        let mut groups = Vec::with_capacity(n);
        while let Some(Reverse((_, degree, pivot))) = self.queue.pop() {
            if self.alive[pivot as usize] && self.degree[pivot as usize] == degree {
                groups.push(self.eliminate(pivot, cliques as u32 + pivot));
            }
        }
        groups
    }

    /// Computes exact degrees in scalars. Overlaps of cliques count once.
    fn degrees(&mut self) {
        let n = self.dim.len();
        self.queue.clear();
        self.degree.clear();
        for v in 0..n as u32 {
            self.mark[v as usize] = v;
            let mut degree = 0;
            let cliques = self.elements[v as usize].iter().map(|e| self.range[*e as usize]);
            let in_cliques = cliques.flat_map(|(begin, end)| &self.members[begin as usize..end as usize]);
            for u in self.coupled[v as usize].iter().chain(in_cliques) {
                if self.mark[*u as usize] != v {
                    self.mark[*u as usize] = v;
                    degree += self.dim[*u as usize];
                }
            }
            self.degree.push(degree);
            self.queue.push(Reverse((self.is_last[v as usize], degree, v)));
        }
        refill(&mut self.mark, n, NONE);
    }

    /// Eliminates a pivot together with all variables that have no neighbours outside of its element.
    fn eliminate(&mut self, pivot: u32, element: u32) -> Group {
        let p = pivot as usize;
        let range = self.new_element(pivot);
        self.range[element as usize] = (range.start as u32, range.end as u32);
        self.count_outside(pivot, &range);
        let reach: u32 = self.members[range.clone()].iter().map(|v| self.dim[*v as usize]).sum();
        let mut group = Group { blocks: vec![pivot], rows: vec![] };
        for i in range.clone() {
            let v = self.members[i] as usize;
            let mut degree = reach - self.dim[v];
            let mut elements = std::mem::take(&mut self.elements[v]);
            elements.retain(|e| {
                let outside = self.outside[*e as usize].1;
                let stays = !self.absorbed[*e as usize] && outside > 0;
                self.absorbed[*e as usize] |= !stays;
                degree += if stays { outside } else { 0 };
                stays
            });
            let mut coupled = std::mem::take(&mut self.coupled[v]);
            coupled.retain(|u| self.alive[*u as usize] && self.mark[*u as usize] != pivot);
            degree += coupled.iter().map(|u| self.dim[*u as usize]).sum::<u32>();
            if elements.is_empty() && coupled.is_empty() && (!self.is_last[v] || self.is_last[p]) {
                self.alive[v] = false;
                group.blocks.push(v as u32);
            } else {
                elements.push(element);
                self.degree[v] = degree.min(self.degree[v] + reach - self.dim[v]);
                self.queue.push(Reverse((self.is_last[v], self.degree[v], v as u32)));
            }
            (self.elements[v], self.coupled[v]) = (elements, coupled);
        }
        // the order of the neighbours depends on history
        group.blocks[1..].sort_unstable();
        group.rows.extend(self.members[range].iter().copied().filter(|v| self.alive[*v as usize]));
        self.left[element as usize] = group.rows.iter().map(|v| self.dim[*v as usize]).sum();
        group
    }

    /// Collects and marks the neighbours of a pivot. They are its coupled variables and the members of its
    /// elements, which are absorbed.
    fn new_element(&mut self, pivot: u32) -> std::ops::Range<usize> {
        let (p, begin) = (pivot as usize, self.members.len());
        (self.alive[p], self.mark[p]) = (false, pivot);
        for i in 0..self.elements[p].len() {
            let e = self.elements[p][i] as usize;
            self.absorbed[e] = true;
            let (first, end) = self.range[e];
            for i in first..end {
                self.reach(self.members[i as usize], pivot);
            }
        }
        for i in 0..self.coupled[p].len() {
            self.reach(self.coupled[p][i], pivot);
        }
        begin..self.members.len()
    }

    fn reach(&mut self, v: u32, pivot: u32) {
        if self.alive[v as usize] && self.mark[v as usize] != pivot {
            self.mark[v as usize] = pivot;
            self.members.push(v);
        }
    }

    /// Counts, for each element of the pivot's neighbours, the scalars that are not neighbours of the pivot.
    fn count_outside(&mut self, pivot: u32, neighbours: &std::ops::Range<usize>) {
        for i in neighbours.clone() {
            let v = self.members[i] as usize;
            for &e in &self.elements[v] {
                let e = e as usize;
                if !self.absorbed[e] {
                    if self.outside[e].0 != pivot {
                        self.outside[e] = (pivot, self.left[e]);
                    }
                    self.outside[e].1 -= self.dim[v];
                }
            }
        }
    }
}

fn refill<T: Clone>(list: &mut Vec<T>, n: usize, value: T) {
    list.clear();
    list.resize(n, value);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    /// Returns the rows of each variable's column by plain elimination.
    fn rows(n: usize, edges: &[(u32, u32)], order: &[u32]) -> Vec<BTreeSet<u32>> {
        let mut near: Vec<BTreeSet<u32>> = vec![BTreeSet::new(); n];
        for &(a, b) in edges {
            near[a as usize].insert(b);
            near[b as usize].insert(a);
        }
        let mut rows = vec![BTreeSet::new(); n];
        for &v in order {
            let below = std::mem::take(&mut near[v as usize]);
            for &u in &below {
                near[u as usize].remove(&v);
                near[u as usize].extend(below.iter().filter(|w| **w != u));
            }
            rows[v as usize] = below;
        }
        rows
    }

    proptest! {
        #[test]
        fn groups_have_each_variable_once_the_last_ones_last_and_the_rows_of_their_columns(
            n in 1..40usize,
            raw in prop::collection::vec((0..40u32, 0..40u32), 0..90),
            cliques in prop::collection::vec(prop::collection::btree_set(0..40u32, 1..6), 0..6),
            last in prop::collection::btree_set(0..40u32, 0..5),
        ) {
            let m = n as u32;
            let mut edges: BTreeSet<(u32, u32)> =
                raw.into_iter().map(|(a, b)| (a % m, b % m)).filter(|(a, b)| a != b).map(|(a, b)| (a.max(b), a.min(b))).collect();
            let cliques: Vec<BTreeSet<u32>> = cliques.iter().map(|c| c.iter().map(|v| v % m).collect()).collect();
            let mut order = Order::default();
            order.begin((0..m).map(|v| (1 + v % 3, last.contains(&v))));
            for &(a, b) in &edges {
                order.couple(a as usize, b);
                order.couple(b as usize, a);
            }
            let own = edges.clone();
            for clique in &cliques {
                order.clique(clique.iter().copied());
                edges.extend(clique.iter().flat_map(|a| clique.iter().filter(move |b| a > b).map(move |b| (*a, *b))));
            }
            let groups = order.groups();
            // a different history only changes the order of lists; the groups have to be equal
            let mut other = Order::default();
            other.begin((0..m).map(|v| (1 + v % 3, last.contains(&v))));
            for clique in cliques.iter().rev() {
                other.clique(clique.iter().rev().copied());
            }
            for &(a, b) in own.iter().rev() {
                other.couple(b as usize, a);
                other.couple(a as usize, b);
            }
            for (one, other) in groups.iter().zip(other.groups()) {
                prop_assert_eq!(&one.blocks, &other.blocks);
            }
            let eliminated: Vec<u32> = groups.iter().flat_map(|g| g.blocks.iter().copied()).collect();
            let mut sorted = eliminated.clone();
            sorted.sort_unstable();
            prop_assert_eq!(sorted, (0..m).collect::<Vec<_>>());
            let first_last = eliminated.iter().position(|v| last.contains(v)).unwrap_or(n);
            prop_assert!(eliminated[first_last..].iter().all(|v| last.contains(v)));
            let rows = rows(n, &edges.into_iter().collect::<Vec<_>>(), &eliminated);
            for group in groups {
                let end = *group.blocks.last().unwrap();
                prop_assert_eq!(&group.rows.iter().copied().collect::<BTreeSet<_>>(), &rows[end as usize]);
            }
        }
    }
}
