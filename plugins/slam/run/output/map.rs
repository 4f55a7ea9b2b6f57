//! The map that a run writes for later runs.
use manifactor_graph::{FactorEntry, Graph, Key, Noise};
use manifactor_mapping::estimate::visibility::{DetectionOpportunities, count_opportunities};
use manifactor_mapping::estimate::{Estimate, LandmarkEstimate};
use manifactor_mapping::mapping::measurements::ObjectMeasurements;
use manifactor_mapping::mapping::object_key;
use manifactor_mapping::settings::RunSettings;
use manifactor_quadric::QuadricPrior;
use manifactor_recording::prior_map::{DetectionCounts, PriorMap, PriorObject};
use manifactor_recording::sequence::ObjectId;
use manifactor_solve::{CompileError, CovarianceError, Problem, WeightError};
use nalgebra::DMatrix;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Error while creating a map.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// The graph does not match the estimate.
    #[error(transparent)]
    Compile(#[from] CompileError),
    /// The solver's weights do not match the graph.
    #[error(transparent)]
    Weights(#[from] WeightError),
    /// The covariances of the objects cannot be computed.
    #[error(transparent)]
    Covariance(#[from] CovarianceError),
}

/// Smallest weight of a factor after its robust loss.
const MIN_WEIGHT: f64 = 1e-9;
/// Standard deviations of an unobserved object: rotation (rad), centre (m), log semi-axes.
const UNOBSERVED_SIGMAS: [f64; 9] = [1.0, 1.0, 1.0, 10.0, 10.0, 10.0, 1.0, 1.0, 1.0];

/// Returns the map of an estimate, without objects that are gone. Objects of the prior map without new
/// views are kept as they were read, so that a map does not fade from run to run.
///
/// # Errors
/// If the covariances cannot be computed.
pub fn map_of(estimate: &Estimate, settings: &RunSettings) -> Result<PriorMap, MapError> {
    let new = count_opportunities(estimate, *settings.detections.border_px);
    let mut covariances = covariances(estimate)?;
    let object = |landmark: LandmarkEstimate<'_>| {
        let LandmarkEstimate { object, quadric, .. } = landmark;
        let measured = estimate.mapping.measurements.object(object.id)?;
        let opportunities = new.get(&object.id).copied().unwrap_or_default();
        if is_gone(measured, opportunities, settings) {
            return None;
        }
        let detection_counts = measured
            .prior
            .as_ref()
            .map(|prior| prior.detection_counts)
            .unwrap_or_default()
            .plus(opportunities.all);
        if let Some(prior) = measured.prior.as_ref().filter(|_| measured.views.is_empty()) {
            let classes = measured.classes().clone();
            // maps of earlier programs have no such flag
            let flat = prior.quadric.is_flat();
            let kept = PriorObject { classes, detection_counts, flat, ..PriorObject::clone(prior) };
            return Some(Arc::new(kept));
        }
        Some(Arc::new(PriorObject {
            id: object.id,
            classes: measured.classes().clone(),
            quadric: *quadric,
            covariance: covariances.remove(object.key.as_str())?,
            detection_counts,
            least_px: measured.least_px(),
            flat: quadric.is_flat(),
        }))
    };
    let objects = estimate.landmarks().into_iter().filter_map(object).collect();
    Ok(PriorMap::new(estimate.mapping.frame.up, objects))
}

/// An object counts as gone if the probability of missing it at all opportunities since its last detection is
/// smaller than this.
const MAX_MISS_PROBABILITY: f64 = 0.001;
/// Smallest number of opportunities since its last detection at which an object can count as gone.
const MIN_OPPORTUNITIES: usize = 8;

/// Returns the numbers of mapped objects that are gone.
pub(super) fn gone_objects(estimate: &Estimate, settings: &RunSettings) -> Vec<ObjectId> {
    let all = count_opportunities(estimate, *settings.detections.border_px);
    let is_gone = |(id, opportunities): (ObjectId, DetectionOpportunities)| {
        let measured = estimate.mapping.measurements.object(id)?;
        is_gone(measured, opportunities, settings).then_some(id)
    };
    all.into_iter().filter_map(is_gone).collect()
}

/// Returns whether an object is gone: since its last detection in this run it should have been detected again,
/// but was not. Or it was moved before this run, and its few detections, if any, show other objects.
fn is_gone(
    measured: &ObjectMeasurements,
    opportunities: DetectionOpportunities,
    settings: &RunSettings,
) -> bool {
    let prior = measured.prior.as_ref().map(|prior| prior.detection_counts).unwrap_or_default();
    let missed = (1.0 - prior.plus(opportunities.before).detection_rate()).powf(opportunities.since as f64);
    let DetectionCounts { expected, seen } = opportunities.all;
    let is_absent = prior.expected > 0
        && expected - seen >= MIN_OPPORTUNITIES
        && log_odds_of_absence(prior, opportunities.all) > -MAX_MISS_PROBABILITY.ln();
    // held-out boxes do not count as missed
    settings.evaluation.holdout.is_none()
        && (is_absent || opportunities.since >= MIN_OPPORTUNITIES && missed < MAX_MISS_PROBABILITY)
}

/// Probability that an object that is not there gets a detection of another object at one opportunity. On
/// simulated tables, missing objects got detections at up to 1 of 40 opportunities.
const WRONG_DETECTION_RATE: f64 = 0.05;

/// Returns the log-likelihood ratio that an object of the prior map was absent in the whole run, against
/// present, in nats.
fn log_odds_of_absence(prior: DetectionCounts, now: DetectionCounts) -> f64 {
    let missed = now.expected - now.seen;
    let absent =
        now.seen as f64 * WRONG_DETECTION_RATE.ln() + missed as f64 * (1.0 - WRONG_DETECTION_RATE).ln();
    absent - prior.log_likelihood(now)
}

/// Gives the factors of the prior map the covariances that were read, without the settings' `sigma_scale` and
/// `shape_error`. The written covariances are then again those of white noise. Each factor keeps the weight
/// that its robust loss had in the solve.
fn restore_written_covariances(graph: &mut Graph, estimate: &Estimate) {
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
        let weight = weights.get(&place).copied().unwrap_or(1.0).max(MIN_WEIGHT);
        let noise = Noise::covariance(DMatrix::from_fn(9, 9, |r, c| prior.covariance[r][c] / weight));
        // a map that was read has a valid covariance
        entry.noise = noise.unwrap_or_default();
        entry.loss = None;
    }
}

/// Returns the covariance of each object by key. Directions that are known worse than `UNOBSERVED_SIGMAS` get those
/// standard deviations; the rest is the marginal covariance.
fn covariances(estimate: &Estimate) -> Result<HashMap<String, [[f64; 9]; 9]>, MapError> {
    let (mut graph, values) = (estimate.mapping.graph.clone(), &estimate.solution.values);
    let keys: HashSet<&str> = estimate.mapping.mapped().map(|object| object.key.as_str()).collect();
    if keys.is_empty() {
        return Ok(HashMap::new());
    }
    restore_written_covariances(&mut graph, estimate);
    for landmark in estimate.landmarks() {
        graph.push(FactorEntry {
            keys: vec![landmark.object.key.clone()],
            name: None,
            factor: Arc::new(QuadricPrior { value: *landmark.quadric }),
            // the literals are positive
            noise: Noise::sigmas(&UNOBSERVED_SIGMAS).unwrap_or_default(),
            loss: None,
        });
    }
    let mut problem = Problem::compile(&graph, values)?;
    let weights = &estimate.solution.weights;
    if !weights.is_empty() {
        // factors that the solver has rejected do not count; the weak priors come last and count fully
        let added = graph.factors().len().saturating_sub(weights.len());
        problem.set_weights(&[weights.as_slice(), &vec![1.0; added]].concat())?;
    }
    problem.linearize();
    let all = problem.marginals()?;
    let of_objects = all.into_iter().filter(|(key, _)| keys.contains(&key.as_str()));
    let entries = |m: DMatrix<f64>| std::array::from_fn(|r| std::array::from_fn(|c| m[(r, c)]));
    Ok(of_objects
        .map(|(key, covariance)| (key.to_string(), entries(without_weak_prior(&covariance))))
        .collect())
}

/// Removes the weak prior from the covariance of an object, and limits it to `UNOBSERVED_SIGMAS`. In their units, a
/// variance v with the prior is v / (1 - v) without it.
fn without_weak_prior(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let scale = |r: usize, c: usize| UNOBSERVED_SIGMAS[r] * UNOBSERVED_SIGMAS[c];
    let scaled = DMatrix::from_fn(9, 9, |r, c| covariance[(r, c)] / scale(r, c));
    let mut eigen = scaled.symmetric_eigen();
    eigen.eigenvalues.apply(|v| *v = if *v < 0.5 { *v / (1.0 - *v) } else { 1.0 });
    let limited = eigen.recompose();
    DMatrix::from_fn(9, 9, |r, c| 0.5 * (limited[(r, c)] + limited[(c, r)]) * scale(r, c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_determined_keeps_its_covariance() {
        // information 4 about one axis, none about another
        let mut covariance = DMatrix::from_diagonal_element(9, 9, 1e-4);
        (covariance[(0, 0)], covariance[(1, 1)]) = (1.0 / (4.0 + 1.0), 1.0);
        let written = without_weak_prior(&covariance);
        assert!((written[(0, 0)] - 0.25).abs() < 1e-12 && (written[(1, 1)] - 1.0).abs() < 1e-12, "{written}");
        assert!((written[(8, 8)] / 1e-4 - 1.0).abs() < 2e-4 && (written[(3, 3)] / 1e-4 - 1.0).abs() < 1e-5);
    }

    #[test]
    fn few_detections_of_a_reliable_object_are_those_of_other_objects() {
        let counts = |seen: usize, expected: usize| DetectionCounts { expected, seen };
        let is_absent = |prior: DetectionCounts, now: DetectionCounts| {
            log_odds_of_absence(prior, now) > -MAX_MISS_PROBABILITY.ln()
        };
        let (reliable, rare) = (counts(45, 45), counts(9, 35));
        assert!([counts(0, 20), counts(1, 40), counts(2, 40)].iter().all(|now| is_absent(reliable, *now)));
        // detected from one side only, too few opportunities, or a low rate in the map as well
        assert!([counts(12, 40), counts(2, 8)].iter().all(|now| !is_absent(reliable, *now)));
        assert!(!is_absent(rare, counts(1, 26)));
    }
}
