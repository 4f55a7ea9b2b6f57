//! Variables to hold so that the gauge of every connected part of a graph is fixed.
use manifactor_graph::{Fixed, Graph, Key, Values};

/// Returns the first pose of each connected part without a held variable or a measurement in the world frame.
/// For a part without a pose, its first variable.
pub(crate) fn anchors(graph: &Graph, values: &Values, is_pose: impl Fn(&Key) -> bool) -> Vec<Key> {
    let mut parts = ConnectedSets::connected(graph, values, |_| true);
    let place = |key: &Key| values.position(key.as_str());
    let mut held = vec![false; values.len()];
    let whole = graph.fixed().iter().filter(|(_, fixed)| **fixed == Fixed::Whole(true));
    whole.filter_map(|(key, _)| place(key)).for_each(|i| held[i] = true);
    let absolute = graph.factors().iter().filter(|entry| entry.keys.len() == 1);
    absolute.flat_map(|entry| &entry.keys).filter_map(place).for_each(|i| held[i] = true);
    let mut part_is_held = vec![false; values.len()];
    for (i, held) in held.into_iter().enumerate() {
        part_is_held[parts.root(i)] |= held;
    }
    let keys: Vec<&Key> = values.iter().map(|(key, _)| key).collect();
    let (poses, others): (Vec<usize>, Vec<usize>) = (0..keys.len()).partition(|i| is_pose(keys[*i]));
    let mut anchors = vec![];
    for i in poses.into_iter().chain(others) {
        if !std::mem::replace(&mut part_is_held[parts.root(i)], true) {
            anchors.push(keys[i].clone());
        }
    }
    anchors
}

/// Disjoint sets, stored as the parent of each member.
pub(crate) struct ConnectedSets(Vec<usize>);

impl ConnectedSets {
    /// Returns the connected sets of variables, by their index; a variable that does not connect is a set of its own.
    pub(crate) fn connected(graph: &Graph, values: &Values, connects: impl Fn(&Key) -> bool) -> Self {
        let mut parts = Self((0..values.len()).collect());
        for factor in graph.factors() {
            let connecting = factor.keys.iter().filter(|key| connects(key));
            let places = connecting.filter_map(|key| values.position(key.as_str()));
            let places: Vec<usize> = places.collect();
            places.windows(2).for_each(|pair| parts.join(pair[0], pair[1]));
        }
        parts
    }
    pub(crate) fn root(&mut self, mut i: usize) -> usize {
        while self.0[i] != i {
            // Path halving.
            self.0[i] = self.0[self.0[i]];
            i = self.0[i];
        }
        i
    }
    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}
