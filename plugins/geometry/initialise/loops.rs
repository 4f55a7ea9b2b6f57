//! Detects loops whose rotations add up to extra turns: the sign of a wrong minimum of a pose graph.
//!
//! Along a loop, the residual rotations add up to the total measurement error plus one full turn per winding
//! of the estimate. No single residual of such a loop needs to be large, and the size of the cost depends on
//! the unit of the noise; the number of turns does not. The check covers the loops that each remaining edge
//! closes in a spanning tree of minimum depth: one pass over the edges, without a linear system.
use super::as_factor;
use super::pose::Pose;
use crate::{Between, Prior, Se2, Se3, So2, So3};
use manifactor_graph::{Factor, FactorEntry, Graph, Key, Values};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Returns whether the residual rotations of some loop add up to more than half a turn. In space they are
/// summed as vectors in the outer frame, which is exact if they turn about one axis.
pub(crate) fn is_wound(graph: &Graph, values: &Values) -> bool {
    is_wound_in::<Se2, 2>(graph, values)
        || is_wound_in::<Se3, 3>(graph, values)
        || is_wound_in::<So2, 2>(graph, values)
        || is_wound_in::<So3, 3>(graph, values)
}

/// A measured rotation between two nodes, and its residual in the outer frame.
struct Edge {
    a: usize,
    b: usize,
    residual: Vector3<f64>,
}

fn is_wound_in<P: Pose<D>, const D: usize>(graph: &Graph, values: &Values) -> bool
where
    Between<P>: Factor,
    Prior<P>: Factor,
{
    // Priors are measured from the outer frame, an additional node.
    let outer = values.len();
    let pose = |key: &Key| {
        let (place, value) = values.find(key.as_str())?;
        Some((place, value.erased().as_any().downcast_ref::<P>()?))
    };
    let edge = |entry: &FactorEntry| {
        let ((a, from), (b, to), relative) =
            if let Some((between, [a, b])) = as_factor::<Between<P>, 2>(entry) {
                let (a, from) = pose(a)?;
                ((a, from.rotation()), pose(b)?, &between.relative)
            } else {
                let (prior, [x]) = as_factor::<Prior<P>, 1>(entry)?;
                ((outer, P::identity().rotation()), pose(x)?, &prior.value)
            };
        let measured = from * relative.rotation();
        let (omega, _) = P::logarithm(&measured.tr_mul(&to.rotation()));
        // In the plane, rotations are about z only, which is identical in all frames.
        let residual = if D == 3 {
            Vector3::from_fn(|r, _| (0..D).map(|c| measured[(r, c)] * omega[c]).sum())
        } else {
            omega
        };
        Some(Edge { a, b, residual })
    };
    let edges: Vec<Edge> = graph.factors().iter().filter_map(edge).collect();
    has_turn(outer + 1, &edges)
}

/// Returns whether the residuals of a loop add up to more than half a turn.
fn has_turn(nodes: usize, edges: &[Edge]) -> bool {
    // Edges by node.
    let mut first = vec![0_u32; nodes + 1];
    edges.iter().flat_map(|e| [e.a, e.b]).for_each(|node| first[node + 1] += 1);
    (0..nodes).for_each(|node| first[node + 1] += first[node]);
    let (mut next, mut at) = (first.clone(), vec![0_u32; 2 * edges.len()]);
    for (i, edge) in edges.iter().enumerate() {
        for node in [edge.a, edge.b] {
            at[next[node] as usize] = i as u32;
            next[node] += 1;
        }
    }
    // Sum of the residuals from the root, by node.
    let mut sums: Vec<Option<Vector3<f64>>> = vec![None; nodes];
    let mut queue = Vec::with_capacity(nodes);
    for root in 0..nodes {
        if sums[root].is_some() || first[root] == first[root + 1] {
            continue;
        }
        sums[root] = Some(Vector3::zeros());
        queue.clear();
        queue.push(root);
        let mut done = 0;
        while let Some(&node) = queue.get(done) {
            done += 1;
            let Some(sum) = sums[node] else { continue };
            for i in first[node]..first[node + 1] {
                let Edge { a, b, residual } = &edges[at[i as usize] as usize];
                let (other, there) = if *a == node { (*b, sum + residual) } else { (*a, sum - residual) };
                match sums[other] {
                    Some(known) if (there - known).norm() > PI => return true,
                    Some(_) => {}
                    None => {
                        sums[other] = Some(there);
                        queue.push(other);
                    }
                }
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;
    use std::f64::consts::TAU;

    /// Poses on a circle about an axis that is not a coordinate axis. The values go around `turns` times, the
    /// measurements once.
    fn ring(n: usize, turns: f64) -> (Graph, Values) {
        let step = |turns: f64| {
            let turn = Vector3::new(2.0, -1.0, 2.0) / 3.0 * (TAU * turns / n as f64);
            Se3::exp(&Vector6::new(turn.x, turn.y, turn.z, 1.0, 0.0, 0.0))
        };
        let (mut graph, mut values, mut pose) = (Graph::new(), Values::new(), Se3::identity());
        for i in 0..n {
            values.insert(Key::indexed("x", i), pose);
            pose = pose.compose(&step(turns));
            graph
                .add([Key::indexed("x", i), Key::indexed("x", (i + 1) % n)], Between { relative: step(1.0) });
        }
        (graph, values)
    }

    #[test]
    fn a_loop_with_a_turn_too_many_or_too_few_is_wound() {
        for (turns, expected) in [(1.0, false), (0.0, true), (2.0, true), (-1.0, true)] {
            let (graph, values) = ring(30, turns);
            assert_eq!(is_wound(&graph, &values), expected, "{turns}");
        }
    }

    #[test]
    fn a_chain_has_no_loops_unless_priors_close_one() {
        let (mut graph, values) = ring(30, 0.0);
        graph.factors_mut().pop();
        assert!(!is_wound(&graph, &values));
        for i in [0, 29] {
            let key = Key::indexed("x", i);
            let value = *values.get::<Se3>(&key).unwrap();
            graph.add([key], Prior { value });
        }
        assert!(is_wound(&graph, &values));
    }
}
