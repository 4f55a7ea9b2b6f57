//! A sequence mapped and solved.
pub mod looks;
pub mod refine;
pub mod variance;

use crate::estimate::refine::Refiner;
use crate::estimate::variance::{Components, VarianceError, VarianceSettings};
use crate::mapping::{MappedObject, Mapping, pose_key};
use crate::settings::Settings;
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

/// A map and a trajectory, with all that they were made of.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// The data.
    pub sequence: Arc<Sequence>,
    /// The graph, and where the solve began.
    pub mapping: Mapping,
    /// What the solver made of it: its outcome covers all rounds.
    pub solution: Solution,
    /// Time spent on objects alone.
    pub refinement_seconds: f64,
    /// The noise as it was estimated, round by round; empty, where it is as given.
    pub components: Vec<Components>,
}

/// Why there is no estimate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EstimateError {
    /// Graph and values do not fit each other.
    #[error(transparent)]
    Compile(#[from] CompileError),
    /// The noise cannot be estimated.
    #[error(transparent)]
    Variance(#[from] VarianceError),
}

/// The graph with the shapes of all objects held that have an orientation to keep; `None` where no object has.
fn with_shapes_held(mapping: &Mapping) -> Option<Graph> {
    let mut graph = mapping.graph.clone();
    let mut oriented = mapping.mapped().filter(|object| !object.semantic_factors.is_empty()).peekable();
    oriented.peek()?;
    for object in oriented {
        graph.fix_directions(object.key.clone(), &["log_a", "log_b", "log_c"]);
    }
    Some(graph)
}

/// Several solves, told as one.
#[derive(Debug, Default)]
struct Rounds {
    iterations: usize,
    times: Times,
    history: Vec<IterationRecord>,
    refinement_seconds: f64,
    /// Joint solves so far, and the cost after the last.
    joint: usize,
    cost: Option<f64>,
}

impl Rounds {
    fn refine(&mut self, refiner: &Refiner<'_>, values: &mut Values) {
        let clock = Instant::now();
        refiner.refine(values);
        self.refinement_seconds += clock.elapsed().as_secs_f64();
    }

    fn solve(
        &mut self,
        graph: &Graph,
        values: &Values,
        settings: &Settings,
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

    /// After a joint solve: whether another round would be in vain.
    fn settled(&mut self, outcome: &Outcome) -> bool {
        self.joint += 1;
        let cost = outcome.final_cost;
        let before = self.cost.replace(cost).unwrap_or(f64::INFINITY);
        // not a number settles as well
        let falls = before - cost > SETTLED * before || before == f64::INFINITY;
        outcome.termination == Termination::Interrupted || !(falls && cost.is_finite())
    }

    fn sum_into(self, outcome: &mut Outcome) {
        outcome.iterations = self.iterations;
        outcome.times = self.times;
        outcome.history = self.history;
    }
}

/// One object of the map.
#[derive(Debug, Clone, Copy)]
pub struct Landmark<'a> {
    /// What was detected of it.
    pub object: &'a MappedObject,
    /// What it is estimated to be, in the map's frame.
    pub quadric: &'a DualQuadric,
    /// What it is, where that is known; in the frame of the ground truth.
    pub truth: Option<&'a TrueObject>,
}

/// A round that lowers the cost by less than this share of it is the last.
const SETTLED: f64 = 1e-3;

impl Estimate {
    /// Solves a graph that was made of a sequence, as often as it takes to know its noise; see
    /// [`variance`]. The graph of the estimate has the noise of its last solve.
    ///
    /// # Errors
    /// If graph and values do not fit each other, or the noise cannot be estimated.
    pub fn new(
        sequence: Arc<Sequence>,
        mapping: Mapping,
        settings: &Settings,
        observer: &mut dyn Observer,
    ) -> Result<Self, EstimateError> {
        let start = mapping.values.clone();
        Self::from_start(sequence, mapping, start, settings, observer)
    }

    /// The same, from other values than those of the mapping.
    pub fn from_start(
        sequence: Arc<Sequence>,
        mut mapping: Mapping,
        start: Values,
        settings: &Settings,
        observer: &mut dyn Observer,
    ) -> Result<Self, EstimateError> {
        let (most, loss) = (settings.objects.refinements, settings.detections.loss.as_ref());
        let Some(variance) = &settings.variance_components else {
            return Ok(Self::solve(sequence, mapping, start, most, settings, observer)?);
        };
        let begin = Components::begin(&mapping, variance);
        begin.apply(&mut mapping, variance, loss)?;
        let estimate = Self::solve(sequence, mapping, start, most, settings, observer)?;
        estimate.with_noise(variance, settings, observer)
    }

    /// Estimates the noise and solves, by turns.
    fn with_noise(
        mut self,
        variance: &VarianceSettings,
        settings: &Settings,
        observer: &mut dyn Observer,
    ) -> Result<Self, EstimateError> {
        let (most, loss) = (settings.objects.refinements, settings.detections.loss.as_ref());
        let (mut rounds, mut settled) = (0, false);
        let interrupted = |of: &Self| of.solution.outcome.termination == Termination::Interrupted;
        while !(settled || interrupted(&self) || self.mapping.mapped().next().is_none()) {
            let found = Components::of(&self, variance, loss, observer)?;
            rounds += 1;
            settled = rounds >= variance.rounds.get()
                || self.components.last().is_some_and(|before| found.change(before) < *variance.tolerance);
            let Self { sequence, mut mapping, mut solution, mut components, .. } = self;
            let values = std::mem::take(&mut solution.values);
            // what was compiled for it gives its memory back before the next solve
            drop(solution);
            found.apply(&mut mapping, variance, loss)?;
            components.push(found);
            // near enough to go on from, until the last
            let refinements = if settled { most } else { 0 };
            let solved = Self::solve(sequence, mapping, values, refinements, settings, observer)?;
            self = Self { components, ..solved };
        }
        Ok(self)
    }

    /// Solves once, from `values`, with at most this number of refinements.
    ///
    /// Objects are [refined](Refiner) alone before the joint solve. That may leave one on the edge of a valley of its
    /// orientation factor, where no joint step is possible: so poses are solved with the shapes of such objects held,
    /// objects are refined again where the poses now are, and all is solved again, as often as the cost falls by it.
    /// Each of these steps lowers the cost or does nothing.
    ///
    /// # Errors
    /// If graph and values do not fit each other.
    fn solve(
        sequence: Arc<Sequence>,
        mapping: Mapping,
        mut values: Values,
        most: usize,
        settings: &Settings,
        observer: &mut dyn Observer,
    ) -> Result<Self, CompileError> {
        let (refiner, held) = (Refiner::new(&mapping), with_shapes_held(&mapping));
        let initial_cost = Problem::compile(&mapping.graph, &values)?.linearize().cost;
        let mut rounds = Rounds::default();
        loop {
            if most > 0 {
                rounds.refine(&refiner, &mut values);
            }
            let mut joint = rounds.solve(&mapping.graph, &values, settings, observer)?;
            let settled = rounds.settled(&joint.outcome) || rounds.joint >= most;
            if let Some(held) = held.as_ref().filter(|_| !settled) {
                let from = std::mem::take(&mut joint.values);
                drop(joint);
                values = rounds.solve(held, &from, settings, observer)?.values;
                continue;
            }
            let refinement_seconds = rounds.refinement_seconds;
            rounds.sum_into(&mut joint.outcome);
            joint.outcome.initial_cost = initial_cost;
            return Ok(Self { sequence, mapping, solution: joint, refinement_seconds, components: vec![] });
        }
    }

    /// The estimated trajectory, in the map's frame.
    pub fn trajectory(&self) -> Vec<StampedPose> {
        self.poses(&self.solution.values)
    }

    /// The trajectory by odometry alone, in the map's frame.
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

    /// The objects as they are estimated.
    pub fn landmarks(&self) -> Vec<Landmark<'_>> {
        self.landmarks_in(&self.solution.values)
    }

    /// The objects as they began.
    pub fn initial_landmarks(&self) -> Vec<Landmark<'_>> {
        self.landmarks_in(&self.mapping.values)
    }

    fn landmarks_in<'a>(&'a self, values: &'a Values) -> Vec<Landmark<'a>> {
        let truths = self.sequence.ground_truth.as_ref().map_or(&[][..], |truth| &truth.objects);
        let landmark = |object: &'a MappedObject| {
            let truth = truths.iter().find(|truth| truth.id == object.id);
            Some(Landmark { object, quadric: values.get(&object.key).ok()?, truth })
        };
        self.mapping.mapped().filter_map(landmark).collect()
    }
}
