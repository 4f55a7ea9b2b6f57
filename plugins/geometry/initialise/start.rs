//! Spanning trees as a start that is chosen by name.
use super::parts::Parts;
use super::{Tree, as_factor, seen_point, spanning_tree};
use crate::{Between, Point1, Point2, Point3, Prior, Se2, Se3, So2, So3};
use manifactor_graph::{FactorEntry, Fixed, Graph, Key, Values, register};
use manifactor_solve::{Start, StartError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Variables placed one from the other along a spanning tree of the between factors.
///
/// Begins in each connected part at the held variables, else at a prior, else at its first variable, which
/// keeps its value. Points are placed from where they were first seen; anything else stays.
///
/// ```toml
/// start = { type = "spanning_tree", tree = "shallow" }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SpanningTree {
    /// `chain`: along the odometry, where its factors come first. `shallow`: by as few factors as possible.
    pub tree: Tree,
}

#[typetag::serde(name = "spanning_tree")]
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
        reseat(graph, &mut started);
        Ok(started)
    }
}
register!(dyn Start, "spanning_tree", SpanningTree);

/// Puts points that are not held, and that nothing but sightings places, to where they were first seen.
pub(crate) fn reseat(graph: &Graph, values: &mut Values) {
    let mut done: Vec<&Key> = graph.factors().iter().filter_map(placed).flatten().collect();
    done.extend(graph.fixed().iter().filter(|(_, fixed)| **fixed != Fixed::Whole(false)).map(|(key, _)| key));
    let mut done: std::collections::HashSet<&Key> = done.into_iter().collect();
    for entry in graph.factors() {
        if let Some((key, point)) = seen_point(entry, values)
            && done.insert(key)
        {
            values.insert_boxed(key.clone(), point);
        }
    }
}

/// The variables that a between factor or a prior places.
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

/// The values that variables are placed from: those held, and of each part that nothing holds and no prior
/// is in, the first. `None` where there is no between factor.
fn roots(graph: &Graph, values: &Values) -> Option<Values> {
    let mut parts = Parts::new(values.len());
    let mut found = false;
    let place = |key: &Key| values.position(key.as_str());
    for [a, b] in graph.factors().iter().filter_map(joined) {
        found = true;
        if let (Some(a), Some(b)) = (place(a), place(b)) {
            parts.join(a, b);
        }
    }
    let held = |key: &Key| graph.fixed().get(key).is_some_and(|f| *f != Fixed::Whole(false));
    let mut is_held = vec![false; values.len()];
    let known = graph
        .fixed()
        .keys()
        .filter(|key| held(key))
        .chain(graph.factors().iter().filter_map(prior).flatten());
    known.filter_map(place).for_each(|i| is_held[parts.root(i)] = true);
    let mut roots = Values::new();
    for (i, (key, value)) in values.iter().enumerate() {
        if held(key) || (parts.root(i) == i && !is_held[i]) {
            roots.insert_boxed(key.clone(), value.erased().clone_box());
        }
    }
    found.then_some(roots)
}
