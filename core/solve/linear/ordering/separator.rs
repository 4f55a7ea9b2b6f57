//! Separators: small sets of vertices that split a graph into two parts of similar weight.
//!
//! The method is multilevel (Karypis and Kumar, *A fast and high quality multilevel scheme for partitioning
//! irregular graphs*, 1998). It coarsens the graph, splits the coarse graph by growing one part, and
//! refines the separator on the way back. Refinement follows Fiduccia and Mattheyses, 1982, and for
//! vertices Ashcraft and Liu, 1997.
use super::adjacency::Adjacency;
use std::collections::BinaryHeap;

/// Mark of separator vertices; the two sides are 0 and 1.
pub(crate) const SEPARATOR: u8 = 2;

/// Graphs of at most this many vertices are not coarsened further.
const COARSEST_VERTICES: usize = 80;
/// Number of splits of a small graph, each grown from a different vertex.
const SPLITS: usize = 8;
/// Largest share of the total weight on one side.
const MAX_SIDE_SHARE: f64 = 0.6;
/// Maximum number of passes of a refinement.
const MAX_PASSES: usize = 4;
/// A pass ends after this many moves without improvement.
const MAX_IDLE_MOVES: usize = 40;

/// Returns for each vertex its side, 0 or 1, or [`SEPARATOR`]. No edge connects the two sides.
pub(crate) fn separate(graph: &Adjacency) -> Vec<u8> {
    let mut levels: Vec<(Adjacency, Vec<u32>)> = vec![];
    loop {
        let finest = levels.last().map_or(graph, |(graph, _)| graph);
        if finest.len() <= COARSEST_VERTICES {
            break;
        }
        let (coarser, into) = finest.coarsen();
        if coarser.len() * 10 > finest.len() * 9 {
            break;
        }
        levels.push((coarser, into));
    }
    let smallest = levels.last().map_or(graph, |(graph, _)| graph);
    let mut sides = split(smallest);
    while let Some((_, into)) = levels.pop() {
        let finer = levels.last().map_or(graph, |(graph, _)| graph);
        let mut state = State::new(finer, into.iter().map(|c| sides[*c as usize]).collect());
        state.refine();
        sides = state.sides;
    }

    sides
}

/// Returns the best of several splits of a small graph.
fn split(graph: &Adjacency) -> Vec<u8> {
    let n = graph.len();
    let candidates = (0..SPLITS.min(n)).map(|i| {
        let mut state = State::new(graph, grown(graph, i * n / SPLITS.min(n)));
        state.refine();
        (state.score(), state.sides)
    });
    candidates.min_by_key(|(score, _)| *score).map(|(_, sides)| sides).unwrap_or_default()
}

/// Grows side 0 from a vertex, breadth first, until it has half the weight. The vertices that it touches
/// are the separator.
fn grown(graph: &Adjacency, from: usize) -> Vec<u8> {
    let half = graph.total_weight() / 2;
    let mut sides = vec![1; graph.len()];
    let (mut queue, mut weight) = (vec![], 0);
    let mut seeds = (from..graph.len()).chain(0..from);
    let mut next = 0;
    while weight < half {
        if next == queue.len() {
            // the next component
            match seeds.find(|v| sides[*v] == 1) {
                Some(seed) => {
                    sides[seed] = 0;
                    queue.push(seed);
                }
                None => break,
            }
        }
        let v = queue[next];
        next += 1;
        weight += u64::from(graph.weights[v]);
        for &u in graph.neighbours(v) {
            if sides[u as usize] == 1 {
                sides[u as usize] = 0;
                queue.push(u as usize);
            }
        }
    }
    // vertices that were reached but not added to side 0
    queue[next..].iter().for_each(|v| sides[*v] = SEPARATOR);
    sides
}

/// A split under refinement.
struct State<'a> {
    graph: &'a Adjacency,
    sides: Vec<u8>,
    /// Weights of side 0, side 1 and the separator.
    weights: [u64; 3],
    /// For each vertex, the weights of its neighbours on side 0, on side 1 and in the separator. Updated
    /// incrementally, because recomputing them for each gain takes cubic time on a dense graph.
    around: Vec<[u64; 3]>,
    largest: u64,
    /// Number of visited edges, and of moves pushed to heaps.
    #[cfg(test)]
    work: usize,
}

/// A move: the decrease of the separator's weight, the vertex, and its new side.
type Move = (i64, u32, u8);

impl<'a> State<'a> {
    fn new(graph: &'a Adjacency, sides: Vec<u8>) -> Self {
        let mut weights = [0; 3];
        sides.iter().zip(&graph.weights).for_each(|(side, w)| weights[*side as usize] += u64::from(*w));
        let largest = (graph.total_weight() as f64 * MAX_SIDE_SHARE) as u64;
        let around = |v: usize| {
            let mut around = [0; 3];
            for u in graph.neighbours(v).iter().map(|u| *u as usize) {
                around[sides[u] as usize] += u64::from(graph.weights[u]);
            }
            around
        };
        let around = (0..graph.len()).map(around).collect();
        Self {
            graph,
            sides,
            weights,
            around,
            largest,
            #[cfg(test)]
            work: 0,
        }
    }

    /// Returns the objective to minimize: first the excess weight of a side, then the separator, then the
    /// difference of the sides.
    fn score(&self) -> (u64, u64, u64) {
        let [a, b, separator] = self.weights;
        (a.max(b).saturating_sub(self.largest), separator, a.abs_diff(b))
    }

    /// Returns the decrease of the separator's weight if a vertex of it moves to `side`, and its neighbours
    /// across join the separator.
    fn gain(&self, v: usize, side: u8) -> i64 {
        i64::from(self.graph.weights[v]) - self.around[v][1 - side as usize] as i64
    }

    fn assign(&mut self, v: usize, side: u8, log: &mut Vec<(u32, u8)>) {
        let (weight, from, to) = (u64::from(self.graph.weights[v]), self.sides[v] as usize, side as usize);
        log.push((v as u32, self.sides[v]));
        self.weights[from] -= weight;
        self.weights[to] += weight;
        for u in self.graph.neighbours(v) {
            let around = &mut self.around[*u as usize];
            around[from] -= weight;
            around[to] += weight;
        }
        #[cfg(test)]
        {
            self.work += self.graph.neighbours(v).len();
        }
        self.sides[v] = side;
    }

    fn refine(&mut self) {
        for _ in 0..MAX_PASSES {
            if !self.pass() {
                break;
            }
        }
    }

    /// Moves each vertex at most once, even if that makes the split worse, and returns to the best state on
    /// the way. Returns whether that is an improvement.
    fn pass(&mut self) -> bool {
        let before = self.score();
        let (mut best, mut best_at) = (before, 0);
        let mut log: Vec<(u32, u8)> = vec![];
        let mut locked = vec![false; self.sides.len()];
        let mut heaps: [BinaryHeap<Move>; 2] = Default::default();
        for v in (0..self.sides.len()).filter(|v| self.sides[*v] == SEPARATOR) {
            for side in [0, 1] {
                heaps[side as usize].push((self.gain(v, side), v as u32, side));
            }
        }
        let mut drawn: Vec<usize> = vec![];
        // for each vertex, the last move that increased its gain on that side
        let mut gained = vec![0; self.sides.len()];
        let mut in_vain = 0;
        while in_vain < MAX_IDLE_MOVES {
            let Some((_, v, side)) = self.next(&mut heaps, &locked) else { break };
            let v = v as usize;
            locked[v] = true;
            self.assign(v, side, &mut log);
            drawn.clear();
            let beyond = self.graph.neighbours(v).iter().map(|u| *u as usize);
            drawn.extend(beyond.filter(|u| self.sides[*u] == 1 - side));
            drawn.iter().for_each(|u| self.assign(*u, SEPARATOR, &mut log));
            // the new separator vertices may move on, and their separator neighbours now pull in fewer
            // vertices
            let is_open = |u: usize| self.sides[u] == SEPARATOR && !locked[u];
            for &u in &drawn {
                if is_open(u) {
                    heaps[1 - side as usize].push((self.gain(u, 1 - side), u as u32, 1 - side));
                }
                let neighbours = self.graph.neighbours(u).iter().map(|x| *x as usize);
                for x in neighbours.chain([u]).filter(|x| is_open(*x)) {
                    if std::mem::replace(&mut gained[x], log.len()) != log.len() {
                        heaps[side as usize].push((self.gain(x, side), x as u32, side));
                    }
                }
            }
            in_vain += 1;
            if self.score() < best {
                (best, best_at, in_vain) = (self.score(), log.len(), 0);
            }
        }
        #[cfg(test)]
        {
            self.work += heaps.iter().map(BinaryHeap::len).sum::<usize>();
        }
        for &(v, side) in log[best_at..].iter().rev() {
            self.assign(v as usize, side, &mut vec![]);
        }
        best < before
    }

    /// Returns the best move that leaves no side too heavy. Gains in the heaps may be outdated. If a gain
    /// is too large, the corrected one is pushed. If it is too small, a newer entry exists already.
    fn next(&self, heaps: &mut [BinaryHeap<Move>; 2], locked: &[bool]) -> Option<Move> {
        let mut top: [Option<Move>; 2] = [None; 2];
        for side in [0, 1] {
            let heap = &mut heaps[side];
            while let Some(&(gain, v, to)) = heap.peek() {
                let vertex = v as usize;
                if locked[vertex] || self.sides[vertex] != SEPARATOR {
                    heap.pop();
                    continue;
                }
                let now = self.gain(vertex, to);
                if now != gain {
                    heap.pop();
                    heap.push((now, v, to));
                    continue;
                }
                let weight = self.weights[side] + u64::from(self.graph.weights[vertex]);
                // a move to the lighter side is always allowed
                if weight <= self.largest || self.weights[side] < self.weights[1 - side] {
                    top[side] = Some((gain, v, to));
                }
                break;
            }
        }
        let lighter = usize::from(self.weights[1] < self.weights[0]);
        let better = |a: Move, b: Move| if b.0 > a.0 { b } else { a };
        let chosen = match (top[lighter], top[1 - lighter]) {
            (Some(a), Some(b)) => Some(better(a, b)),
            (a, b) => a.or(b),
        };
        if let Some((_, _, to)) = chosen {
            heaps[to as usize].pop();
        }
        chosen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grid(side: u32) -> Adjacency {
        let at = |x: u32, y: u32| x * side + y;
        let mut edges = vec![];
        for x in 0..side {
            for y in 0..side {
                edges.extend((y > 0).then(|| (at(x, y), at(x, y - 1))));
                edges.extend((x > 0).then(|| (at(x, y), at(x - 1, y))));
            }
        }
        edges.sort_unstable();
        Adjacency::new(vec![1; (side * side) as usize], &edges)
    }

    fn crossing(graph: &Adjacency, sides: &[u8]) -> usize {
        let edges = (0..graph.len()).flat_map(|v| graph.neighbours(v).iter().map(move |u| (v, *u as usize)));
        edges.filter(|(v, u)| sides[*v] + sides[*u] == 1).count()
    }

    #[test]
    fn a_square_grid_is_split_by_about_one_line() {
        let graph = grid(40);
        let sides = separate(&graph);
        assert_eq!(crossing(&graph, &sides), 0);
        let count = |side: u8| sides.iter().filter(|s| **s == side).count();
        assert!(count(SEPARATOR) <= 46, "{}", count(SEPARATOR));
        assert!(count(0) <= 960 && count(1) <= 960, "{} {}", count(0), count(1));
    }

    #[test]
    fn a_dense_graph_is_refined_in_linear_time() {
        let clique =
            |n: u32| -> Vec<(u32, u32)> { (0..n).flat_map(|a| (0..a).map(move |b| (a, b))).collect() };
        for n in [100, 200, 400] {
            let edges = clique(n);
            let graph = Adjacency::new(vec![1; n as usize], &edges);
            let mut state = State::new(&graph, grown(&graph, 0));
            state.refine();
            assert!(state.work < 20 * edges.len(), "{} for {} edges", state.work, edges.len());
            let fresh = State::new(&graph, state.sides.clone());
            assert_eq!((state.around, state.weights), (fresh.around, fresh.weights), "sums are up to date");
        }
    }

    proptest! {
        #[test]
        fn no_edge_crosses_a_separator(
            weights in prop::collection::vec(1..10u32, 1..200),
            raw in prop::collection::vec((0..200u32, 0..200u32), 0..600),
        ) {
            let n = weights.len() as u32;
            let mut edges: Vec<_> = raw.into_iter().map(|(a, b)| (a % n, b % n)).filter(|(a, b)| a != b)
                .map(|(a, b)| (a.max(b), a.min(b))).collect();
            edges.sort_unstable();
            edges.dedup();
            let graph = Adjacency::new(weights, &edges);
            prop_assert_eq!(crossing(&graph, &separate(&graph)), 0);
        }
    }
}
