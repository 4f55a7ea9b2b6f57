//! Whether a correction of the trajectory is one: objects that took no part in it say so.
//!
//! The trajectory is estimated by some of the objects, and held; the others are then fitted to their boxes under it. Where the
//! correction is right they fit better than under the odometry as it came in. Where it follows what detections of some objects get
//! wrong, the others do not: what a detector or an ellipsoid gets wrong is not the same for all. No ground truth takes part, and it
//! need not be known how wrong boxes are.
use super::MotionComponent;
use super::components::{Measures, VarianceError, measures};
use crate::estimate::refine::{alone, roughly};
use crate::mapping::Mapping;
use manifactor_geometry::Se3;
use manifactor_graph::checked::NotNegative;
use manifactor_graph::{FactorEntry, Graph, Key, Values};
use manifactor_quadric::DualQuadric;
use manifactor_solve::{CompileError, Optimizer, Problem, Silent, solve};
use rayon::prelude::*;
use serde::Serialize;

/// Parts that the objects are dealt into, of which each is left out once.
const FOLDS: usize = 5;
/// Fewer objects than this say nothing of one another.
const LEAST_OBJECTS: usize = 4;
/// The best of some twenty is better for more than so many standard errors, and not by chance.
const CLEAR: f64 = 2.0;
/// A solve ends after so many iterations, or with one that lowers the cost by less than this share: scores differ by nats.
const ITERATIONS: usize = 10;
const SETTLED: f64 = 1e-4;
/// What a box costs whose object a trajectory has put where it cannot be seen, in nats.
const LOST: f64 = 50.0;

/// What objects say of a noise of odometry that had no part in the trajectory which it leads to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Score {
    /// What their boxes cost, less what they cost under the odometry as it came in; in nats.
    pub cost: f64,
    /// The standard error of that, from how it differs by object.
    pub deviation: f64,
}

impl Score {
    /// Returns whether the trajectory is better than the odometry, by more than chance may have it.
    pub fn is_better(&self) -> bool {
        self.cost < -CLEAR * self.deviation
    }
}

/// The objects of a map, and the graphs without some of them.
pub(super) struct CrossValidation<'a> {
    values: &'a Values,
    folds: Vec<Fold>,
}

/// Some of the objects, and the graph of all the others.
struct Fold {
    graph: Graph,
    /// Where its motions are among its factors.
    motions: Vec<usize>,
    start: Values,
    left_out: Vec<LeftOut>,
}

/// An object with its factors, and what its boxes cost under the odometry as it came in.
struct LeftOut {
    key: Key,
    entries: Vec<FactorEntry>,
    before: f64,
}

impl<'a> CrossValidation<'a> {
    /// Returns whether there are objects enough.
    pub(super) fn is_possible(mapping: &Mapping) -> bool {
        mapping.mapped().count() >= LEAST_OBJECTS
    }

    /// Of a map whose boxes have their noise; `values` are near its estimate. `None` for a map of too few objects.
    pub(super) fn new(mapping: &Mapping, values: &'a Values) -> Option<Self> {
        if !Self::is_possible(mapping) {
            return None;
        }
        let keys: Vec<&Key> = mapping.mapped().map(|object| &object.key).collect();
        let fold = |fold: usize| {
            let names: Vec<&Key> = keys.iter().skip(fold).step_by(FOLDS).copied().collect();
            let mut graph = mapping.graph.clone();
            let is_left_out = |key: &Key| names.contains(&key);
            graph.factors_mut().retain(|entry| !entry.keys.iter().any(is_left_out));
            let motions = graph.factors().iter().enumerate();
            let motions = motions.filter(|(_, entry)| matches!(measures(entry), Measures::Motion));
            let motions = motions.map(|(place, _)| place).collect();
            let mut start = values.clone();
            for (key, _) in values.iter().filter(|(key, _)| is_left_out(key)) {
                start.remove(key.as_str());
            }
            let left_out = names.iter().map(|key| LeftOut::new(key, mapping, values)).collect();
            Fold { graph, motions, start, left_out }
        };
        Some(Self { values, folds: (0..FOLDS.min(keys.len())).into_par_iter().map(fold).collect() })
    }

    /// What is said of each of these.
    ///
    /// # Errors
    /// If a graph without some objects is none.
    pub(super) fn scores(&self, tried: &[MotionComponent]) -> Result<Vec<Score>, VarianceError> {
        let tasks: Vec<(&MotionComponent, &Fold)> =
            tried.iter().flat_map(|motion| self.folds.iter().map(move |fold| (motion, fold))).collect();
        let gains = tasks.par_iter().map(|(motion, fold)| fold.gains(motion, self.values));
        let gains = gains.collect::<Result<Vec<_>, _>>()?;
        Ok(gains.chunks(self.folds.len()).map(|folds| score(&folds.concat())).collect())
    }
}

/// The sum, with its standard error.
fn score(costs: &[f64]) -> Score {
    let n = costs.len() as f64;
    let cost: f64 = costs.iter().sum();
    let squares: f64 = costs.iter().map(|one| (one - cost / n).powi(2)).sum();
    Score { cost, deviation: (squares / (n - 1.0) * n).sqrt() }
}

impl Fold {
    /// What the boxes of each object cost more with this noise than with the odometry as it came in.
    fn gains(&self, motion: &MotionComponent, shapes: &Values) -> Result<Vec<f64>, VarianceError> {
        let (mut graph, noise) = (self.graph.clone(), motion.noise()?);
        let factors = graph.factors_mut();
        for place in &self.motions {
            factors[*place].noise = noise.clone();
        }
        let poses =
            solve(&graph, &self.start, &roughly(ITERATIONS, NotNegative::literal(SETTLED)), &mut Silent)?
                .values;
        let gains = self.left_out.iter().map(|object| Ok(object.cost(&poses, shapes)? - object.before));
        gains.collect()
    }
}

impl LeftOut {
    fn new(key: &Key, mapping: &Mapping, shapes: &Values) -> Self {
        let is_alone = |entry: &&FactorEntry| {
            let others = || entry.keys.iter().filter(|other| *other != key);
            entry.keys.contains(key) && others().all(|other| mapping.values.get::<Se3>(other).is_ok())
        };
        let entries = mapping.graph.factors().iter().filter(is_alone).cloned().collect();
        let mut object = Self { key: key.clone(), entries, before: 0.0 };
        // a graph that is none is told where it is solved
        object.before = object.cost(&mapping.values, shapes).unwrap_or_default();
        object
    }

    /// What its boxes cost where it fits best, from the shape that it has in the map of all objects.
    fn cost(&self, poses: &Values, shapes: &Values) -> Result<f64, CompileError> {
        let Ok(shape) = shapes.get::<DualQuadric>(&self.key) else { return Ok(0.0) };
        let (graph, values) = alone(&self.key, *shape, self.entries.iter(), poses);
        let mut problem = Problem::compile(&graph, &values)?;
        roughly(ITERATIONS, NotNegative::literal(SETTLED)).descend(&mut problem, &mut Silent);
        let states = problem.inspect();
        let boxes = states.iter().filter(|state| {
            let entry = self.entries.get(state.entry);
            entry.is_some_and(|entry| matches!(measures(entry), Measures::Box { .. }))
        });
        let costs = boxes.map(|state| if state.defined { state.cost } else { LOST });
        // not a number is no better than lost
        Ok(costs.map(|cost| if cost.is_finite() { cost } else { LOST }).sum())
    }
}
