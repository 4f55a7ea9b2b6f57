//! Approximate minimum degree (Amestoy, Davis and Duff, 1996), by faer.
use super::adjacency::Adjacency;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

/// Returns an elimination order of the vertices; `None` if there is no memory.
pub(crate) fn minimum_degree(graph: &Adjacency) -> Option<Vec<usize>> {
    let n = graph.len();
    let (mut order, mut inverse) = (vec![0_u32; n], vec![0_u32; n]);
    let mut memory = MemBuffer::try_new(amd::order_scratch::<u32>(n, graph.neighbours.len())).ok()?;
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, &graph.ptr, None, &graph.neighbours);
    amd::order(&mut order, &mut inverse, pattern, amd::Control::default(), MemStack::new(&mut memory))
        .ok()?;
    Some(order.into_iter().map(|v| v as usize).collect())
}
