//! Each object fitted alone to its own factors, from several places, with the poses held.
//!
//! An orientation factor looks at the longest axis only. Where two axes are equally long its cost jumps: there is a
//! valley for each axis that might be the longest, and the floor of a valley often lies on its edge. A joint solve
//! stays in the valley where it begins, and one object on an edge stops all others, since each step that crosses the
//! edge raises the cost. One object alone is nine numbers: all its valleys can be tried.
use crate::mapping::Mapping;
use indexmap::IndexMap;
use manifactor_geometry::{Se3, So3};
use manifactor_graph::checked::{NotNegative, Positive};
use manifactor_graph::{Direction, FactorEntry, Graph, Key, Values};
use manifactor_quadric::{DualQuadric, SHORTEST};
use manifactor_solve::{DiagonalLimits, LevenbergMarquardt, Optimizer, Problem, Silent, Stopping};
use nalgebra::{Rotation3, Vector3};

/// How much longer than the others the longest axis of a start is.
const ELONGATION: f64 = 1.5;

/// The objects of a map, each with its factors.
#[derive(Debug)]
pub(crate) struct Refiner<'a> {
    objects: Vec<(Key, Vec<&'a FactorEntry>)>,
    up: Option<Direction>,
}

impl<'a> Refiner<'a> {
    /// Sorts the factors of a map by object.
    pub(crate) fn new(mapping: &'a Mapping) -> Self {
        let mapped = mapping.mapped().map(|object| (object.key.clone(), vec![]));
        let mut objects: IndexMap<Key, Vec<&FactorEntry>> = mapped.collect();
        for entry in mapping.graph.factors() {
            // one between two objects is a factor of both
            for key in &entry.keys {
                if let Some(entries) = objects.get_mut(key) {
                    entries.push(entry);
                }
            }
        }
        Self { objects: objects.into_iter().collect(), up: mapping.frame.up }
    }

    /// Puts each object where it costs the least, as far as any of the starts leads there.
    pub(crate) fn refine(&self, values: &mut Values) {
        for (key, entries) in &self.objects {
            if let Ok(start) = values.get::<DualQuadric>(key).copied() {
                let better = refined(key, start, entries, values, self.up);
                values.insert(key.clone(), better);
            }
        }
    }
}

/// The quadric among those that several starts lead to that leaves the fewest of its factors undefined, and then costs the
/// least; `start` itself, where none is better. Other variables are held where `others` has them.
pub fn refined(
    key: &Key,
    start: DualQuadric,
    entries: &[&FactorEntry],
    others: &Values,
    up: Option<Direction>,
) -> DualQuadric {
    let (graph, mut values) = alone(key, start, entries.iter().copied(), others);
    // what cannot be compiled is reported by the joint solve
    let Ok(mut problem) = Problem::compile(&graph, &values) else { return start };
    let mut best = (rank(&problem), start);
    for candidate in starts(&start, upright(up)) {
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

/// The graph of one object and its factors, where it starts, and the variables that these join it with, which are held.
pub(super) fn alone<'a>(
    key: &Key,
    start: DualQuadric,
    entries: impl Iterator<Item = &'a FactorEntry>,
    others: &Values,
) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for entry in entries {
        for other in entry.keys.iter().filter(|other| *other != key) {
            if let (false, Some(value)) = (values.contains(other.as_str()), others.variable(other.as_str())) {
                values.insert_boxed(other.clone(), value.erased().clone_box());
                graph.fix(other.clone());
            }
        }
        graph.push(entry.clone());
    }
    values.insert(key.clone(), start);
    (graph, values)
}

/// The start itself; a ball; and ellipsoids that are longest along each of these axes.
fn starts(start: &DualQuadric, axes: So3) -> Vec<DualQuadric> {
    let s = start.semi_axes;
    // the middle one is the least likely to be far off
    let radius = (s.sum() - s.min() - s.max()).max(SHORTEST);
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

/// Axes of which one is up.
fn upright(up: Option<Direction>) -> So3 {
    let rotation = Rotation3::rotation_between(&Vector3::z(), &up.unwrap_or_default());
    // there is none for exactly upside down, which is as good as upright
    rotation.map_or_else(So3::identity, |rotation| So3::from_matrix(rotation.matrix()))
}

/// Factors that are not defined, then the cost: a lost factor lowers the cost, and is no gain.
fn rank(problem: &Problem) -> (usize, f64) {
    let factors = problem.inspect();
    let cost: f64 = factors.iter().map(|factor| factor.cost).sum();
    let lost = factors.iter().filter(|factor| !factor.defined).count();
    (lost, if cost.is_finite() { cost } else { f64::INFINITY })
}

fn solver() -> LevenbergMarquardt {
    roughly(30, NotNegative::literal(1e-5))
}

/// Descends until a step lowers the cost by less than this share of it.
pub(super) fn roughly(max_iterations: usize, relative_cost: NotNegative) -> LevenbergMarquardt {
    let stop = Stopping { max_iterations, relative_cost, ..Stopping::default() };
    // damping of one size for all directions: a semi-axis that has all but vanished has next to no derivative, and
    // damping in proportion to that would let it go
    LevenbergMarquardt {
        diagonal: DiagonalLimits::EVEN,
        initial_lambda: Positive::literal(1e-3),
        stop,
        ..LevenbergMarquardt::default()
    }
}
