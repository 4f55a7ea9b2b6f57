//! Disjoint sets of numbers, to find the connected parts of a graph.

/// By the parent of each member; a root is the smallest of its set.
pub(crate) struct Parts(Vec<usize>);

impl Parts {
    /// The numbers below `n`, each alone.
    pub(crate) fn new(n: usize) -> Self {
        Self((0..n).collect())
    }
    /// The smallest number that is joined with `i`.
    pub(crate) fn root(&mut self, mut i: usize) -> usize {
        while self.0[i] != i {
            // halve the path on the way
            self.0[i] = self.0[self.0[i]];
            i = self.0[i];
        }
        i
    }
    /// Makes two sets one.
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
        let mut parts = Parts::new(6);
        for (a, b) in [(5, 4), (1, 3), (4, 3)] {
            parts.join(a, b);
        }
        let roots: Vec<_> = (0..6).map(|i| parts.root(i)).collect();
        assert_eq!(roots, [0, 1, 2, 1, 1, 1]);
    }
}
