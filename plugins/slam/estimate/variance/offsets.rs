//! Variables for what lasts of the errors of boxes: an offset of the four sides for each object and interval of time.
use super::VarianceSettings;
use super::boxes::{self, BoxComponent, group};
use super::components::{Components, Measures, VarianceError, measures, times};
use super::lasting::LastingComponent;
use crate::input::sequence::Sequence;
use crate::mapping::Mapping;
use crate::settings::{offset_key, offset_owner};
use manifactor_geometry::{Between, Point4, Prior};
use manifactor_graph::{Factor, FactorEntry, Key, Noise, Values};
use manifactor_quadric::{BoundingBoxFactor, BoundingBoxOffset};
use nalgebra::Vector4;
use std::collections::HashMap;
use std::sync::Arc;

/// An interval is this part of the time for which errors last.
const INTERVAL: f64 = 0.5;
/// After so many times that time nothing is left.
const GONE: f64 = 10.0;

/// The variance of the mean over an interval of what lasts, as a part of its variance at one time.
pub(super) fn kept_by_mean() -> f64 {
    2.0 / (INTERVAL * INTERVAL) * (INTERVAL - 1.0 + (-INTERVAL).exp())
}

/// No offset.
pub(super) fn zero() -> Point4 {
    Point4::new(Vector4::zeros())
}

/// The box that a factor measures, with an offset or without.
pub(in crate::estimate) fn box_of(entry: &FactorEntry) -> Option<&BoundingBoxFactor> {
    let factor = entry.factor.erased().as_any();
    let shifted = || factor.downcast_ref::<BoundingBoxOffset>().map(|shifted| &shifted.0);
    factor.downcast_ref::<BoundingBoxFactor>().or_else(shifted)
}

/// A box: its factor's place in the graph, its time and its extents.
struct Place {
    entry: usize,
    time: f64,
    size: [f64; 2],
}

/// Takes all offsets out of a graph.
pub(super) fn remove(mapping: &mut Mapping, values: &mut Values) {
    let factors = mapping.graph.factors_mut();
    factors.retain(|entry| !entry.keys.iter().all(|key| offset_owner(key).is_some()));
    for entry in factors {
        let factor = entry.factor.erased().as_any().downcast_ref::<BoundingBoxOffset>();
        if let (Some(factor), Some(offset)) =
            (factor.cloned(), entry.keys.pop_if(|key| offset_owner(key).is_some()))
        {
            entry.factor = Arc::new(factor.0);
            values.remove(offset.as_str());
        }
    }
}

/// Gives the boxes of each object whose errors last offsets in common, one for each interval in which there are boxes. Offsets begin at zero.
///
/// # Errors
/// A standard deviation that is zero or not finite.
pub(super) fn add(
    components: &Components,
    mapping: &mut Mapping,
    values: &mut Values,
    sequence: &Sequence,
    settings: &VarianceSettings,
) -> Result<(), VarianceError> {
    let times = times(sequence);
    let mut places: HashMap<Key, Vec<Place>> = HashMap::new();
    for (i, entry) in mapping.graph.factors().iter().enumerate() {
        if let (Measures::Box { object }, Some(size)) = (measures(entry), boxes::size(entry)) {
            let time = entry.keys.first().and_then(|pose| times.get(pose)).copied().unwrap_or_default();
            places.entry(object).or_default().push(Place { entry: i, time, size });
        }
    }
    for object in mapping.objects.clone() {
        let Some(component) = components.boxes.get(&group(&object, settings.boxes)) else { continue };
        if let (Some(boxes), Some(lasting)) = (places.get(&object.key), component.lasting) {
            Offsets { mapping, values, object: &object.key, component, lasting }.add(boxes)?;
        }
    }
    Ok(())
}

/// A graph that gets the offsets of one object.
struct Offsets<'a> {
    mapping: &'a mut Mapping,
    values: &'a mut Values,
    object: &'a Key,
    component: &'a BoxComponent,
    lasting: LastingComponent,
}

impl Offsets<'_> {
    /// For boxes in the order of time.
    fn add(&mut self, boxes: &[Place]) -> Result<(), VarianceError> {
        let mean = [0, 1].map(|i| boxes.iter().map(|b| b.size[i]).sum::<f64>() / boxes.len() as f64);
        let mut times: Vec<f64> = vec![];
        let mut rest = boxes;
        while let Some(first) = rest.first() {
            let end = first.time + INTERVAL * self.lasting.seconds;
            let (here, later) = rest.split_at(rest.iter().take_while(|b| b.time < end).count().max(1));
            for place in here {
                self.shift(place.entry, times.len());
            }
            self.values.insert(self.key(times.len()), zero());
            times.push(here.iter().map(|b| b.time).sum::<f64>() / here.len() as f64);
            rest = later;
        }
        self.chain(&times, mean)
    }

    /// Priors and factors between neighbours whose information is that of a Gauss-Markov chain: with c and c' the correlations with the
    /// neighbours, c/(1 - c²)/σ² between two, and (1/(1 + c) + 1/(1 + c') - 1)/σ² for each alone.
    fn chain(&mut self, times: &[f64], size: [f64; 2]) -> Result<(), VarianceError> {
        let correlation = |pair: &[f64]| {
            let steps = (pair[1] - pair[0]) / self.lasting.seconds;
            if steps < GONE { (-steps).exp() } else { 0.0 }
        };
        let correlations: Vec<f64> = times.windows(2).map(correlation).collect();
        let of_side = |size: f64| self.component.at(size) * self.lasting.in_offsets();
        let [x, y] = size.map(of_side);
        let noise = |information: f64| Noise::sigmas(&[x, y, x, y].map(|sigma| sigma / information.sqrt()));
        for k in 0..times.len() {
            let before = k.checked_sub(1).and_then(|k| correlations.get(k)).copied().unwrap_or_default();
            let after = correlations.get(k).copied().unwrap_or_default();
            let alone = noise(1.0 / (1.0 + before) + 1.0 / (1.0 + after) - 1.0)?;
            self.push(vec![self.key(k)], Arc::new(Prior { value: zero() }), alone);
            if after > 0.0 {
                let both = noise(after / (1.0 - after * after))?;
                self.push(vec![self.key(k), self.key(k + 1)], Arc::new(Between { relative: zero() }), both);
            }
        }
        Ok(())
    }

    fn key(&self, interval: usize) -> Key {
        offset_key(self.object, interval)
    }

    /// Gives a box the offset of an interval.
    fn shift(&mut self, entry: usize, interval: usize) {
        let offset = self.key(interval);
        let Some(entry) = self.mapping.graph.factors_mut().get_mut(entry) else { return };
        if let Some(factor) = box_of(entry).cloned() {
            entry.factor = Arc::new(BoundingBoxOffset(factor));
            entry.keys.push(offset);
        }
    }

    fn push(&mut self, keys: Vec<Key>, factor: Arc<dyn Factor>, noise: Noise) {
        self.mapping.graph.push(FactorEntry { keys, name: None, factor, noise, loss: None });
    }
}
