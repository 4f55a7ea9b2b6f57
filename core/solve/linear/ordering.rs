//! Elimination orders. They determine the fill of the factor, and with it the time.
pub(crate) mod adjacency;
mod column_degree;
mod dissection;
mod minimum_degree;
mod separator;

use crate::linear::elimination::{Pattern, Tree};
use adjacency::Adjacency;

/// A method to find an elimination order of blocks.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) enum Order {
    /// The order with the least work among the methods that pay off for this graph.
    #[default]
    Best,
    Natural,
    MinimumDegree,
    ColumnDegree,
    NestedDissection,
    /// The listed blocks in this order, each at most once; then the remaining ones, by minimum degree.
    Given(Vec<usize>),
    /// The marked blocks first, then the remaining ones, each group by minimum degree.
    First(Vec<bool>),
}

/// Operations per block above which further orders are tried. Each try takes about 1 µs per block. On 3D
/// graphs, the best of three saves up to a fifth of the operations, at each of about six factorizations.
const WORTH_TRIES: f64 = 2e4;
/// Operations per block above which nested dissection is tried. It takes about 6 µs per block, and pays off
/// on large 3D graphs.
const WORTH_DISSECTION: f64 = 1e6;
/// Fill ratio above which further orders are tried: entries of the factor, as a multiple of the entries of
/// the matrix. The ratio is at least 1, and an order without fill has the fewest operations. A dense graph
/// has ratio 1 with every order.
const WORTH_FILL: f64 = 1.1;

impl Order {
    /// Returns an elimination order with contiguous subtrees; `None` if there is no memory.
    pub(crate) fn of(&self, graph: &Adjacency) -> Option<Elimination> {
        let order = match self {
            Self::Best => return best(graph),
            Self::Natural => (0..graph.len()).collect(),
            Self::MinimumDegree => minimum_degree::minimum_degree(graph)?,
            Self::ColumnDegree => column_degree::column_degree(graph)?,
            Self::NestedDissection => dissection::nested_dissection(graph)?,
            Self::Given(order) => listed_first(graph, order.clone())?,
            Self::First(first) => {
                let marked: Vec<usize> = (0..graph.len()).filter(|v| first[*v]).collect();
                let order = minimum_degree::minimum_degree(&graph.induced(&marked))?;
                listed_first(graph, order.into_iter().map(|v| marked[v]).collect())?
            }
        };
        Some(Elimination::new(graph, &order))
    }
}

/// Returns the best of several orders. Ties of minimum degree depend on the order of its input, so the
/// given order and breadth-first orders from either end are tried.
fn best(graph: &Adjacency) -> Option<Elimination> {
    let mut best = Elimination::new(graph, &minimum_degree::minimum_degree(graph)?);
    let operations = best.worth();
    let mut consider = |order: Vec<usize>| {
        let other = Elimination::new(graph, &order);
        if other.flops < best.flops {
            best = other;
        }
    };
    if operations > WORTH_TRIES {
        let mut ties = graph.breadth_first();
        for _ in 0..2 {
            ties.reverse();
            let order = minimum_degree::minimum_degree(&graph.permuted(&ties))?;
            consider(order.into_iter().map(|v| ties[v]).collect());
        }
    }
    if operations > WORTH_DISSECTION {
        consider(dissection::nested_dissection(graph)?);
    }
    Some(best)
}

/// Returns the listed blocks, in order, then the remaining ones by minimum degree.
fn listed_first(graph: &Adjacency, mut order: Vec<usize>) -> Option<Vec<usize>> {
    let mut is_listed = vec![false; graph.len()];
    order.iter().for_each(|v| is_listed[*v] = true);
    let rest: Vec<usize> = (0..graph.len()).filter(|v| !is_listed[*v]).collect();
    let after = minimum_degree::minimum_degree(&graph.without(&order, &rest))?;
    order.extend(after.into_iter().map(|v| rest[v]));
    Some(order)
}

/// An elimination order, and the resulting structure.
#[derive(Debug, Clone, Default)]
pub(crate) struct Elimination {
    /// Blocks in order. Subtrees of the elimination tree are contiguous, so that updates of a factorization
    /// form a stack.
    pub order: Vec<usize>,
    /// Position of each block in the order.
    pub rank: Vec<u32>,
    /// The lower triangle by ranks, in compressed columns, including the diagonal.
    pub ptr: Vec<usize>,
    pub rows: Vec<u32>,
    /// Multiplications and additions of a factorization, without the zeros of merged supernodes.
    pub flops: f64,
    /// Entries of the factor, as a multiple of the entries of the matrix.
    pub fill: f64,
}

impl Elimination {
    fn new(graph: &Adjacency, order: &[usize]) -> Self {
        let dim = |block: usize| graph.weights[block] as usize;
        let draft = Self::lower_triangle(graph, order.to_vec());
        let tree = Tree::new(draft.pattern(), |rank| dim(draft.order[rank]));
        let order = tree.postorder().into_iter().map(|rank| draft.order[rank as usize]).collect();
        let mut elimination = Self::lower_triangle(graph, order);
        let (mut of_matrix, mut of_factor) = (0, 0);
        for (rank, height) in tree.height.iter().enumerate() {
            let width = dim(draft.order[rank]);
            let columns = (0..width).map(|c| (height - c) as f64);
            elimination.flops += columns.map(|below| below * below).sum::<f64>();
            let pattern = draft.pattern();
            let rows = pattern.column(rank).iter().map(|row| dim(draft.order[*row as usize]));
            of_matrix += rows.sum::<usize>() * width;
            of_factor += height * width;
        }
        elimination.fill = of_factor as f64 / of_matrix.max(1) as f64;
        elimination
    }

    /// Returns the operations per block that a better order may reduce; zero without fill.
    fn worth(&self) -> f64 {
        if self.fill > WORTH_FILL { self.flops / self.order.len() as f64 } else { 0.0 }
    }

    pub(crate) fn pattern(&self) -> Pattern<'_> {
        Pattern { ptr: &self.ptr, rows: &self.rows }
    }

    /// Builds the lower triangle for an order. Rows of a column are ascending.
    fn lower_triangle(graph: &Adjacency, order: Vec<usize>) -> Self {
        let mut rank = vec![0_u32; order.len()];
        order.iter().enumerate().for_each(|(r, block)| rank[*block] = r as u32);
        let (mut ptr, mut rows) = (Vec::with_capacity(order.len() + 1), vec![]);
        ptr.push(0);
        rows.reserve(graph.neighbours.len() / 2 + order.len());
        for (r, &block) in order.iter().enumerate() {
            let begin = rows.len();
            rows.push(r as u32);
            let neighbours = graph.neighbours(block).iter().map(|u| rank[*u as usize]);
            rows.extend(neighbours.filter(|u| *u as usize > r));
            rows[begin..].sort_unstable();
            ptr.push(rows.len());
        }
        Self { order, rank, ptr, rows, flops: 0.0, fill: 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn another_order_is_tried_where_the_factor_fills_in_and_not_in_a_dense_graph() {
        let clique: Vec<_> = (0..300).flat_map(|a| (0..a).map(move |b| (a, b))).collect();
        let dense = Elimination::new(&Adjacency::new(vec![6; 300], &clique), &Vec::from_iter(0..300));
        assert!(dense.fill == 1.0 && dense.worth() == 0.0, "{}", dense.fill);
        let (side, mut edges) = (30, vec![]);
        for v in 0..side * side {
            edges.extend((v >= side).then(|| (v, v - side)));
            edges.extend((v % side > 0).then(|| (v, v - 1)));
        }
        let grid = Adjacency::new(vec![6; (side * side) as usize], &edges);
        let elimination = Elimination::new(&grid, &minimum_degree::minimum_degree(&grid).unwrap());
        assert!(elimination.fill > 2.0 && elimination.worth() > WORTH_TRIES, "{}", elimination.fill);
    }

    proptest! {
        #[test]
        fn every_order_has_each_block_once(
            weights in prop::collection::vec(1..10u32, 1..300),
            raw in prop::collection::vec((0..300u32, 0..300u32), 0..900),
        ) {
            let n = weights.len() as u32;
            let first: Vec<bool> = weights.iter().map(|w| w % 3 == 0).collect();
            let mut edges: Vec<_> = raw.into_iter().map(|(a, b)| (a % n, b % n)).filter(|(a, b)| a != b)
                .map(|(a, b)| (a.max(b), a.min(b))).collect();
            edges.sort_unstable();
            edges.dedup();
            let graph = Adjacency::new(weights, &edges);
            let all = [Order::Best, Order::Natural, Order::MinimumDegree, Order::ColumnDegree,
                Order::NestedDissection, Order::Given((0..n as usize).rev().collect()), Order::First(first.clone())];
            for kind in all {
                let elimination = kind.of(&graph).unwrap();
                let mut sorted = elimination.order.clone();
                sorted.sort_unstable();
                prop_assert_eq!(sorted, (0..n as usize).collect::<Vec<_>>(), "{:?}", kind);
            }
            // subtrees of marked blocks may be next to unmarked ones, but never above them
            let elimination = Order::First(first.clone()).of(&graph).unwrap();
            let tree = Tree::new(elimination.pattern(), |_| 1);
            for (rank, parent) in tree.parent.iter().enumerate().filter(|(_, p)| **p as usize != u32::MAX as usize) {
                let mark = |rank: usize| first[elimination.order[rank]];
                prop_assert!(mark(rank) || !mark(*parent as usize));
            }
        }
    }
}
