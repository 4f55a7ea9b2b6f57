//! Report of a run, for scripts and for people.
use crate::output::map::gone_objects;
use manifactor_geometry::Se3;
use manifactor_graph::Direction;
use manifactor_mapping::estimate::variance::{MotionChoice, VarianceComponents};
use manifactor_mapping::estimate::{CompletionOutcome, Estimate, LandmarkEstimate};
use manifactor_mapping::mapping::{MappedObject, Rejection, Warning};
use manifactor_mapping::settings::RunSettings;
use manifactor_quadric::{DualQuadric, LandmarkError};
use manifactor_recording::georeference::{ENU_FROM_MAP, Geodetic};
use manifactor_recording::sequence::ObjectId;
use manifactor_solve::{Diagnosis, Outcome, RejectedFactor, Termination, Times};
use serde::Serialize;

mod association;
mod consistency;
mod held_out;
mod landmarks;
mod online;
mod prior_map;
mod table;
mod trajectory;

pub(crate) use association::AssociationHistory;
pub use association::AssociationReport;
pub use consistency::ConsistencyReport;
pub use held_out::{ClusteredMean, HeldOutReport, Prediction};
pub use landmarks::LandmarkReport;
pub use online::OnlineReport;
pub use prior_map::{FoundStart, PriorMapReport};
pub use table::VariantRow;
pub use trajectory::alignment_name;
pub use trajectory::{TrajectoryError, TrajectoryReport};

/// Report of a run, variant by variant.
#[derive(Debug, Clone, Serialize)]
pub struct RunReport {
    /// Version of the program.
    pub version: &'static str,
    /// Title of the run.
    pub title: String,
    /// True if all variants were run to their end; false if the user interrupted the run.
    pub complete: bool,
    /// Variants in the order of the document.
    pub variants: Vec<VariantReport>,
    /// Duration from reading to the last metric. Unit: seconds.
    pub seconds: f64,
}

/// Report of one variant.
#[derive(Debug, Clone, Serialize)]
pub struct VariantReport {
    /// Name of the variant.
    pub name: String,
    /// Description in one sentence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub about: Option<String>,
    /// Fingerprint of the [settings](RunSettings::fingerprint) in `config.toml` and of the program's version.
    pub fingerprint: String,
    /// Numbers of frames, boxes, objects and factors.
    pub counts: RunCounts,
    /// Up direction in the map frame, if known.
    pub up: Option<Direction>,
    /// Place of the map on the Earth, if the source knows it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub georeference: Option<GeoreferenceReport>,
    /// Estimated noise of each round.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub variance_components: Vec<VarianceComponents>,
    /// Result of data association, unless the objects of the source were used.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub association: Option<AssociationReport>,
    /// Result with the prior map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior_map: Option<PriorMapReport>,
    /// Result of the stream, if frames arrived one by one. `solve` then describes the solve after it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub online: Option<OnlineReport>,
    /// Result of the second stage, if there was one. `solve` then describes the first stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub completion: Option<CompletionOutcome>,
    /// Result of the solve.
    pub solve: SolveReport,
    /// Errors of the trajectory, if there is ground truth: one entry per alignment.
    pub trajectory: Vec<TrajectoryReport>,
    /// Errors of the objects, if there is ground truth.
    pub landmarks: Option<LandmarkReport>,
    /// Consistency of these errors with the estimated covariances, if there is ground truth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub consistency: Option<ConsistencyReport>,
    /// Prediction of held-out boxes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out: Option<HeldOutReport>,
    /// All detected objects, sorted by number.
    pub objects: Vec<ObjectReport>,
    /// Numbers of mapped objects that are gone at the end: they should have been detected again, but were
    /// not. `map.json` does not contain them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gone: Vec<ObjectId>,
    /// Warnings for the user.
    pub warnings: Vec<Warning>,
    /// Duration of reading, mapping, solving and evaluating. Unit: seconds.
    pub seconds: f64,
}

/// Place of the map on the Earth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GeoreferenceReport {
    /// Origin of the frame with the axes east, north and up.
    pub origin: Geodetic,
    /// Pose of the map in this frame.
    pub enu_from_map: Se3,
}

impl GeoreferenceReport {
    fn new(estimate: &Estimate) -> Option<Self> {
        let origin = estimate.sequence.georeference?.origin;
        Some(Self { origin, enu_from_map: *estimate.solution.values.get(ENU_FROM_MAP).ok()? })
    }
}

/// Numbers of frames, boxes, objects and factors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct RunCounts {
    /// Poses.
    pub frames: usize,
    /// Detections in these frames.
    pub detections: usize,
    /// Detections without an object.
    pub unassociated: usize,
    /// Detections without width or height.
    pub without_area: usize,
    /// Detections with too low a score.
    pub low_score: usize,
    /// Boxes dropped because the border cuts them.
    pub cut: usize,
    /// Boxes replaced by a later one of the same object in the same frame.
    pub duplicates: usize,
    /// Boxes removed by the second stage because the ellipsoid of their object does not touch them.
    pub untouched: usize,
    /// Detected objects.
    pub objects_detected: usize,
    /// Objects in the map.
    pub objects: usize,
    /// Boxes of these objects, each a factor.
    pub boxes: usize,
    /// Semantic factors.
    pub semantic_factors: usize,
}

/// Result of a solve.
#[derive(Debug, Clone, Serialize)]
pub struct SolveReport {
    /// Initial cost ½ Σ ρ.
    pub initial_cost: f64,
    /// Final cost ½ Σ ρ.
    pub final_cost: f64,
    /// Number of linearizations followed by a step.
    pub iterations: usize,
    /// Reason of the termination.
    pub termination: Termination,
    /// Number of factors.
    pub factors: usize,
    /// Number of factors that are inactive at the end.
    pub inactive: usize,
    /// Share of inactive factors, from 0 to 1.
    pub inactive_share: f64,
    /// Factors that the solver rejected as outliers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rejected: Vec<RejectedFactor>,
    /// Worst-fitting factors, and the condition of the linear system.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diagnosis: Option<Diagnosis>,
    /// Solver times by stage.
    pub times: Times,
    /// Time for the refinement of single objects. Unit: seconds.
    pub refinement_seconds: f64,
}

/// Report of one object.
#[derive(Debug, Clone, Serialize)]
pub struct ObjectReport {
    /// Detections of the object, and its state in the map.
    #[serde(flatten)]
    pub object: MappedObject,
    /// Reason why the object is not mapped, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rejected_because: Option<String>,
    /// Estimate in the map frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate: Option<DualQuadric>,
    /// True if the shortest semi-axis is below 1/50 of the longest.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub flat: bool,
    /// Error of the estimate, if the truth is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<LandmarkError>,
}

impl VariantReport {
    /// Compares an estimate with ground truth.
    pub fn new(name: &str, estimate: &Estimate, settings: &RunSettings, seconds: f64) -> Self {
        let mapping = &estimate.mapping;
        let mut warnings = mapping.warnings.clone();
        let solve = SolveReport::new(estimate, &mut warnings);
        let truth = estimate.sequence.ground_truth.as_ref();
        let poses = [estimate.odometry(), estimate.trajectory()];
        let trajectory = trajectory::compare(truth, &poses, &settings.evaluation, &mut warnings);
        let within = *settings.evaluation.max_time_difference;
        let errors = |landmarks, poses: &[_]| landmarks::in_truth_frame(estimate, landmarks, poses, within);
        let [odometry, trajectory_poses] = &poses;
        let before = errors(estimate.initial_landmarks(), odometry);
        let after = errors(estimate.landmarks(), trajectory_poses);
        let objects = objects(estimate, &after);
        warnings.extend(super::shapes::shape_warnings(estimate));
        let noise = estimate.components.last().and_then(|found| found.odometry);
        warnings.extend(noise.filter(MotionChoice::is_at_limit).map(|found| Warning::NoiseAtLimit {
            rotation: found.noise.rotation,
            translation: found.noise.translation,
        }));
        let landmarks = LandmarkReport::new(&before, &after);
        Self {
            name: name.to_owned(),
            about: None,
            fingerprint: settings.fingerprint(),
            counts: RunCounts::of(estimate),
            up: mapping.frame.up,
            georeference: GeoreferenceReport::new(estimate),
            variance_components: estimate.components.clone(),
            association: None,
            prior_map: None,
            online: None,
            completion: estimate.completion,
            solve,
            trajectory,
            landmarks,
            consistency: ConsistencyReport::new(estimate, &settings.evaluation),
            held_out: None,
            objects,
            gone: gone_objects(estimate, settings),
            warnings,
            seconds,
        }
    }
}

impl VariantReport {
    /// Adds the report about the prior map, and a warning if the run was not located in it.
    pub(crate) fn set_prior_map_report(
        &mut self,
        estimate: &Estimate,
        settings: &RunSettings,
        found: Option<FoundStart>,
    ) {
        self.prior_map = PriorMapReport::new(estimate, settings, found, &self.gone);
        if let Some(prior) = self.prior_map.as_ref().filter(|prior| !prior.is_located) {
            self.warnings.push(Warning::NotLocated { file: prior.file.clone() });
        }
    }
}

impl RunCounts {
    fn of(estimate: &Estimate) -> Self {
        let Estimate { sequence, mapping, .. } = estimate;
        let m = &mapping.measurements;
        Self {
            frames: sequence.frames.len(),
            detections: sequence.detections.len(),
            unassociated: m.unassociated,
            without_area: m.without_area,
            low_score: m.low_score,
            cut: m.cut,
            duplicates: m.duplicates,
            untouched: m.untouched,
            objects_detected: mapping.objects.len(),
            objects: mapping.mapped().count(),
            boxes: mapping.mapped().map(|object| object.boxes).sum(),
            semantic_factors: mapping.mapped().map(|object| object.semantic_factors.len()).sum(),
        }
    }
}

impl SolveReport {
    fn new(estimate: &Estimate, warnings: &mut Vec<Warning>) -> Self {
        let outcome = &estimate.solution.outcome;
        let Outcome { inactive, factors, .. } = *outcome;
        if !outcome.termination.is_converged() {
            let moving = outcome.moving.as_ref().map_or_else(String::new, |moving| format!("; {moving}"));
            warnings.push(Warning::NotConverged { termination: format!("{}{moving}", outcome.termination) });
        }
        if inactive > 0 {
            warnings.push(Warning::Inactive { inactive, factors });
        }
        if let Some(undetermined) = &outcome.undetermined {
            warnings.push(Warning::Undetermined { what: undetermined.to_string() });
        }
        Self {
            initial_cost: outcome.initial_cost,
            final_cost: outcome.final_cost,
            iterations: outcome.iterations,
            termination: outcome.termination.clone(),
            factors,
            inactive,
            inactive_share: inactive as f64 / factors.max(1) as f64,
            rejected: outcome.rejected.clone(),
            // a graph that was solved can be compiled
            diagnosis: estimate.solution.diagnose(&estimate.mapping.graph).ok(),
            times: outcome.times,
            refinement_seconds: estimate.refinement_seconds,
        }
    }
}

/// Returns the errors of objects whose true shape is known.
pub(super) fn object_errors(estimate: &Estimate, within: f64) -> Vec<(ObjectId, LandmarkError)> {
    let errors = landmarks::in_truth_frame(estimate, estimate.landmarks(), &estimate.trajectory(), within);
    errors.into_iter().map(|(landmark, error)| (landmark.object.id, error)).collect()
}

fn objects(estimate: &Estimate, errors: &[(LandmarkEstimate<'_>, LandmarkError)]) -> Vec<ObjectReport> {
    let values = &estimate.solution.values;
    let report = |object: &MappedObject| ObjectReport {
        object: object.clone(),
        rejected_because: object.rejected.as_ref().map(Rejection::to_string),
        estimate: values.get::<DualQuadric>(&object.key).ok().copied(),
        flat: values.get::<DualQuadric>(&object.key).is_ok_and(DualQuadric::is_flat),
        error: errors.iter().find(|(landmark, _)| landmark.object.id == object.id).map(|(_, e)| *e),
    };
    estimate.mapping.objects.iter().map(report).collect()
}
