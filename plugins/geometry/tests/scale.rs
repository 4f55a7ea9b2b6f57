//! Trajectories of a camera without depth, whose scale drifts.
use manifactor_geometry::{Between, LieGroup, Prior, Se3, Sim3, So3, Tree, spanning_tree};
use manifactor_graph::{Factor, Graph, Key, Noise, Values};
use manifactor_solve::{Auto, Silent, solve};
use nalgebra::{SVector, Vector3};
use std::f64::consts::TAU;

/// Length of the unit of the odometry after the loop; it is 1 m before.
const GROWTH: f64 = 1.2;
/// Number of poses of the loop.
const POSES: usize = 200;
/// Radius of the loop, in metres.
const RADIUS: f64 = 10.0;
/// Noise of a step: rad, units of the odometry, log scale.
const SIGMAS: [f64; 7] = [1e-3, 1e-3, 1e-3, 3e-3, 3e-3, 3e-3, 2e-3];

/// Poses on a circle that rises and falls, with the camera turned along the way.
fn true_poses() -> Vec<Se3> {
    let pose = |i: usize| {
        let angle = TAU * i as f64 / POSES as f64;
        let at = Vector3::new(RADIUS * angle.cos(), RADIUS * angle.sin(), (2.0 * angle).sin());
        Se3::new(So3::exp(&Vector3::new(0.0, 0.0, angle)) * So3::exp(&Vector3::new(0.1, 0.0, 0.0)), at)
    };
    (0..POSES).map(pose).collect()
}

/// Uniform numbers from -1 to 1 that are the same in each run.
fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// The logarithm of the length of one unit of the odometry at a share of the loop.
type LogUnit = fn(f64) -> f64;

/// Adds odometry and a closure to a graph whose first variable is held, and solves it.
fn solved<G>(first: G, measured: &[(usize, usize, G)], sigmas: &[f64]) -> [Values; 2]
where
    Between<G>: Factor,
    Prior<G>: Factor,
    G: LieGroup,
{
    let mut graph = Graph::new();
    graph.add([key(0)], Prior { value: first }).noise(Noise::sigma(1e-6).unwrap());
    for (from, to, relative) in measured {
        let between = Between { relative: relative.clone() };
        graph.add([key(*from), key(*to)], between).noise(Noise::sigmas(sigmas).unwrap());
    }
    let start = spanning_tree(&graph, &Values::new(), Tree::Chain).unwrap();
    let solution = solve(&graph, &start, &Auto::default(), &mut Silent).unwrap();
    assert!(solution.outcome.termination.is_converged());
    [start, solution.values]
}

fn key(i: usize) -> Key {
    Key::indexed("x", i)
}

/// Returns the largest distance from the true positions as a share of the loop's length: of the odometry, after the
/// closure without scales, and with them.
fn errors(seed: u64, log_unit: LogUnit) -> [f64; 3] {
    let truth = true_poses();
    let with_unit = |(i, pose): (usize, &Se3)| {
        Sim3::new(pose.rotation, pose.translation, log_unit(i as f64 / (POSES - 1) as f64).exp())
    };
    let with_unit: Vec<Sim3> = truth.iter().enumerate().map(with_unit).collect();
    let mut state = seed;
    let mut measured = |from: usize, to: usize| {
        let exact = with_unit[from].between(&with_unit[to]);
        // the camera does not notice that its unit changes, unless it recognizes a place
        let seen = if to == 0 { exact } else { Sim3 { scale: 1.0, ..exact } };
        let noise = SVector::<f64, 7>::from(SIGMAS.map(|sigma| sigma * 3f64.sqrt() * uniform(&mut state)));
        (from, to, seen.compose(&Sim3::exp(&noise)))
    };
    let all: Vec<(usize, usize, Sim3)> = (1..=POSES).map(|i| measured(i - 1, i % POSES)).collect();
    let rigid: Vec<_> = all.iter().map(|(from, to, relative)| (*from, *to, relative.pose())).collect();
    let error = |position: &dyn Fn(usize) -> Vector3<f64>| {
        let distances = truth.iter().enumerate().map(|(i, pose)| (position(i) - pose.translation).norm());
        distances.fold(0.0, f64::max) / (TAU * RADIUS)
    };
    let [odometry, closed] = solved(truth[0], &rigid, &SIGMAS[..6]);
    let [_, scaled] = solved(with_unit[0], &all, &SIGMAS);
    let of_poses = |values: &Values| error(&|i| values.get::<Se3>(key(i)).unwrap().translation);
    [of_poses(&odometry), of_poses(&closed), error(&|i| scaled.get::<Sim3>(key(i)).unwrap().translation)]
}

/// Returns the largest of each error over ten seeds.
fn worst(log_unit: LogUnit) -> [f64; 3] {
    let all: Vec<[f64; 3]> = (1..=10).map(|seed| errors(seed, log_unit)).collect();
    [0, 1, 2].map(|i| all.iter().map(|errors| errors[i]).fold(0.0, f64::max))
}

#[test]
fn one_closure_corrects_a_drift_of_the_scale() {
    let cases: [(LogUnit, f64); 3] = [
        (|t| t * GROWTH.ln(), 0.005),
        (|t| t * t * GROWTH.ln(), 0.01),
        // a jump is spread over the loop, because no measurement says where it was
        (|t| if t < 0.5 { 0.0 } else { GROWTH.ln() }, 0.02),
    ];
    for (log_unit, limit) in cases {
        let [odometry, closed, scaled] = worst(log_unit);
        assert!(scaled < limit, "{scaled}");
        assert!(odometry > 0.03 && closed > 2.5 * scaled, "{odometry} {closed} {scaled}");
    }
}
