//! The noise of each group of measurements.
use super::correlation::autocorrelation_time;
use super::cross_validation::CrossValidation;
use super::motion::{self, MotionChoice};
use super::{BoxGroups, VarianceSettings};
use crate::estimate::Estimate;
use crate::mapping::{MappedObject, Mapping, pose_key};
use indexmap::IndexMap;
use manifactor_geometry::Se3;
use manifactor_graph::batch::FactorState;
use manifactor_graph::checked::{NotPositive, Positive};
use manifactor_graph::loss::Loss;
use manifactor_graph::noise::NoiseError;
use manifactor_graph::{FactorEntry, Key, Noise};
use manifactor_quadric::DualQuadric;
use manifactor_solve::{CompileError, CovarianceError, Observer};
use serde::Serialize;
use std::any::TypeId;
use std::collections::HashMap;
use std::sync::Arc;

/// Standard deviations, as they are estimated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Components {
    /// Of odometry; `None` where it is as given.
    pub odometry: Option<MotionChoice>,
    /// Of boxes, by group.
    pub boxes: IndexMap<String, BoxComponent>,
}

/// The noise of a group of boxes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BoxComponent {
    /// Of each side of a box, in pixels.
    pub sigma_px: f64,
    /// How many consecutive boxes say as much as one alone.
    pub correlation_time: f64,
    /// What the graph is given: √(correlation_time) · sigma_px.
    pub effective_px: f64,
}

/// Why the noise could not be estimated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VarianceError {
    /// The estimate has no covariance.
    #[error("the variance components cannot be estimated: {0}")]
    Covariance(#[from] CovarianceError),
    /// A standard deviation that is zero or not finite.
    #[error("the variance components cannot be estimated: {0}")]
    Noise(#[from] NoiseError),
    /// A correlation time that is zero or not finite.
    #[error("the correlation time of the boxes: {0}")]
    CorrelationTime(#[from] NotPositive),
    /// A graph without some of the objects is none.
    #[error("the variance components cannot be estimated: {0}")]
    Compile(#[from] CompileError),
}

/// What a factor measures.
pub(super) enum Measures {
    Motion,
    Box { object: Key },
    Other,
}

/// Half of all normal deviates are below this.
const MEDIAN: f64 = 0.674_489_750_196_081_7;
/// Rows that are controlled less than this say nothing of their noise.
const LEAST_REDUNDANCY: f64 = 1e-9;
/// Fewer rows than this have no noise of their own.
const LEAST_ROWS: usize = 40;
/// Of boxes, in pixels, where the search begins.
const BEGIN_PX: f64 = 10.0;
/// As long as the noise of boxes changes by less than this share, that of odometry stays as it was chosen.
const SAME_BOXES: f64 = 0.2;

impl BoxComponent {
    fn of(sigma_px: f64, correlation_time: f64) -> Self {
        Self { sigma_px, correlation_time, effective_px: sigma_px * correlation_time.sqrt() }
    }
}

impl Components {
    /// What the search begins with, whatever a document says.
    pub(in crate::estimate) fn begin(mapping: &Mapping, settings: &VarianceSettings) -> Self {
        let component = BoxComponent::of(BEGIN_PX, 1.0);
        let boxes = mapping.mapped().filter(|_| settings.boxes != BoxGroups::Given);
        let boxes = boxes.map(|object| (group(object, settings.boxes), component)).collect();
        let is_chosen = settings.odometry && CrossValidation::is_possible(mapping);
        Self { odometry: is_chosen.then(MotionChoice::begin), boxes }
    }

    /// Out of an estimate: the noise of boxes from their residuals, that of odometry by what objects say of it that take no part.
    ///
    /// # Errors
    /// Where the estimate has no covariance.
    pub fn of(
        estimate: &Estimate,
        settings: &VarianceSettings,
        loss: Option<&Arc<dyn Loss>>,
        observer: &mut dyn Observer,
    ) -> Result<Self, VarianceError> {
        let graph = &estimate.mapping.graph;
        let leverages = estimate.solution.leverages(graph)?;
        let mut boxes: IndexMap<Key, Rows> = IndexMap::new();
        for (state, leverage) in estimate.solution.factors.iter().zip(&leverages) {
            let Some(entry) = graph.factors().get(state.entry).filter(|_| state.defined) else { continue };
            // factors are in the order of the graph: an object's boxes in the order of their frames
            if let Measures::Box { object } = measures(entry) {
                boxes.entry(object).or_default().add(state, leverage, entry.noise.observed());
            }
        }
        let mut found = Self { odometry: None, boxes: groups(&estimate.mapping, boxes, settings) };
        if !settings.odometry {
            return Ok(found);
        }
        let before = estimate.components.last();
        let chosen = before.and_then(|before| before.odometry);
        found.odometry = chosen;
        if before.is_none_or(|before| found.change(before) > SAME_BOXES) {
            let mut mapping = estimate.mapping.clone();
            found.apply(&mut mapping, settings, loss)?;
            if let Some(validation) = CrossValidation::new(&mapping, &estimate.solution.values) {
                let pivot = if settings.pivot { distance(estimate) } else { 0.0 };
                found.odometry = motion::choose(&validation, pivot, chosen, observer)?;
            }
        }
        Ok(found)
    }

    /// Gives the graph this noise, and boxes a loss whose scale is in units of their own σ: ρ(τs)/τ, so that an outlier
    /// is one among boxes, and not among averages of τ of them.
    ///
    /// # Errors
    /// A standard deviation that is zero or not finite.
    pub fn apply(
        &self,
        mapping: &mut Mapping,
        settings: &VarianceSettings,
        loss: Option<&Arc<dyn Loss>>,
    ) -> Result<(), VarianceError> {
        let mut groups = HashMap::new();
        for object in mapping.mapped() {
            if let Some(component) = self.boxes.get(&group(object, settings.boxes)) {
                let tau = Positive::new(component.correlation_time)?;
                groups.insert(object.key.clone(), (component, loss.map(|loss| loss.erased().tempered(tau))));
            }
        }
        for entry in mapping.graph.factors_mut() {
            let noise = match (measures(entry), self.odometry) {
                (Measures::Motion, Some(motion)) => motion.noise.noise()?,
                (Measures::Box { object }, _) => match groups.get(&object) {
                    Some((component, loss)) => {
                        entry.loss.clone_from(loss);
                        Noise::sigma(component.effective_px)?
                    }
                    None => continue,
                },
                _ => continue,
            };
            entry.noise = match entry.noise.observed() {
                Some(observed) => noise.observing(observed),
                None => noise,
            };
        }
        Ok(())
    }

    /// The largest change of any standard deviation of boxes, as a share of it.
    pub fn change(&self, before: &Self) -> f64 {
        let boxes = self.boxes.iter().filter_map(|(name, now)| {
            before.boxes.get(name).map(|before| (&now.effective_px, &before.effective_px))
        });
        boxes.map(|(now, before)| (now / before).ln().abs()).fold(0.0, f64::max)
    }
}

pub(super) fn measures(entry: &FactorEntry) -> Measures {
    let (pose, object) = (TypeId::of::<Se3>(), TypeId::of::<DualQuadric>());
    let variables = entry.factor.erased().signature().variables;
    match (&entry.keys[..], &variables[..]) {
        ([_, _], [a, b]) if *a == pose && *b == pose => Measures::Motion,
        ([_, seen], [a, b]) if *a == pose && *b == object => Measures::Box { object: seen.clone() },
        _ => Measures::Other,
    }
}

/// Errors of the boxes of an object, in pixels: by side, then in the order of the boxes.
#[derive(Default)]
struct Rows {
    errors: [Vec<f64>; 4],
}

impl Rows {
    fn add(&mut self, state: &FactorState, leverage: &[f64], observed: Option<&[bool]>) {
        for (side, errors) in self.errors.iter_mut().enumerate() {
            let seen = observed.is_none_or(|rows| rows.get(side).copied().unwrap_or(false));
            let redundancy = 1.0 - leverage.get(side).copied().unwrap_or(1.0);
            if let (true, Some(residual)) = (seen && redundancy > LEAST_REDUNDANCY, state.residual.get(side))
            {
                errors.push(residual / redundancy.sqrt());
            }
        }
    }
}

/// How far away what the camera sees is, in metres: the median over all boxes.
fn distance(estimate: &Estimate) -> f64 {
    let (values, measurements) = (&estimate.solution.values, &estimate.mapping.measurements);
    let of_object = |landmark: crate::estimate::Landmark<'_>| {
        let views = measurements.object(landmark.object.id).map_or(&[][..], |measured| &measured.views);
        let poses = views.iter().filter_map(|view| values.get::<Se3>(pose_key(view.frame)).ok());
        poses.map(|pose| (pose.translation - landmark.quadric.centroid()).norm()).collect::<Vec<_>>()
    };
    let mut distances: Vec<f64> = estimate.landmarks().into_iter().flat_map(of_object).collect();
    distances.sort_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied().unwrap_or_default()
}

/// The group of an object's boxes.
fn group(object: &MappedObject, by: BoxGroups) -> String {
    match by {
        BoxGroups::All | BoxGroups::Given => "all".to_owned(),
        BoxGroups::Class => {
            object.class.as_ref().map_or_else(|| "unknown".to_owned(), |class| class.name.clone())
        }
        BoxGroups::Object => object.key.to_string(),
    }
}

fn groups(
    mapping: &Mapping,
    mut boxes: IndexMap<Key, Rows>,
    settings: &VarianceSettings,
) -> IndexMap<String, BoxComponent> {
    if settings.boxes == BoxGroups::Given {
        return IndexMap::new();
    }
    let mut series: IndexMap<String, Vec<Vec<f64>>> = IndexMap::new();
    let mut all = vec![];
    for object in mapping.mapped() {
        let Some(rows) = boxes.swap_remove(&object.key) else { continue };
        all.extend(rows.errors.iter().cloned());
        series.entry(group(object, settings.boxes)).or_default().extend(rows.errors);
    }
    let rows = |series: &[Vec<f64>]| series.iter().map(Vec::len).sum::<usize>();
    let component = |own: &[Vec<f64>]| {
        // too few to tell: as all are
        box_component(if rows(own) < LEAST_ROWS { &all } else { own }, settings)
    };
    series.iter().filter_map(|(name, own)| Some((name.clone(), component(own)?))).collect()
}

fn box_component(series: &[Vec<f64>], settings: &VarianceSettings) -> Option<BoxComponent> {
    let mut sizes: Vec<f64> = series.iter().flatten().map(|error| error.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    // robust: half of the boxes may be wrong
    let sigma_px = sizes.get(sizes.len() / 2)? / MEDIAN;
    if !(sigma_px.is_finite() && sigma_px > 0.0) {
        return None;
    }
    let correlation_time = if settings.correlation {
        // gross errors are detections of something else, and not what lasts
        let within = |error: &&f64| error.abs() < 3.0 * sigma_px;
        let within: Vec<Vec<f64>> =
            series.iter().map(|errors| errors.iter().filter(within).copied().collect()).collect();
        autocorrelation_time(&within)
    } else {
        1.0
    };
    Some(BoxComponent::of(sigma_px, correlation_time))
}
