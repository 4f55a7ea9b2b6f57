//! The noise of each group of measurements.
use super::boxes::{self, BoxComponent, BoxErrors, ObservedBox, box_of, group_name};
use super::cross_validation::CrossValidation;
use super::motion::{self, MotionChoice};
use super::{BoxGroups, VarianceSettings};
use crate::estimate::Estimate;
use crate::mapping::{Mapping, frame_of};
use indexmap::IndexMap;
use manifactor_geometry::Se3;
use manifactor_graph::checked::{OutOfDomain, Positive};
use manifactor_graph::loss::Loss;
use manifactor_graph::noise::NoiseError;
use manifactor_graph::{FactorEntry, Key, Noise};
use manifactor_solve::{CompileError, CovarianceError, Observer};
use serde::Serialize;
use std::any::TypeId;
use std::collections::HashMap;
use std::sync::Arc;

/// The estimated noise of odometry and boxes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VarianceComponents {
    /// Noise of odometry; `None` if it stays as given.
    pub odometry: Option<MotionChoice>,
    /// Noise of boxes, by group.
    pub boxes: IndexMap<String, BoxComponent>,
}

/// Reason why the noise could not be estimated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VarianceError {
    /// The estimate has no covariance.
    #[error("the variance components cannot be estimated: {0}")]
    Covariance(#[from] CovarianceError),
    /// A standard deviation is zero or not finite.
    #[error("the variance components cannot be estimated: {0}")]
    Noise(#[from] NoiseError),
    /// A correlation time is zero or not finite.
    #[error("the correlation time of the boxes: {0}")]
    CorrelationTime(#[from] OutOfDomain),
    /// The graph without some of the objects cannot be compiled.
    #[error("the variance components cannot be estimated: {0}")]
    Compile(#[from] CompileError),
}

/// Kind of measurement of a factor.
pub(super) enum MeasurementOf {
    Motion,
    Box { object: Key },
    Other,
}

/// Initial standard deviation of boxes, in pixels.
const INITIAL_SIGMA_PX: f64 = 10.0;
/// Relative change of the box noise above which the noise of odometry is chosen again.
const MAX_BOX_NOISE_CHANGE: f64 = 0.2;

impl VarianceComponents {
    /// Returns the noise before the first round. It does not depend on the run document.
    pub(in crate::estimate) fn initial(mapping: &Mapping, settings: &VarianceSettings) -> Self {
        let component = Self::initial_box_noise();
        let boxes = mapping.mapped().filter(|_| settings.boxes != BoxGroups::Given);
        let boxes = boxes.map(|object| (group_name(object, settings.boxes), component)).collect();
        let is_chosen = settings.odometry && CrossValidation::is_possible(mapping);
        Self { odometry: is_chosen.then(MotionChoice::initial), boxes }
    }

    /// Returns the noise of boxes before the first round.
    pub(super) fn initial_box_noise() -> BoxComponent {
        BoxComponent::of(INITIAL_SIGMA_PX, 0.0, 1.0, 0.0)
    }

    /// Estimates the noise: of boxes from their residuals, of odometry by cross-validation with left-out
    /// objects.
    ///
    /// # Errors
    /// If the estimate has no covariance.
    pub(crate) fn estimate_from(
        estimate: &Estimate,
        settings: &VarianceSettings,
        loss: Option<&Arc<dyn Loss>>,
        observer: &mut dyn Observer,
    ) -> Result<Self, VarianceError> {
        let graph = &estimate.mapping.graph;
        let leverages = estimate.solution.leverages(graph)?;
        let mut boxes: IndexMap<Key, BoxErrors> = IndexMap::new();
        for (state, leverage) in estimate.solution.factors.iter().zip(&leverages) {
            let Some(entry) = graph.factors().get(state.entry).filter(|_| state.defined) else { continue };
            // factors are in the order of the graph, so the boxes of an object are in the order of their
            // frames
            if let MeasurementOf::Box { object } = measurement_of(entry) {
                boxes.entry(object).or_default().add(&ObservedBox { entry, state, leverage });
            }
        }
        let mut found =
            Self { odometry: None, boxes: boxes::components(&estimate.mapping, &boxes, settings) };
        if !settings.odometry {
            return Ok(found);
        }
        let before = estimate.components.last();
        let chosen = before.and_then(|before| before.odometry);
        found.odometry = chosen;
        if before.is_none_or(|before| found.largest_change(before) > MAX_BOX_NOISE_CHANGE) {
            let mut mapping = estimate.mapping.clone();
            found.apply_to_graph(&mut mapping, settings, loss)?;
            if let Some(validation) = CrossValidation::new(&mapping, &estimate.solution.values) {
                let pivot = if settings.pivot { motion::median_distance(estimate) } else { 0.0 };
                found.odometry = motion::choose_noise(&validation, pivot, chosen, observer)?;
            }
        }
        Ok(found)
    }

    /// Sets this noise in the graph. The loss of boxes becomes ρ(τs)/τ, with its scale in units of the σ of a
    /// single box. So a box is an outlier by its own error, not by the error of an average of τ boxes.
    ///
    /// # Errors
    /// If a standard deviation is zero or not finite.
    pub(crate) fn apply_to_graph(
        &self,
        mapping: &mut Mapping,
        settings: &VarianceSettings,
        loss: Option<&Arc<dyn Loss>>,
    ) -> Result<(), VarianceError> {
        let mut groups = HashMap::new();
        for object in mapping.mapped() {
            if let Some(component) = self.boxes.get(&group_name(object, settings.boxes)) {
                let tau = Positive::new(component.correlation_time)?;
                groups.insert(object.key.clone(), (component, loss.map(|loss| loss.erased().tempered(tau))));
            }
        }
        for entry in mapping.graph.factors_mut() {
            let noise = match (measurement_of(entry), self.odometry) {
                (MeasurementOf::Motion, Some(motion)) => motion.noise.noise()?,
                (MeasurementOf::Box { object }, _) => match groups.get(&object) {
                    Some((component, loss)) => {
                        entry.loss.clone_from(loss);
                        component.noise(boxes::size(entry))?
                    }
                    None => continue,
                },
                _ => continue,
            };
            replace_noise(entry, noise);
        }
        Ok(())
    }

    /// Returns the largest relative change of a standard deviation of boxes.
    pub(crate) fn largest_change(&self, before: &Self) -> f64 {
        let boxes = self.boxes.iter().filter_map(|(name, now)| {
            before.boxes.get(name).map(|before| (&now.effective_px, &before.effective_px))
        });
        boxes.map(|(now, before)| (now / before).ln().abs()).fold(0.0, f64::max)
    }
}

/// Replaces the noise of a factor, which keeps its observed rows.
pub(super) fn replace_noise(entry: &mut FactorEntry, noise: Noise) {
    entry.noise = match entry.noise.observed() {
        Some(observed) => noise.observing(observed),
        None => noise,
    };
}

/// Returns the kind of measurement of a factor. Odometry is a factor without a name between the poses of
/// consecutive frames; a step with its own noise has a name.
pub(super) fn measurement_of(entry: &FactorEntry) -> MeasurementOf {
    let pose = TypeId::of::<Se3>();
    let are_poses = || entry.factor.erased().signature().variables.iter().all(|variable| *variable == pose);
    match &entry.keys[..] {
        [from, to] if entry.name.is_none() && are_consecutive(from, to) && are_poses() => {
            MeasurementOf::Motion
        }
        [_, object, ..] if box_of(entry).is_some() => MeasurementOf::Box { object: object.clone() },
        _ => MeasurementOf::Other,
    }
}

fn are_consecutive(from: &Key, to: &Key) -> bool {
    let frames = frame_of(from).zip(frame_of(to));
    frames.is_some_and(|(from, to)| from.checked_add(1) == Some(to))
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::Between;

    fn is_odometry(keys: [&str; 2]) -> bool {
        let entry = FactorEntry {
            keys: keys.map(Key::from).to_vec(),
            name: None,
            factor: Arc::new(Between { relative: Se3::identity() }),
            noise: Noise::default(),
            loss: None,
        };
        matches!(measurement_of(&entry), MeasurementOf::Motion)
    }

    #[test]
    fn odometry_is_between_poses_of_consecutive_frames_alone() {
        assert!(is_odometry(["x0", "x1"]) && is_odometry(["x9", "x10"]));
        assert!(!is_odometry(["x0", "x2"]) && !is_odometry(["x1", "x0"]), "a loop closure");
        assert!(!is_odometry(["table", "shelf"]) && !is_odometry(["x1", "shelf"]), "factors of the document");
        assert!(!is_odometry(["x", "x1"]) && !is_odometry(["x+0", "x1"]), "other names that begin with x");
    }
}
