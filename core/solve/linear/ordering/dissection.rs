//! Nested dissection: split a graph by a small separator, order both sides, then the separator (George,
//! 1973).
use super::adjacency::Adjacency;
use super::minimum_degree;
use super::separator::{self, SEPARATOR};

/// Pieces of at most this many vertices are ordered by minimum degree.
const MAX_PIECE: usize = 120;

/// Returns an elimination order of the vertices; `None` if there is no memory.
pub(crate) fn nested_dissection(graph: &Adjacency) -> Option<Vec<usize>> {
    let mut order = Vec::with_capacity(graph.len());
    // pieces to be ordered, the last first, each with its vertices in the whole graph
    let mut pieces = vec![Piece::Split(graph.clone(), (0..graph.len()).collect())];
    while let Some(piece) = pieces.pop() {
        let (graph, of) = match piece {
            Piece::Split(graph, of) => (graph, of),
            Piece::Ordered(of) => {
                order.extend(of);
                continue;
            }
        };
        let sides = if graph.len() > MAX_PIECE { separator::separate(&graph) } else { vec![] };
        let is_split = [0, 1].iter().all(|side| sides.contains(side));
        if !is_split {
            order.extend(minimum_degree::minimum_degree(&graph)?.into_iter().map(|v| of[v]));
            continue;
        }
        let part = |side: u8| -> Vec<usize> { (0..sides.len()).filter(|v| sides[*v] == side).collect() };
        let whole = |part: &[usize]| -> Vec<usize> { part.iter().map(|v| of[*v]).collect() };
        pieces.push(Piece::Ordered(whole(&part(SEPARATOR))));
        for side in [1, 0] {
            let part = part(side);
            pieces.push(Piece::Split(graph.induced(&part), whole(&part)));
        }
    }
    Some(order)
}

enum Piece {
    /// A graph, and its vertices in the whole graph.
    Split(Adjacency, Vec<usize>),
    /// Vertices of the whole graph, in order.
    Ordered(Vec<usize>),
}
