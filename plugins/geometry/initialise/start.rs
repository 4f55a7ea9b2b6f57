//! Spanning trees as a named start for solvers.
use super::parts::ConnectedSets;
use super::{Tree, as_factor, seen_point, spanning_tree};
use crate::{Between, Point1, Point2, Point3, Prior, Se2, Se3, So2, So3};
use manifactor_graph::{FactorEntry, Fixed, Graph, Key, Values, register};
use manifactor_solve::{Start, StartError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;

/// Variables placed one after another along a spanning tree of the between factors.
///
/// Each connected part begins at its held variables, otherwise at a prior, otherwise at its first variable,
/// which keeps its value. Points are placed from their first measurement; other variables keep their values.
///
/// ```toml
/// start = { type = "spanning_tree", tree = "shallow" }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SpanningTree {
    /// `chain` follows the odometry, if its factors come first. `shallow` uses as few factors as possible.
    pub tree: Tree,
}

#[typetag::serialize(name = "spanning_tree")]
impl Start for SpanningTree {
    fn start(&self, graph: &Graph, values: &Values) -> Result<Values, StartError> {
        let Some(roots) = roots(graph, values) else {
            return Err(StartError::NotApplicable { start: "spanning_tree", needs: "between factors" });
        };
        let grown = spanning_tree(graph, &roots, self.tree)?;
        let mut started = values.clone();
        for (key, value) in grown.iter() {
            started.insert_boxed(key.clone(), value.erased().clone_box());
        }
        place_points(graph, &mut started);
        Ok(started)
    }
}
register!(dyn Start, "spanning_tree", SpanningTree);

/// Moves free points to their first measured position, unless a prior or between factor places them.
pub(crate) fn place_points(graph: &Graph, values: &mut Values) {
    let seen: Vec<_> = graph.factors().iter().filter_map(|entry| seen_point(entry, values)).collect();
    if seen.is_empty() {
        return;
    }
    let held = graph.fixed().keys().filter(|key| is_held(graph, key));
    let mut done: HashSet<&Key> = graph.factors().iter().filter_map(placed).flatten().chain(held).collect();
    for (key, point) in seen {
        if done.insert(key) {
            values.insert_boxed(key.clone(), point);
        }
    }
}

fn is_held(graph: &Graph, key: &Key) -> bool {
    graph.fixed().get(key).is_some_and(|fixed| *fixed != Fixed::Whole(false))
}

/// Returns the variables that a between factor or a prior places.
fn placed(entry: &FactorEntry) -> Option<&[Key]> {
    joined(entry).map(<[Key; 2]>::as_slice).or_else(|| prior(entry).map(<[Key; 1]>::as_slice))
}

macro_rules! of_any_type {
    ($name:ident, $factor:ident, $n:literal, $($type:ty),*) => {
        fn $name(entry: &FactorEntry) -> Option<&[Key; $n]> {
            None$(.or_else(|| as_factor::<$factor<$type>, $n>(entry).map(|(_, keys)| keys)))*
        }
    };
}
of_any_type!(joined, Between, 2, Se3, Se2, So3, So2, Point3, Point2, Point1);
of_any_type!(prior, Prior, 1, Se3, Se2, So3, So2, Point3, Point2, Point1);

/// Returns the values from which variables are placed: the held ones, and the first of each part without a
/// held variable or prior. `None` if there is no between factor.
fn roots(graph: &Graph, values: &Values) -> Option<Values> {
    let mut parts = ConnectedSets::new(values.len());
    let mut found = false;
    let place = |key: &Key| values.position(key.as_str());
    for [a, b] in graph.factors().iter().filter_map(joined) {
        found = true;
        if let (Some(a), Some(b)) = (place(a), place(b)) {
            parts.join(a, b);
        }
    }
    let held = graph.fixed().keys().filter(|key| is_held(graph, key));
    let priors = graph.factors().iter().filter_map(prior).flatten();
    let mut part_is_rooted = vec![false; values.len()];
    held.chain(priors).filter_map(place).for_each(|i| part_is_rooted[parts.root(i)] = true);
    let mut roots = Values::new();
    for (i, (key, value)) in values.iter().enumerate() {
        if is_held(graph, key) || (parts.root(i) == i && !part_is_rooted[i]) {
            roots.insert_boxed(key.clone(), value.erased().clone_box());
        }
    }
    found.then_some(roots)
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_graph::Manifold;
    use nalgebra::{Vector2, Vector3};

    fn pose(x: f64) -> Se2 {
        Se2::exp(&Vector3::new(x, 0.0, 0.0))
    }

    #[test]
    fn each_part_keeps_what_is_held_or_its_prior_or_its_first_value() {
        let (mut graph, mut values) = (Graph::new(), Values::new());
        for key in ["a0", "a1", "b0", "b1", "c0", "c1"] {
            values.insert(key, pose(10.0));
        }
        for [x, y] in [["a0", "a1"], ["b0", "b1"], ["c0", "c1"]] {
            graph.add([x, y], Between { relative: pose(1.0) });
        }
        graph.fix("a1");
        graph.add(["b1"], Prior { value: pose(5.0) });
        let started = SpanningTree::default().start(&graph, &values).unwrap();
        let x: Vec<f64> = started.all::<Se2>().map(|(_, x)| x.translation.x).collect();
        assert_eq!(x, [9.0, 10.0, 4.0, 5.0, 10.0, 11.0]);
    }

    #[test]
    fn what_no_tree_reaches_stays_and_points_are_seen_again() {
        let (mut graph, mut values) = (Graph::new(), Values::new());
        for key in ["x0", "x1", "alone"] {
            values.insert(key, pose(3.0));
        }
        values.insert("p", Point2::new(Vector2::new(9.0, 9.0)));
        graph.add(["x0", "x1"], Between { relative: pose(1.0) });
        let position = crate::Coordinates::new(Vector2::new(1.0, 0.0)).unwrap();
        graph.add(["x1", "p"], crate::Landmark { position });
        let started = SpanningTree { tree: Tree::Shallow }.start(&graph, &values).unwrap();
        assert_eq!(started.get::<Point2>("p").unwrap().0, Vector2::new(5.0, 0.0));
        assert!(started.get::<Se2>("alone").unwrap().local(&pose(3.0)).norm() < 1e-15);
        let error = SpanningTree::default().start(&Graph::new(), &values).unwrap_err();
        assert!(error.to_string().contains("needs between factors"), "{error}");
    }
}
