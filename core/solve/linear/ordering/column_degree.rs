//! Column approximate minimum degree (Davis, Gilbert, Larimore and Ng, 2004), by faer.
use super::adjacency::Adjacency;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::colamd;

/// Returns an elimination order of the vertices, as the columns of a matrix with one row per edge. `None`
/// if there is no memory.
pub(crate) fn column_degree(graph: &Adjacency) -> Option<Vec<usize>> {
    let n = graph.len();
    // for each vertex its edges, numbered in the list of their larger end
    let mut rows: Vec<Vec<usize>> = vec![vec![]; n];
    let mut edges = 0;
    for v in 0..n {
        for &u in graph.neighbours(v).iter().filter(|u| (**u as usize) < v) {
            rows[v].push(edges);
            rows[u as usize].push(edges);
            edges += 1;
        }
    }
    let mut ptr = vec![0];
    ptr.extend(rows.iter().scan(0, |end, rows| {
        *end += rows.len();
        Some(*end)
    }));
    let rows = rows.concat();
    let pattern = SymbolicSparseColMatRef::new_checked(edges, n, &ptr, None, &rows);
    let (mut order, mut inverse) = (vec![0_usize; n], vec![0_usize; n]);
    let mut memory = MemBuffer::try_new(colamd::order_scratch::<usize>(edges, n, rows.len())).ok()?;
    colamd::order(&mut order, &mut inverse, pattern, colamd::Control::default(), MemStack::new(&mut memory))
        .ok()?;
    Some(order)
}
