//! Batch estimation: map and trajectory of a whole sequence.
mod completion;
mod extrinsics;
pub mod refine;
pub mod variance;
pub mod visibility;

use crate::estimate::refine::Refiner;
use crate::estimate::variance::{MotionChoice, VarianceComponents, VarianceError, VarianceSettings};
use crate::mapping::{MappedObject, Mapping, MappingError, pose_key};
use crate::settings::{DetectionSettings, RunSettings};
pub use completion::CompletionOutcome;
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::{Graph, Values};
use manifactor_quadric::DualQuadric;
use manifactor_recording::sequence::{Sequence, TrueObject};
use manifactor_solve::{
    CompileError, IterationRecord, Observer, Outcome, Problem, Solution, Termination, Times, solve,
};
use std::sync::Arc;
use std::time::Instant;

/// The estimated map and trajectory, with all inputs.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// The data.
    pub sequence: Arc<Sequence>,
    /// The graph and its initial values.
    pub mapping: Mapping,
    /// The solution of the last solve; its outcome covers all rounds.
    pub solution: Solution,
    /// Time for the refinement of single objects, in seconds.
    pub refinement_seconds: f64,
    /// The estimated noise of each round; empty if the noise is given.
    pub components: Vec<VarianceComponents>,
    /// Result of the second stage, if there was one.
    pub completion: Option<CompletionOutcome>,
    /// Selection of the boxes in the graph.
    pub detections: DetectionSettings,
}

/// Reason why there is no estimate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EstimateError {
    /// Graph and values do not match.
    #[error(transparent)]
    Compile(#[from] CompileError),
    /// The noise cannot be estimated.
    #[error(transparent)]
    Variance(#[from] VarianceError),
    /// The complete graph cannot be created.
    #[error(transparent)]
    Mapping(#[from] MappingError),
}

/// Returns the graph with the semi-axes of all objects with orientation factors fixed; `None` if no object
/// has such a factor.
fn with_fixed_shapes(mapping: &Mapping) -> Option<Graph> {
    let mut graph = mapping.graph.clone();
    let mut oriented = mapping.mapped().filter(|object| !object.semantic_factors.is_empty()).peekable();
    oriented.peek()?;
    for object in oriented {
        graph.fix_directions(object.key.clone(), &["log_a", "log_b", "log_c"]);
    }
    Some(graph)
}

/// Accumulates several solves, reported as one.
#[derive(Debug, Default)]
struct SolveRounds {
    iterations: usize,
    times: Times,
    history: Vec<IterationRecord>,
    refinement_seconds: f64,
    /// Number of joint solves so far; `cost` is the cost after the last one.
    joint: usize,
    cost: Option<f64>,
}

impl SolveRounds {
    fn refine(&mut self, refiner: &Refiner<'_>, values: &mut Values) {
        let clock = Instant::now();
        refiner.refine(values);
        self.refinement_seconds += clock.elapsed().as_secs_f64();
    }

    fn solve(
        &mut self,
        graph: &Graph,
        values: &Values,
        settings: &RunSettings,
        observer: &mut dyn Observer,
    ) -> Result<Solution, CompileError> {
        let solution = solve(graph, values, &*settings.solver, observer)?;
        let outcome = &solution.outcome;
        let later = |record: &IterationRecord| IterationRecord {
            iteration: record.iteration + self.iterations,
            seconds: record.seconds + self.times.total + self.refinement_seconds,
            ..record.clone()
        };
        self.history.extend(outcome.history.iter().map(later));
        self.iterations += outcome.iterations;
        self.times = self.times.plus(outcome.times);
        Ok(solution)
    }

    /// Called after a joint solve. Returns whether no further round is needed.
    fn record_joint_solve(&mut self, outcome: &Outcome) -> bool {
        self.joint += 1;
        let cost = outcome.final_cost;
        let before = self.cost.replace(cost).unwrap_or(f64::INFINITY);
        // a NaN ends the rounds too
        let falls = before - cost > MIN_RELATIVE_DECREASE * before || before == f64::INFINITY;
        outcome.termination == Termination::Interrupted || !(falls && cost.is_finite())
    }

    fn sum_into(self, outcome: &mut Outcome) {
        outcome.iterations = self.iterations;
        outcome.times = self.times;
        outcome.history = self.history;
    }
}

/// An object of the map with its estimate.
#[derive(Debug, Clone, Copy)]
pub struct LandmarkEstimate<'a> {
    /// The object and its measurements.
    pub object: &'a MappedObject,
    /// The estimated ellipsoid, in the map frame.
    pub quadric: &'a DualQuadric,
    /// The true object, if known, in the frame of the ground truth.
    pub truth: Option<&'a TrueObject>,
}

/// The rounds end when one lowers the cost by less than this share.
const MIN_RELATIVE_DECREASE: f64 = 1e-3;

impl Estimate {
    /// Solves the graph of a sequence. With [`variance`] components, alternates between estimating the noise
    /// and solving until the noise converges. The graph of the estimate has the noise of its last solve.
    ///
    /// # Errors
    /// If graph and values do not match, or the noise cannot be estimated.
    pub fn new(
        sequence: Arc<Sequence>,
        mapping: Mapping,
        settings: &RunSettings,
        observer: &mut dyn Observer,
    ) -> Result<Self, EstimateError> {
        let start = mapping.values.clone();
        Self::from_start(sequence, mapping, start, settings, observer)
    }

    /// Like [`new`](Self::new), with separate initial values.
    pub fn from_start(
        sequence: Arc<Sequence>,
        mut mapping: Mapping,
        start: Values,
        settings: &RunSettings,
        observer: &mut dyn Observer,
    ) -> Result<Self, EstimateError> {
        let (most, loss) = (settings.objects.refinements, settings.detections.loss.as_ref());
        let Some(variance) = &settings.variance_components else {
            return Self::solve(sequence, mapping, start, most, settings, observer)?
                .complete(settings, observer);
        };
        let begin = VarianceComponents::initial(&mapping, variance);
        begin.apply_to_graph(&mut mapping, variance, loss)?;
        let estimate = Self::solve(sequence, mapping, start, most, settings, observer)?;
        estimate.with_noise(variance, settings, observer)?.complete(settings, observer)
    }

    /// Alternates between estimating the noise and solving.
    fn with_noise(
        mut self,
        variance: &VarianceSettings,
        settings: &RunSettings,
        observer: &mut dyn Observer,
    ) -> Result<Self, EstimateError> {
        let (most, loss) = (settings.objects.refinements, settings.detections.loss.as_ref());
        let (mut rounds, mut settled) = (0, false);
        let interrupted = |of: &Self| of.solution.outcome.termination == Termination::Interrupted;
        while !(settled || interrupted(&self) || self.mapping.mapped().next().is_none()) {
            let found = VarianceComponents::estimate_from(&self, variance, loss, observer)?;
            rounds += 1;
            settled = rounds >= variance.rounds.get()
                || self
                    .components
                    .last()
                    .is_some_and(|before| found.largest_change(before) < *variance.tolerance);
            let Self { sequence, mut mapping, mut solution, mut components, .. } = self;
            let values = std::mem::take(&mut solution.values);
            // free the compiled problem before the next solve
            drop(solution);
            found.apply_to_graph(&mut mapping, variance, loss)?;
            components.push(found);
            // refine only before the last solve: an approximate solution suffices until then
            let refinements = if settled { most } else { 0 };
            let solved = Self::solve(sequence, mapping, values, refinements, settings, observer)?;
            self = Self { components, ..solved };
        }
        Ok(self)
    }

    /// Solves once, from `values`, with at most `most` refinements.
    ///
    /// Objects are [refined](Refiner) one by one before the joint solve. This may leave an object on the edge
    /// of a valley of its orientation factor, where no joint step is possible. Then the poses are solved with
    /// the shapes of such objects fixed, the objects are refined at the new poses, and the joint problem is
    /// solved again, as long as the cost decreases. Each of these steps lowers the cost or changes nothing.
    ///
    /// # Errors
    /// If graph and values do not match.
    fn solve(
        sequence: Arc<Sequence>,
        mapping: Mapping,
        mut values: Values,
        most: usize,
        settings: &RunSettings,
        observer: &mut dyn Observer,
    ) -> Result<Self, CompileError> {
        let (refiner, held) = (Refiner::new(&mapping), with_fixed_shapes(&mapping));
        let initial_cost = Problem::compile(&mapping.graph, &values)?.linearize().cost;
        let mut rounds = SolveRounds::default();
        loop {
            if most > 0 {
                rounds.refine(&refiner, &mut values);
            }
            let mut joint = rounds.solve(&mapping.graph, &values, settings, observer)?;
            let settled = rounds.record_joint_solve(&joint.outcome) || rounds.joint >= most;
            if let Some(held) = held.as_ref().filter(|_| !settled) {
                let from = std::mem::take(&mut joint.values);
                drop(joint);
                values = rounds.solve(held, &from, settings, observer)?.values;
                continue;
            }
            let refinement_seconds = rounds.refinement_seconds;
            rounds.sum_into(&mut joint.outcome);
            joint.outcome.initial_cost = initial_cost;
            let (components, completion, detections) = (vec![], None, settings.detections.clone());
            let solution = joint;
            return Ok(Self {
                sequence,
                mapping,
                solution,
                refinement_seconds,
                components,
                completion,
                detections,
            });
        }
    }

    /// Returns the estimated trajectory, in the map frame.
    pub fn trajectory(&self) -> Vec<StampedPose> {
        self.poses(&self.solution.values)
    }

    /// Returns whether the estimated noise keeps the poses of the odometry. Their covariance is then unknown,
    /// and that of an object is conditional on them.
    pub fn keeps_odometry(&self) -> bool {
        let choice = self.components.last().and_then(|found| found.odometry.as_ref());
        choice.is_some_and(MotionChoice::keeps_input)
    }

    /// Returns the trajectory of the odometry alone, in the map frame.
    pub fn odometry(&self) -> Vec<StampedPose> {
        self.poses(&self.mapping.values)
    }

    fn poses(&self, values: &Values) -> Vec<StampedPose> {
        let frames = self.sequence.frames.iter().enumerate();
        let stamped = frames.filter_map(|(i, frame)| {
            let pose = *values.get::<Se3>(pose_key(i)).ok()?;
            Some(StampedPose { timestamp: frame.timestamp, pose })
        });
        stamped.collect()
    }

    /// Returns the objects with their estimates.
    pub fn landmarks(&self) -> Vec<LandmarkEstimate<'_>> {
        self.landmarks_in(&self.solution.values)
    }

    /// Returns the objects with their initial values.
    pub fn initial_landmarks(&self) -> Vec<LandmarkEstimate<'_>> {
        self.landmarks_in(&self.mapping.values)
    }

    fn landmarks_in<'a>(&'a self, values: &'a Values) -> Vec<LandmarkEstimate<'a>> {
        let truths = self.sequence.ground_truth.as_ref().map_or(&[][..], |truth| &truth.objects);
        let landmark = |object: &'a MappedObject| {
            let truth = truths.iter().find(|truth| truth.id == object.id);
            Some(LandmarkEstimate { object, quadric: values.get(&object.key).ok()?, truth })
        };
        self.mapping.mapped().filter_map(landmark).collect()
    }
}
