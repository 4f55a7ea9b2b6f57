//! Fit of each object alone to its own factors, from several initial values, with the poses fixed.
//!
//! An orientation factor depends on the longest axis only, so its cost jumps if two axes swap their order.
//! There is one valley for each axis that might be the longest, and its minimum often lies on the edge. A
//! joint solve stays in the valley of its initial value. One object on an edge blocks all objects, because
//! each step across it raises the cost. A single object has only nine parameters, so all valleys can be
//! tried.
use crate::mapping::Mapping;
use indexmap::IndexMap;
use manifactor_geometry::{Se3, So3};
use manifactor_graph::checked::{NotNegative, Positive};
use manifactor_graph::{Direction, FactorEntry, Graph, Key, Values};
use manifactor_quadric::{DualQuadric, MIN_SEMI_AXIS};
use manifactor_solve::{DiagonalLimits, LevenbergMarquardt, Optimizer, Problem, Silent, Stopping};
use nalgebra::{Rotation3, Vector3};

/// Ratio of the longest axis of an initial value to its other axes.
const ELONGATION: f64 = 1.5;

/// The objects of a map, each with its factors.
#[derive(Debug)]
pub(crate) struct Refiner<'a> {
    objects: Vec<(Key, Vec<&'a FactorEntry>)>,
    up: Option<Direction>,
}

impl<'a> Refiner<'a> {
    /// Groups the factors of a map by object.
    pub(crate) fn new(mapping: &'a Mapping) -> Self {
        let mapped = mapping.mapped().map(|object| (object.key.clone(), vec![]));
        let mut objects: IndexMap<Key, Vec<&FactorEntry>> = mapped.collect();
        for entry in mapping.graph.factors() {
            // a factor between two objects belongs to both
            for key in &entry.keys {
                if let Some(entries) = objects.get_mut(key) {
                    entries.push(entry);
                }
            }
        }
        Self { objects: objects.into_iter().collect(), up: mapping.frame.up }
    }

    /// Moves each object to the best minimum that any of the initial values leads to.
    pub(crate) fn refine(&self, values: &mut Values) {
        for (key, entries) in &self.objects {
            if let Ok(start) = values.get::<DualQuadric>(key).copied() {
                let better = refine_object(key, start, entries, values, self.up);
                values.insert(key.clone(), better);
            }
        }
    }
}

/// Minimizes from several initial values, with other variables fixed at their values in `others`. Returns the
/// result with the fewest undefined factors, then the lowest cost. Returns `start` if no result is better.
pub fn refine_object(
    key: &Key,
    start: DualQuadric,
    entries: &[&FactorEntry],
    others: &Values,
    up: Option<Direction>,
) -> DualQuadric {
    let (graph, mut values) = object_graph(&[key], entries.iter().copied(), others);
    values.insert(key.clone(), start);
    // the joint solve reports a graph that cannot be compiled
    let Ok(mut problem) = Problem::compile(&graph, &values) else { return start };
    let mut best = (rank(&problem), start);
    for candidate in initial_values(&start, upright_axes(up)) {
        values.insert(key.clone(), candidate);
        if problem.set_values(&values).is_err() {
            continue;
        }
        solver().descend(&mut problem, &mut Silent);
        let found = problem.values().get::<DualQuadric>(key).copied();
        if let (Ok(found), rank) = (found, rank(&problem))
            && rank < best.0
        {
            best = (rank, found);
        }
    }
    best.1
}

/// Returns the graph of some objects with their factors and values. The further variables of these factors are
/// fixed.
pub(super) fn object_graph<'a>(
    objects: &[&Key],
    entries: impl Iterator<Item = &'a FactorEntry>,
    all: &Values,
) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for entry in entries {
        for key in &entry.keys {
            if let (false, Some(value)) = (values.contains(key.as_str()), all.variable(key.as_str())) {
                values.insert_boxed(key.clone(), value.erased().clone_box());
                if !objects.contains(&key) {
                    graph.fix(key.clone());
                }
            }
        }
        graph.push(entry.clone());
    }
    (graph, values)
}

/// Returns the initial values: the start itself, a ball, and an ellipsoid elongated along each of the given
/// axes.
fn initial_values(start: &DualQuadric, axes: So3) -> Vec<DualQuadric> {
    let s = start.semi_axes;
    // the middle semi-axis is the one least likely to be far off
    let radius = (s.sum() - s.min() - s.max()).max(MIN_SEMI_AXIS);
    let pose = Se3::new(axes, start.centroid());
    let along_axes = |semi_axes| DualQuadric { pose, semi_axes };
    let mut starts = vec![*start, along_axes(Vector3::repeat(radius))];
    for longest in 0..3 {
        let mut semi_axes = Vector3::repeat(radius);
        semi_axes[longest] *= ELONGATION;
        starts.push(along_axes(semi_axes));
    }
    starts
}

/// Returns axes with one of them vertical.
fn upright_axes(up: Option<Direction>) -> So3 {
    let rotation = Rotation3::rotation_between(&Vector3::z(), &up.unwrap_or_default());
    // for exactly upside down the rotation is not unique, and upright axes are as good
    rotation.map_or_else(So3::identity, |rotation| So3::from_matrix(rotation.matrix()))
}

/// Returns the number of undefined factors, then the cost. An undefined factor lowers the cost, but it is a
/// loss.
fn rank(problem: &Problem) -> (usize, f64) {
    let factors = problem.inspect();
    let cost: f64 = factors.iter().map(|factor| factor.cost).sum();
    let lost = factors.iter().filter(|factor| !factor.defined).count();
    (lost, if cost.is_finite() { cost } else { f64::INFINITY })
}

fn solver() -> LevenbergMarquardt {
    coarse_solver(30, NotNegative::literal(1e-5))
}

/// Returns a solver that stops when a step lowers the cost by less than this share.
pub(super) fn coarse_solver(max_iterations: usize, relative_cost: NotNegative) -> LevenbergMarquardt {
    let stop = Stopping { max_iterations, relative_cost: Some(relative_cost), ..Stopping::default() };
    // equal damping for all directions: damping in proportion to the Hessian would let a semi-axis vanish,
    // because the derivatives of a very short one are almost zero
    LevenbergMarquardt {
        diagonal: DiagonalLimits::EVEN,
        initial_lambda: Positive::literal(1e-3),
        stop,
        ..LevenbergMarquardt::default()
    }
}
