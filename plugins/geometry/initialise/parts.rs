//! Disjoint sets of numbers, to find the connected parts of a graph.

/// Parent of each member; the root of a set is its smallest member.
pub(crate) struct ConnectedSets(Vec<usize>);

impl ConnectedSets {
    /// Creates sets of the numbers below `n`, each with one member.
    pub(crate) fn new(n: usize) -> Self {
        Self((0..n).collect())
    }
    /// Returns the smallest number in the set of `i`.
    pub(crate) fn root(&mut self, mut i: usize) -> usize {
        while self.0[i] != i {
            // Path halving.
            self.0[i] = self.0[self.0[i]];
            i = self.0[i];
        }
        i
    }
    /// Joins two sets.
    pub(crate) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joined_numbers_have_the_smallest_as_their_root() {
        let mut parts = ConnectedSets::new(6);
        for (a, b) in [(5, 4), (1, 3), (4, 3)] {
            parts.join(a, b);
        }
        let roots: Vec<_> = (0..6).map(|i| parts.root(i)).collect();
        assert_eq!(roots, [0, 1, 2, 1, 1, 1]);
    }
}
