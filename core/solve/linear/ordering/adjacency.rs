//! Couplings of blocks, as a graph.

/// The rest of a graph counts as dense once it has this multiple of the couplings of the whole graph.
const DENSE_MULTIPLE: usize = 32;

/// An undirected graph with weights, in compressed rows, without loops or repeated edges.
#[derive(Debug, Clone, Default)]
pub(crate) struct Adjacency {
    pub ptr: Vec<u32>,
    pub neighbours: Vec<u32>,
    /// Weight of each entry of `neighbours`.
    pub edge_weights: Vec<u32>,
    /// Weight of each vertex.
    pub weights: Vec<u32>,
}

impl Adjacency {
    /// Builds a graph from edges (a, b < a), sorted and without repeats, and the weights of its vertices.
    pub(crate) fn new(weights: Vec<u32>, edges: &[(u32, u32)]) -> Self {
        let n = weights.len();
        let mut ptr = vec![0; n + 1];
        for &(a, b) in edges {
            ptr[a as usize + 1] += 1;
            ptr[b as usize + 1] += 1;
        }
        (0..n).for_each(|i| ptr[i + 1] += ptr[i]);
        let mut next = ptr.clone();
        let mut neighbours = vec![0; ptr[n] as usize];
        // first the smaller neighbours of each vertex, then the larger ones, both in order
        for &(a, b) in edges {
            neighbours[next[a as usize] as usize] = b;
            next[a as usize] += 1;
        }
        for &(a, b) in edges {
            neighbours[next[b as usize] as usize] = a;
            next[b as usize] += 1;
        }
        Self { edge_weights: vec![1; neighbours.len()], ptr, neighbours, weights }
    }

    pub(crate) fn len(&self) -> usize {
        self.weights.len()
    }

    fn row(&self, v: usize) -> std::ops::Range<usize> {
        self.ptr[v] as usize..self.ptr[v + 1] as usize
    }

    pub(crate) fn neighbours(&self, v: usize) -> &[u32] {
        &self.neighbours[self.row(v)]
    }

    /// Returns the neighbours of a vertex with the weights of the edges to them.
    pub(crate) fn edges(&self, v: usize) -> impl Iterator<Item = (usize, u32)> {
        let range = self.row(v);
        let weights = &self.edge_weights[range.clone()];
        self.neighbours[range].iter().zip(weights).map(|(u, w)| (*u as usize, *w))
    }

    pub(crate) fn total_weight(&self) -> u64 {
        self.weights.iter().map(|w| u64::from(*w)).sum()
    }

    /// Returns all vertices, breadth first.
    pub(crate) fn breadth_first(&self) -> Vec<usize> {
        let mut order = Vec::with_capacity(self.len());
        let mut seen = vec![false; self.len()];
        let mut next = 0;
        for root in 0..self.len() {
            if !std::mem::replace(&mut seen[root], true) {
                order.push(root);
            }
            while let Some(&v) = order.get(next) {
                next += 1;
                for u in self.neighbours(v).iter().map(|u| *u as usize) {
                    if !std::mem::replace(&mut seen[u], true) {
                        order.push(u);
                    }
                }
            }
        }
        order
    }

    /// Returns a renumbered graph with unit edge weights; vertex `order[i]` becomes vertex i.
    pub(crate) fn permuted(&self, order: &[usize]) -> Self {
        let mut rank = vec![0; self.len()];
        order.iter().enumerate().for_each(|(i, v)| rank[*v] = i as u32);
        let mut graph =
            Self { ptr: vec![0], edge_weights: vec![1; self.neighbours.len()], ..Self::default() };
        for &v in order {
            let begin = graph.neighbours.len();
            graph.neighbours.extend(self.neighbours(v).iter().map(|u| rank[*u as usize]));
            graph.neighbours[begin..].sort_unstable();
            graph.ptr.push(graph.neighbours.len() as u32);
            graph.weights.push(self.weights[v]);
        }
        graph
    }

    /// Returns the subgraph of these vertices (ascending).
    pub(crate) fn induced(&self, part: &[usize]) -> Self {
        let mut place = vec![u32::MAX; self.len()];
        part.iter().enumerate().for_each(|(i, v)| place[*v] = i as u32);
        let mut graph = Self { ptr: vec![0], ..Self::default() };
        for &v in part {
            for (u, w) in self.edges(v).filter(|(u, _)| place[*u] != u32::MAX) {
                graph.neighbours.push(place[u]);
                graph.edge_weights.push(w);
            }
            graph.ptr.push(graph.neighbours.len() as u32);
            graph.weights.push(self.weights[v]);
        }
        graph
    }

    /// Returns the rest of a graph (ascending) after the elimination of vertices. Remaining vertices become
    /// coupled if they touch a common connected part of the eliminated ones. If most of the rest becomes
    /// coupled, the couplings are omitted: all orders of a dense rest are equally good.
    pub(crate) fn without(&self, eliminated: &[usize], rest: &[usize]) -> Self {
        const NONE: u32 = u32::MAX;
        let mut place = vec![NONE; self.len()];
        rest.iter().enumerate().for_each(|(i, v)| place[*v] = i as u32);
        // connected parts of the eliminated vertices, and the remaining vertices around each part
        let mut part_of = vec![NONE; self.len()];
        let mut around: Vec<Vec<u32>> = vec![];
        for &root in eliminated {
            if part_of[root] != NONE {
                continue;
            }
            let part = around.len() as u32;
            part_of[root] = part;
            let (mut stack, mut boundary) = (vec![root], vec![]);
            while let Some(v) = stack.pop() {
                for &u in self.neighbours(v) {
                    if place[u as usize] != NONE {
                        boundary.push(u);
                    } else if part_of[u as usize] == NONE {
                        part_of[u as usize] = part;
                        stack.push(u as usize);
                    }
                }
            }
            boundary.sort_unstable();
            boundary.dedup();
            around.push(boundary);
        }
        let coupled: usize = around.iter().map(|around| around.len().pow(2)).sum();
        if coupled > DENSE_MULTIPLE * (self.neighbours.len() + self.len()) {
            return self.induced(rest);
        }
        let (mut seen, mut seen_part) = (vec![NONE; self.len()], vec![NONE; around.len()]);
        let mut graph = Self { ptr: vec![0], ..Self::default() };
        for (i, &v) in rest.iter().enumerate() {
            let begin = graph.neighbours.len();
            seen[v] = i as u32;
            for &u in self.neighbours(v) {
                let own = [u];
                let reached = match part_of[u as usize] {
                    NONE => &own[..],
                    part if std::mem::replace(&mut seen_part[part as usize], i as u32) == i as u32 => &[],
                    part => &around[part as usize],
                };
                for &u in reached {
                    if std::mem::replace(&mut seen[u as usize], i as u32) != i as u32 {
                        graph.neighbours.push(place[u as usize]);
                    }
                }
            }
            graph.neighbours[begin..].sort_unstable();
            graph.ptr.push(graph.neighbours.len() as u32);
            graph.weights.push(self.weights[v]);
        }
        graph.edge_weights = vec![1; graph.neighbours.len()];
        graph
    }

    /// Merges pairs of vertices. Returns the coarse graph, and for each vertex its coarse vertex. Each
    /// vertex is paired with the unmatched neighbour of the heaviest edge (heavy-edge matching: Karypis and
    /// Kumar, 1998).
    pub(crate) fn coarsen(&self) -> (Self, Vec<u32>) {
        let n = self.len();
        let mut by_degree: Vec<u32> = (0..n as u32).collect();
        by_degree.sort_by_key(|v| self.neighbours(*v as usize).len());
        let mut into = vec![u32::MAX; n];
        let mut members: Vec<[u32; 2]> = Vec::with_capacity(n / 2 + 1);
        for &v in &by_degree {
            if into[v as usize] != u32::MAX {
                continue;
            }
            let open = self.edges(v as usize).filter(|(u, _)| into[*u] == u32::MAX);
            let partner = open.max_by_key(|(u, w)| (*w, std::cmp::Reverse((self.weights[*u], *u))));
            let partner = partner.map_or(v, |(u, _)| u as u32);
            (into[v as usize], into[partner as usize]) = (members.len() as u32, members.len() as u32);
            members.push([v, partner]);
        }
        let mut graph = Self { ptr: vec![0], ..Self::default() };
        // position of the edge to a vertex, if it belongs to the current row
        let mut at = vec![usize::MAX; members.len()];
        for (c, &[a, b]) in members.iter().enumerate() {
            let begin = graph.neighbours.len();
            let both = if a == b { &[a][..] } else { &[a, b] };
            for (u, w) in both.iter().flat_map(|v| self.edges(*v as usize)) {
                let to = into[u] as usize;
                if to == c {
                    continue;
                }
                if at[to] == usize::MAX || at[to] < begin {
                    at[to] = graph.neighbours.len();
                    graph.neighbours.push(to as u32);
                    graph.edge_weights.push(w);
                } else {
                    graph.edge_weights[at[to]] += w;
                }
            }
            graph.ptr.push(graph.neighbours.len() as u32);
            graph.weights.push(both.iter().map(|v| self.weights[*v as usize]).sum());
        }
        (graph, into)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(n: u32) -> Adjacency {
        let edges: Vec<_> = (1..n).map(|v| (v, v - 1)).collect();
        Adjacency::new(vec![1; n as usize], &edges)
    }

    #[test]
    fn what_is_eliminated_couples_what_is_around_it() {
        let rest = path(7).without(&[1, 4, 3], &[0, 2, 5, 6]);
        let neighbours: Vec<_> = (0..4).map(|v| rest.neighbours(v).to_vec()).collect();
        assert_eq!(neighbours, [vec![1], vec![0, 2], vec![1, 3], vec![2]]);
    }

    #[test]
    fn a_rest_that_would_be_dense_is_not_written_down() {
        // a path with a leaf at each vertex: eliminating the path couples all leaves
        let n = 2000;
        let mut edges: Vec<_> = (1..n).map(|v| (v, v - 1)).collect();
        edges.extend((0..n).map(|v| (n + v, v)));
        edges.sort_unstable();
        let graph = Adjacency::new(vec![1; 2 * n as usize], &edges);
        let (path, leaves): (Vec<usize>, Vec<usize>) = (0..2 * n as usize).partition(|v| *v < n as usize);
        let rest = graph.without(&path, &leaves);
        assert_eq!((rest.len(), rest.neighbours.len()), (leaves.len(), 0));
    }
}
