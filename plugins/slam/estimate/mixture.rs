//! Boxes that may show either of two objects.
use super::variance::box_of;
use crate::association::Ambiguity;
use crate::input::sequence::ObjectId;
use crate::mapping::{Mapping, object_key, pose_key};
use manifactor_graph::checked::Positive;
use manifactor_graph::{FactorEntry, Key, Noise};
use manifactor_quadric::CentroidDepth;
use manifactor_semantic::{Component, MaxMixture};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Makes each factor of an ambiguous box the better of two: of the object that the box was put to, and of the other one. Returns how many
/// factors are mixtures now.
pub(super) fn mix(mapping: &mut Mapping) -> usize {
    let mapped: HashSet<ObjectId> = mapping.mapped().map(|object| object.id).collect();
    let both_mapped = |a: &&Ambiguity| mapped.contains(&a.object) && mapped.contains(&a.other);
    let ambiguous: HashMap<[Key; 2], Ambiguity> = mapping
        .ambiguities
        .iter()
        .filter(both_mapped)
        .map(|a| ([pose_key(a.frame), object_key(a.object)], *a))
        .collect();
    let mut mixed = 0;
    for entry in mapping.graph.factors_mut().iter_mut().filter(|entry| is_of_box(entry)) {
        let [pose, object, ..] = &entry.keys[..] else { continue };
        if let Some(ambiguity) = ambiguous.get(&[pose.clone(), object.clone()]) {
            mixed += usize::from(make_mixture(entry, ambiguity));
        }
    }
    mixed
}

fn is_of_box(entry: &FactorEntry) -> bool {
    box_of(entry).is_some() || entry.factor.erased().as_any().is::<CentroidDepth>()
}

fn make_mixture(entry: &mut FactorEntry, ambiguity: &Ambiguity) -> bool {
    let keys = entry.keys.len();
    let component = |weight, object| Component {
        weight,
        factor: Some(entry.factor.clone()),
        // the pose, the object, and what offset the box has
        over: Some([0, object].into_iter().chain(2..keys).collect()),
        noise: entry.noise.clone(),
    };
    let even = Positive::literal(1.0);
    // a depth says nothing of the class, and the box beside it has said it
    let ratio = box_of(entry).map_or(even, |_| ambiguity.class_ratio);
    let components = vec![component(even, 1), component(ratio, keys)];
    // one factor with one noise always fits itself
    let Ok(mixture) = MaxMixture::new(components) else { return false };
    entry.keys.push(object_key(ambiguity.other));
    (entry.factor, entry.noise) = (Arc::new(mixture), Noise::default());
    true
}
