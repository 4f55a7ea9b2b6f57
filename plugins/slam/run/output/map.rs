//! The map that a run leaves, for other runs to begin with.
use manifactor_graph::{FactorEntry, Graph, Key, Noise};
use manifactor_mapping::estimate::looks::{Looked, looks};
use manifactor_mapping::estimate::{Estimate, Landmark};
use manifactor_mapping::mapping::measurements::Measured;
use manifactor_mapping::mapping::object_key;
use manifactor_mapping::settings::Settings;
use manifactor_quadric::QuadricPrior;
use manifactor_recording::prior_map::{PriorMap, PriorObject};
use manifactor_recording::sequence::ObjectId;
use manifactor_solve::{CompileError, CovarianceError, Problem, WeightError};
use nalgebra::DMatrix;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Why there is no map.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// The graph does not go with the estimate.
    #[error(transparent)]
    Compile(#[from] CompileError),
    /// The solver's weights do not go with the graph.
    #[error(transparent)]
    Weights(#[from] WeightError),
    /// It is not known how well objects are known.
    #[error(transparent)]
    Covariance(#[from] CovarianceError),
}

/// A factor whose loss gives it less counts this much.
const LEAST_WEIGHT: f64 = 1e-9;
/// As well as an object is known of which nothing is known: rad, m, and the logarithm of its axes.
const UNKNOWN: [f64; 9] = [1.0, 1.0, 1.0, 10.0, 10.0, 10.0, 1.0, 1.0, 1.0];

/// The map of an estimate, without those objects that are gone. Objects of that map without new views are as they were
/// read, so that a map does not fade from run to run.
///
/// # Errors
/// If there are no covariances.
pub fn map_of(estimate: &Estimate, settings: &Settings) -> Result<PriorMap, MapError> {
    let new = looks(estimate, *settings.detections.border_px);
    let mut covariances = covariances(estimate)?;
    let object = |landmark: Landmark<'_>| {
        let Landmark { object, quadric, .. } = landmark;
        let measured = estimate.mapping.measurements.object(object.id)?;
        let looked = new.get(&object.id).copied().unwrap_or_default();
        if is_gone(measured, looked, settings) {
            return None;
        }
        let looks = measured.prior.as_ref().map(|prior| prior.looks).unwrap_or_default().plus(looked.all);
        if let Some(prior) = measured.prior.as_ref().filter(|_| measured.views.is_empty()) {
            let classes = measured.classes().clone();
            return Some(Arc::new(PriorObject { classes, looks, ..PriorObject::clone(prior) }));
        }
        Some(Arc::new(PriorObject {
            id: object.id,
            classes: measured.classes().clone(),
            quadric: *quadric,
            covariance: covariances.remove(object.key.as_str())?,
            looks,
            least_px: measured.least_px(),
        }))
    };
    let objects = estimate.landmarks().into_iter().filter_map(object).collect();
    Ok(PriorMap::new(estimate.mapping.frame.up, objects))
}

/// The smallest chance to miss an object in all looks at which it is believed to be there.
const MISSED: f64 = 0.001;
/// An object that is gone was looked at so many times.
const LOOKS: usize = 8;

/// The mapped objects that are not there any more, by number.
pub(super) fn gone(estimate: &Estimate, settings: &Settings) -> Vec<ObjectId> {
    let looks = looks(estimate, *settings.detections.border_px);
    let is_gone = |(id, looked): (ObjectId, Looked)| {
        let measured = estimate.mapping.measurements.object(id)?;
        is_gone(measured, looked, settings).then_some(id)
    };
    looks.into_iter().filter_map(is_gone).collect()
}

/// Returns whether an object is not there any more: it should have been seen since it was seen last, in this run or before, and was not.
fn is_gone(measured: &Measured, looked: Looked, settings: &Settings) -> bool {
    let prior = measured.prior.as_ref().map(|prior| prior.looks).unwrap_or_default();
    let missed = (1.0 - prior.plus(looked.before).rate()).powf(looked.since as f64);
    // boxes that are held out are not missed
    settings.evaluation.holdout.is_none() && looked.since >= LOOKS && missed < MISSED
}

/// Has the factors of an earlier map count by the covariances that were read, and not by those that were trusted: what is written says again
/// what white noise would leave. Their loss gives them as much weight as in the solve.
fn as_written(graph: &mut Graph, estimate: &Estimate) {
    let weights: HashMap<usize, f64> =
        estimate.solution.factors.iter().map(|f| (f.entry, f.weight)).collect();
    let priors = estimate.mapping.measurements.objects.iter().filter_map(|object| object.prior.as_ref());
    let priors: HashMap<Key, _> = priors.map(|prior| (object_key(prior.id), prior)).collect();
    let known = |entry: &FactorEntry| {
        let held = entry.factor.erased().as_any().downcast_ref::<QuadricPrior>()?;
        let prior = priors.get(entry.keys.first()?)?;
        (entry.keys.len() == 1 && prior.quadric == held.value).then_some(*prior)
    };
    for (place, entry) in graph.factors_mut().iter_mut().enumerate() {
        let Some(prior) = known(entry) else { continue };
        let weight = weights.get(&place).copied().unwrap_or(1.0).max(LEAST_WEIGHT);
        let noise = Noise::covariance(DMatrix::from_fn(9, 9, |r, c| prior.covariance[r][c] / weight));
        // what was read has one
        entry.noise = noise.unwrap_or_default();
        entry.loss = None;
    }
}

/// The covariance of each object, by its key. Directions that nothing determines are known as badly as can be.
fn covariances(estimate: &Estimate) -> Result<HashMap<String, [[f64; 9]; 9]>, MapError> {
    let (mut graph, values) = (estimate.mapping.graph.clone(), &estimate.solution.values);
    let keys: HashSet<&str> = estimate.mapping.mapped().map(|object| object.key.as_str()).collect();
    if keys.is_empty() {
        return Ok(HashMap::new());
    }
    as_written(&mut graph, estimate);
    for landmark in estimate.landmarks() {
        graph.push(FactorEntry {
            keys: vec![landmark.object.key.clone()],
            name: None,
            factor: Arc::new(QuadricPrior { value: *landmark.quadric }),
            // literals that are positive
            noise: Noise::sigmas(&UNKNOWN).unwrap_or_default(),
            loss: None,
        });
    }
    let mut problem = Problem::compile(&graph, values)?;
    let weights = &estimate.solution.weights;
    if !weights.is_empty() {
        // what the solver has rejected says nothing; weak priors come last, and count
        let added = graph.factors().len().saturating_sub(weights.len());
        problem.set_weights(&[weights.as_slice(), &vec![1.0; added]].concat())?;
    }
    problem.linearize();
    let all = problem.marginals()?;
    let of_objects = all.into_iter().filter(|(key, _)| keys.contains(&key.as_str()));
    let entries = |m: DMatrix<f64>| std::array::from_fn(|r| std::array::from_fn(|c| m[(r, c)]));
    Ok(of_objects.map(|(key, covariance)| (key.to_string(), entries(covariance))).collect())
}
