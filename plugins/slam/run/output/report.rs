//! What a run has to tell, for scripts and for people.
use crate::output::map::gone;
use manifactor_graph::Direction;
use manifactor_mapping::estimate::variance::Components;
use manifactor_mapping::estimate::{Estimate, Landmark};
use manifactor_mapping::mapping::{MappedObject, Rejection, Warning};
use manifactor_mapping::settings::Settings;
use manifactor_quadric::{DualQuadric, LandmarkError};
use manifactor_recording::sequence::ObjectId;
use manifactor_solve::{Diagnosis, Outcome, Rejected, Termination, Times};
use serde::Serialize;

mod association;
mod consistency;
mod held_out;
mod landmarks;
mod online;
mod prior_map;
mod table;
mod trajectory;

pub use association::AssociationReport;
pub(crate) use association::Naming;
pub use consistency::ConsistencyReport;
pub use held_out::{HeldOutReport, Mean, Prediction};
pub use landmarks::LandmarkReport;
pub use online::OnlineReport;
pub use prior_map::{Found, PriorMapReport};
pub use table::Row;
pub use trajectory::name as alignment_name;
pub use trajectory::{TrajectoryError, TrajectoryReport};

/// A run, variant by variant.
#[derive(Debug, Clone, Serialize)]
pub struct RunReport {
    /// Of the program that made it.
    pub version: &'static str,
    /// What the run is called.
    pub title: String,
    /// Whether all variants were run, each to its end; not, where somebody interrupted it.
    pub complete: bool,
    /// In the order of the document.
    pub variants: Vec<VariantReport>,
    /// All of it, from reading to the last metric.
    pub seconds: f64,
}

/// One variant.
#[derive(Debug, Clone, Serialize)]
pub struct VariantReport {
    /// Its name.
    pub name: String,
    /// What it does, in a sentence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub about: Option<String>,
    /// Of its [settings](Settings::fingerprint), which `config.toml` has, and of the program's version.
    pub fingerprint: String,
    /// How much there is of what.
    pub counts: Counts,
    /// Up in the map's frame, where it is known.
    pub up: Option<Direction>,
    /// The noise as it was estimated, round by round.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub variance_components: Vec<Components>,
    /// How boxes were put to objects, where the source did not say, or was not asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub association: Option<AssociationReport>,
    /// How it went in a map that was made before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior_map: Option<PriorMapReport>,
    /// How the stream went, where frames came one by one: the solve is then what followed it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub online: Option<OnlineReport>,
    /// How the solve went.
    pub solve: SolveReport,
    /// The trajectory against the truth, where there is one: once for each alignment.
    pub trajectory: Vec<TrajectoryReport>,
    /// The objects against the truth, where there is one.
    pub landmarks: Option<LandmarkReport>,
    /// Whether both are off by as much as the estimate says, where there is a truth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub consistency: Option<ConsistencyReport>,
    /// How well boxes are predicted that the estimate did without.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out: Option<HeldOutReport>,
    /// Each object that was detected, by number.
    pub objects: Vec<ObjectReport>,
    /// Mapped objects that are not there any more at the end, by number: they should have been seen again, and were not. `map.json` is without them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gone: Vec<ObjectId>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
    /// Reading, mapping, solving and evaluating.
    pub seconds: f64,
}

/// How much there is of what.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Poses.
    pub frames: usize,
    /// Detections in them.
    pub detections: usize,
    /// Detections of no object.
    pub unassociated: usize,
    /// Detections without width or height.
    pub without_area: usize,
    /// Detections that score too low.
    pub low_score: usize,
    /// Boxes dropped because the border cuts them.
    pub cut: usize,
    /// Boxes replaced by a later one of the same object in the same frame.
    pub duplicates: usize,
    /// Objects that were detected.
    pub objects_detected: usize,
    /// Objects in the map.
    pub objects: usize,
    /// Boxes of these objects: factors.
    pub boxes: usize,
    /// Semantic factors.
    pub semantic_factors: usize,
}

/// How a solve went.
#[derive(Debug, Clone, Serialize)]
pub struct SolveReport {
    /// ½ Σ ρ where it began.
    pub initial_cost: f64,
    /// ½ Σ ρ where it ended.
    pub final_cost: f64,
    /// Linearizations followed by a step.
    pub iterations: usize,
    /// How it ended.
    pub termination: Termination,
    /// Factors.
    pub factors: usize,
    /// Factors that take no part at the end.
    pub inactive: usize,
    /// Their share of all, from 0 to 1.
    pub inactive_share: f64,
    /// Factors that the solver has found to be outliers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rejected: Vec<Rejected>,
    /// The factors that fit worst, and the condition of the linear system.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diagnosis: Option<Diagnosis>,
    /// Where the time of the solver went.
    pub times: Times,
    /// Time spent on objects alone.
    pub refinement_seconds: f64,
}

/// One object.
#[derive(Debug, Clone, Serialize)]
pub struct ObjectReport {
    /// What was detected of it, and what was done with it.
    #[serde(flatten)]
    pub object: MappedObject,
    /// The same in words: why it is not mapped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rejected_because: Option<String>,
    /// What it is estimated to be, in the map's frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate: Option<DualQuadric>,
    /// How far that is from the truth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<LandmarkError>,
}

impl VariantReport {
    /// Compares an estimate with the truth.
    pub fn new(name: &str, estimate: &Estimate, settings: &Settings, seconds: f64) -> Self {
        let mapping = &estimate.mapping;
        let mut warnings = mapping.warnings.clone();
        let solve = SolveReport::new(estimate, &mut warnings);
        let truth = estimate.sequence.ground_truth.as_ref();
        let poses = [estimate.odometry(), estimate.trajectory()];
        let trajectory = trajectory::compare(truth, &poses, &settings.evaluation, &mut warnings);
        let after = landmarks::in_truth_frame(estimate, estimate.landmarks());
        let before = landmarks::in_truth_frame(estimate, estimate.initial_landmarks());
        let objects = objects(estimate, &after);
        warnings.extend(super::shapes::run_away(estimate));
        let landmarks = LandmarkReport::new(&before, &after);
        Self {
            name: name.to_owned(),
            about: None,
            fingerprint: settings.fingerprint(),
            counts: Counts::of(estimate),
            up: mapping.frame.up,
            variance_components: estimate.components.clone(),
            association: None,
            prior_map: None,
            online: None,
            solve,
            trajectory,
            landmarks,
            consistency: ConsistencyReport::new(estimate, &settings.evaluation),
            held_out: None,
            objects,
            gone: gone(estimate, settings),
            warnings,
            seconds,
        }
    }
}

impl VariantReport {
    /// Tells how it went in the map that the run was to begin with.
    pub(crate) fn tell_prior_map(&mut self, estimate: &Estimate, settings: &Settings, found: Option<Found>) {
        self.prior_map = PriorMapReport::new(estimate, settings, found, &self.gone);
        if let Some(prior) = self.prior_map.as_ref().filter(|prior| !prior.is_located) {
            self.warnings.push(Warning::NotLocated { file: prior.file.clone() });
        }
    }
}

impl Counts {
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

/// How far each object is from the truth, where that is known.
pub(super) fn object_errors(estimate: &Estimate) -> Vec<(ObjectId, LandmarkError)> {
    let errors = landmarks::in_truth_frame(estimate, estimate.landmarks());
    errors.into_iter().map(|(landmark, error)| (landmark.object.id, error)).collect()
}

fn objects(estimate: &Estimate, errors: &[(Landmark<'_>, LandmarkError)]) -> Vec<ObjectReport> {
    let values = &estimate.solution.values;
    let report = |object: &MappedObject| ObjectReport {
        object: object.clone(),
        rejected_because: object.rejected.as_ref().map(Rejection::to_string),
        estimate: values.get::<DualQuadric>(&object.key).ok().copied(),
        error: errors.iter().find(|(landmark, _)| landmark.object.id == object.id).map(|(_, e)| *e),
    };
    estimate.mapping.objects.iter().map(report).collect()
}
