//! Boxes that may show either of two objects.
use crate::association::Ambiguity;
use crate::input::sequence::ObjectId;
use crate::mapping::{Mapping, object_key, pose_key};
use manifactor_graph::checked::Positive;
use manifactor_graph::{FactorEntry, Key, Noise};
use manifactor_quadric::{BoundingBoxFactor, CentroidDepth};
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
        let keys = <[Key; 2]>::try_from(entry.keys.clone());
        if let Some(ambiguity) = keys.ok().and_then(|keys| ambiguous.get(&keys)) {
            mixed += usize::from(make_mixture(entry, ambiguity));
        }
    }
    mixed
}

fn is_of_box(entry: &FactorEntry) -> bool {
    let factor = entry.factor.erased().as_any();
    factor.is::<BoundingBoxFactor>() || factor.is::<CentroidDepth>()
}

fn make_mixture(entry: &mut FactorEntry, ambiguity: &Ambiguity) -> bool {
    let component = |weight, object| Component {
        weight,
        factor: Some(entry.factor.clone()),
        over: Some(vec![0, object]),
        noise: entry.noise.clone(),
    };
    let components = vec![component(Positive::literal(1.0), 1), component(ambiguity.class_ratio, 2)];
    // one factor with one noise always fits itself
    let Ok(mixture) = MaxMixture::new(components) else { return false };
    entry.keys.push(object_key(ambiguity.other));
    (entry.factor, entry.noise) = (Arc::new(mixture), Noise::default());
    true
}
