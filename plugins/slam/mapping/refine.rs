//! A better start for each object: fitted alone to its own factors, from several places.
//!
//! An orientation factor looks at the longest axis only, so that its cost has a valley for each axis that might be the
//! longest, and a box says little of the extent along its line of sight. A joint solve stays in the valley where it
//! begins. One object alone is nine numbers: all its valleys can be tried, while the poses are held.
use manifactor_geometry::{Se3, So3};
use manifactor_graph::{Direction, FactorEntry, Graph, Key, Values};
use manifactor_quadric::DualQuadric;
use manifactor_solve::{LevenbergMarquardt, Optimizer, Problem, Silent, Stopping};
use nalgebra::{Rotation3, Vector3};

/// How much longer than the others the longest axis of a start is.
const ELONGATION: f64 = 1.5;

/// The quadric among those that the starts lead to that leaves the fewest factors undefined, and then costs the least;
/// `start` itself, where none is better.
pub(super) fn refine(
    key: &Key,
    start: DualQuadric,
    entries: &[FactorEntry],
    poses: &Values,
    up: Option<Direction>,
) -> DualQuadric {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for entry in entries {
        for pose in entry.keys.iter().filter(|pose| *pose != key) {
            if let (false, Some(value)) = (values.contains(pose.as_str()), poses.variable(pose.as_str())) {
                values.insert_boxed(pose.clone(), value.erased().clone_box());
                graph.fix(pose.clone());
            }
        }
        graph.push(entry.clone());
    }
    values.insert(key.clone(), start);
    // what cannot be compiled is reported by the joint solve
    let Ok(mut problem) = Problem::compile(&graph, &values) else { return start };
    let mut best = (rank(&problem), start);
    for candidate in starts(start, up) {
        values.insert(key.clone(), candidate);
        problem.set_values(&values);
        solver().solve(&mut problem, &mut Silent);
        let found = problem.values().get::<DualQuadric>(key).copied();
        if let (Ok(found), rank) = (found, rank(&problem))
            && rank < best.0
        {
            best = (rank, found);
        }
    }
    best.1
}

/// Factors that are not defined, then the cost: a lost factor lowers the cost, and is no gain.
fn rank(problem: &Problem) -> (usize, f64) {
    let at = problem.cost();
    (at.inactive, if at.cost.is_finite() { at.cost } else { f64::INFINITY })
}

fn solver() -> LevenbergMarquardt {
    let stop = Stopping { max_iterations: 30, relative_cost: 1e-5, ..Stopping::default() };
    // damping of one size for all directions: a semi-axis that has all but vanished has next to no derivative, and
    // damping in proportion to that would let it go
    LevenbergMarquardt { diagonal: [1.0, 1.0], initial_lambda: 1e-3, stop, ..LevenbergMarquardt::default() }
}

/// The start itself; a ball; and ellipsoids that are longest along each axis of the world.
fn starts(start: DualQuadric, up: Option<Direction>) -> Vec<DualQuadric> {
    let s = start.semi_axes;
    // the middle one is the least likely to be far off
    let radius = s.sum() - s.min() - s.max();
    let upright = Rotation3::rotation_between(&Vector3::z(), &up.unwrap_or_default());
    let upright = upright.map_or_else(So3::identity, |r| So3::from_matrix(r.matrix()));
    let along_world = |semi_axes| DualQuadric { pose: Se3::new(upright, start.centroid()), semi_axes };
    let mut starts = vec![start, along_world(Vector3::repeat(radius))];
    for longest in 0..3 {
        let mut semi_axes = Vector3::repeat(radius);
        semi_axes[longest] *= ELONGATION;
        starts.push(along_world(semi_axes));
    }
    starts
}
