//! Cross-validation of a corrected trajectory with objects that were left out of it.
//!
//! The trajectory is estimated from some of the objects and fixed. Each remaining object is then fitted to
//! its boxes under it. A correct trajectory gives a better fit than the input odometry. A trajectory that
//! follows detector errors of some objects does not, because these errors differ between objects. This needs
//! neither ground truth nor the size of the box noise.
use super::MotionComponent;
use super::components::{MeasurementOf, VarianceError, measurement_of};
use crate::estimate::refine::{coarse_solver, object_graph};
use crate::mapping::Mapping;
use manifactor_geometry::Se3;
use manifactor_graph::checked::NotNegative;
use manifactor_graph::{FactorEntry, Graph, Key, Values};
use manifactor_quadric::DualQuadric;
use manifactor_solve::{CompileError, Optimizer, Problem, Silent, solve};
use rayon::prelude::*;
use serde::Serialize;

/// Number of folds. Each is left out once.
const FOLDS: usize = 5;
/// Smallest number of objects for a cross-validation.
const MIN_OBJECTS: usize = 4;
/// Significance threshold in standard errors. It is high because the best of about twenty candidates is
/// selected.
const SIGNIFICANCE_SIGMAS: f64 = 2.0;
/// A solve ends after this number of iterations, or at the relative decrease `MIN_RELATIVE_DECREASE` of the
/// cost: scores differ by whole nats.
const MAX_ITERATIONS: usize = 10;
const MIN_RELATIVE_DECREASE: f64 = 1e-4;
/// Cost of a box whose object is not visible from its pose, in nats.
const INVISIBLE_COST_NATS: f64 = 50.0;

/// Cross-validation score of an odometry noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CrossValidationScore {
    /// Cost of the boxes of left-out objects minus their cost under the input odometry, in nats.
    pub cost: f64,
    /// Standard error of the cost, from its spread over objects.
    pub deviation: f64,
}

impl CrossValidationScore {
    /// Returns whether the trajectory is significantly better than the odometry.
    pub(crate) fn is_better(&self) -> bool {
        self.cost < -SIGNIFICANCE_SIGMAS * self.deviation
    }
}

/// The folds of a map: for each, the graph without some of the objects.
pub(super) struct CrossValidation<'a> {
    values: &'a Values,
    folds: Vec<Fold>,
}

/// Some of the objects, and the graph of the rest.
struct Fold {
    graph: Graph,
    /// Indices of the motion factors.
    motions: Vec<usize>,
    start: Values,
    left_out: Vec<LeftOutObject>,
}

/// An object with its factors and the cost of its boxes under the input odometry.
struct LeftOutObject {
    key: Key,
    entries: Vec<FactorEntry>,
    before: f64,
}

impl<'a> CrossValidation<'a> {
    /// Returns whether there are enough objects, and odometry without a noise of its own.
    pub(super) fn is_possible(mapping: &Mapping) -> bool {
        mapping.mapped().count() >= MIN_OBJECTS && has_unknown_noise(mapping)
    }

    /// Creates the folds of a map with known box noise. `values` are close to the estimate. `None` if that is
    /// [not possible](Self::is_possible).
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
            let motions = motions.filter(|(_, entry)| matches!(measurement_of(entry), MeasurementOf::Motion));
            let motions = motions.map(|(place, _)| place).collect();
            let mut start = values.clone();
            for (key, _) in values.iter().filter(|(key, _)| is_left_out(key)) {
                start.remove(key.as_str());
            }
            let left_out = names.iter().map(|key| LeftOutObject::new(key, mapping, values)).collect();
            Fold { graph, motions, start, left_out }
        };
        Some(Self { values, folds: (0..FOLDS.min(keys.len())).into_par_iter().map(fold).collect() })
    }

    /// Returns the score of each candidate.
    ///
    /// # Errors
    /// If the graph of a fold cannot be compiled.
    pub(super) fn scores(
        &self,
        tried: &[MotionComponent],
    ) -> Result<Vec<CrossValidationScore>, VarianceError> {
        let tasks: Vec<(&MotionComponent, &Fold)> =
            tried.iter().flat_map(|motion| self.folds.iter().map(move |fold| (motion, fold))).collect();
        let gains = tasks.par_iter().map(|(motion, fold)| fold.gains(motion, self.values));
        let gains = gains.collect::<Result<Vec<_>, _>>()?;
        Ok(gains.chunks(self.folds.len()).map(|folds| score(&folds.concat())).collect())
    }
}

/// Returns whether there is odometry whose noise is to be estimated.
pub(super) fn has_unknown_noise(mapping: &Mapping) -> bool {
    mapping.graph.factors().iter().any(|entry| matches!(measurement_of(entry), MeasurementOf::Motion))
}

/// Returns the sum and its standard error.
fn score(costs: &[f64]) -> CrossValidationScore {
    let n = costs.len() as f64;
    let cost: f64 = costs.iter().sum();
    let squares: f64 = costs.iter().map(|one| (one - cost / n).powi(2)).sum();
    CrossValidationScore { cost, deviation: (squares / (n - 1.0) * n).sqrt() }
}

impl Fold {
    /// Returns the cost of the boxes of each object minus its cost under the input odometry.
    fn gains(&self, motion: &MotionComponent, shapes: &Values) -> Result<Vec<f64>, VarianceError> {
        let (mut graph, noise) = (self.graph.clone(), motion.noise()?);
        let factors = graph.factors_mut();
        for place in &self.motions {
            factors[*place].noise = noise.clone();
        }
        let poses = solve(
            &graph,
            &self.start,
            &coarse_solver(MAX_ITERATIONS, NotNegative::literal(MIN_RELATIVE_DECREASE)),
            &mut Silent,
        )?
        .values;
        let gains = self.left_out.iter().map(|object| Ok(object.cost(&poses, shapes)? - object.before));
        gains.collect()
    }
}

impl LeftOutObject {
    fn new(key: &Key, mapping: &Mapping, shapes: &Values) -> Self {
        let is_alone = |entry: &&FactorEntry| {
            let others = || entry.keys.iter().filter(|other| *other != key);
            entry.keys.contains(key) && others().all(|other| mapping.values.get::<Se3>(other).is_ok())
        };
        let entries = mapping.graph.factors().iter().filter(is_alone).cloned().collect();
        let mut object = Self { key: key.clone(), entries, before: 0.0 };
        // an invalid graph is reported when it is solved
        object.before = object.cost(&mapping.values, shapes).unwrap_or_default();
        object
    }

    /// Returns the cost of the boxes at the best fit. The fit starts from the shape in the map of all
    /// objects.
    fn cost(&self, poses: &Values, shapes: &Values) -> Result<f64, CompileError> {
        let Ok(shape) = shapes.get::<DualQuadric>(&self.key) else { return Ok(0.0) };
        let (graph, mut values) = object_graph(&[&self.key], self.entries.iter(), poses);
        values.insert(self.key.clone(), *shape);
        let mut problem = Problem::compile(&graph, &values)?;
        coarse_solver(MAX_ITERATIONS, NotNegative::literal(MIN_RELATIVE_DECREASE))
            .descend(&mut problem, &mut Silent);
        let states = problem.inspect();
        let boxes = states.iter().filter(|state| {
            let entry = self.entries.get(state.entry);
            entry.is_some_and(|entry| matches!(measurement_of(entry), MeasurementOf::Box { .. }))
        });
        let costs = boxes.map(|state| if state.defined { state.cost } else { INVISIBLE_COST_NATS });
        // a cost that is not finite counts as an invisible object
        Ok(costs.map(|cost| if cost.is_finite() { cost } else { INVISIBLE_COST_NATS }).sum())
    }
}
