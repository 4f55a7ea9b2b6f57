//! Undetermined variables are reported by name, with their directions.
use crate::scene::{camera, desk, jitter, looking, sphere};
use manifactor_geometry::{Se3, So3};
use manifactor_graph::{Graph, Key, Manifold, Noise, Values};
use manifactor_quadric::{
    AxisOrder, BoundingBox, BoundingBoxFactor, BoxModel, Camera, DualQuadric, SemiAxes, SizePrior,
};
use manifactor_solve::{
    Auto, Dogleg, GaussNewton, LevenbergMarquardt, Optimizer, Silent, Termination, Undetermined, solve,
};
use nalgebra::Vector3;
use std::collections::BTreeSet;

/// Undetermined directions found by each solver.
fn open(graph: &Graph, values: &Values) -> Vec<Undetermined> {
    let solvers: [Box<dyn Optimizer>; 4] = [
        Box::new(GaussNewton::default()),
        Box::new(Dogleg::default()),
        Box::new(LevenbergMarquardt::default()),
        Box::new(Auto::default()),
    ];
    let find = |solver: &dyn Optimizer| {
        let outcome = solve(graph, values, solver, &mut Silent).unwrap().outcome;
        let found = outcome.undetermined.clone();
        println!(
            "{}: {:?} {}",
            solver.typetag_name(),
            found.as_ref().map(ToString::to_string),
            outcome.termination
        );
        found.unwrap_or_else(|| panic!("{solver:?} ends with {}", outcome.termination))
    };
    solvers.iter().map(|solver| find(&**solver)).collect()
}

/// Names of the directions along which a variable moves.
fn directions<'a>(open: &'a Undetermined, key: &str) -> BTreeSet<&'a str> {
    open.direction.iter().filter(|(k, _, _)| k.as_str() == key).map(|(_, name, _)| *name).collect()
}

fn object(semi_axes: Vector3<f64>) -> DualQuadric {
    DualQuadric { pose: Se3::exp(&jitter(3, 0.2)), semi_axes }
}

/// Fixed cameras that measure one quadric, with the initial value at the truth.
fn view_of(thing: &DualQuadric, eyes: &[Vector3<f64>]) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for (i, eye) in eyes.iter().enumerate() {
        let pose = looking(*eye, Vector3::zeros());
        let key = Key::indexed("x", i);
        let bounding_box = BoundingBox::new([0.0; 4]).unwrap();
        let mut factor = BoundingBoxFactor { bounding_box, camera: camera(), model: BoxModel::Standard };
        factor.bounding_box = factor.predict(&pose, thing).unwrap();
        graph.add([key.clone(), "q".into()], factor).noise(Noise::sigma(2.0).unwrap());
        graph.fix(key.clone());
        values.insert(key, pose);
    }
    values.insert("q", *thing);
    (graph, values)
}

#[test]
fn without_a_prior_everything_moves_together() {
    let (mut graph, values) = sphere(4, 10);
    graph.set_fixed("x0", manifactor_graph::Fixed::Whole(false));
    for open in open(&graph, &values) {
        assert_eq!(open.moving, 40, "{open}");
    }
}

#[test]
fn a_pose_that_nothing_sees_is_named_alone() {
    let (graph, mut values) = desk(20, 4);
    values.insert("stray", Se3::identity());
    for open in open(&graph, &values) {
        assert_eq!((open.moving, open.keys), (1, vec!["stray".into()]));
    }
}

#[test]
fn the_rotation_of_a_ball_is_open_and_nothing_else() {
    let eyes: Vec<_> = (0..12).map(|i| 3.0 * jitter::<3>(i, 1.0).normalize()).collect();
    let ball = object(Vector3::repeat(0.2));
    let (graph, mut values) = view_of(&ball, &eyes);
    let at_rest = solve(&graph, &values, &GaussNewton::default(), &mut Silent).unwrap();
    assert!(
        at_rest.outcome.termination.is_converged(),
        "where there is nothing to do nobody asks what is open"
    );
    let at_rest = at_rest.diagnose(&graph).unwrap();
    assert_eq!(at_rest.condition, None);
    values.insert("q", DualQuadric { semi_axes: Vector3::repeat(0.25), ..ball });
    let on_the_way = solve(&graph, &values, &GaussNewton::default(), &mut Silent).unwrap().outcome;
    for open in [at_rest.undetermined.unwrap(), on_the_way.undetermined.unwrap()] {
        println!("{open}");
        assert_eq!((open.moving, open.keys[0].as_str()), (1, "q"));
        assert!(directions(&open, "q").is_subset(&["rx", "ry", "rz"].into()), "{open}");
    }
}

#[test]
fn a_quadric_that_is_seen_from_one_side_is_open() {
    let thing = object(Vector3::new(0.1, 0.2, 0.3));
    for looks in [1, 5] {
        // The result does not depend on the number of views from one place.
        let (graph, mut values) = view_of(&thing, &vec![Vector3::new(3.0, 0.0, 0.5); looks]);
        let diagnosis =
            solve(&graph, &values, &Auto::default(), &mut Silent).unwrap().diagnose(&graph).unwrap();
        values.insert("q", thing.retract(&jitter(1, 0.02)));
        for open in open(&graph, &values).into_iter().chain(diagnosis.undetermined) {
            assert_eq!((open.moving, open.keys), (1, vec!["q".into()]));
        }
    }
}

/// An object with two views and a prior of two equal lengths, so the prior favours a round shape. The
/// rotation about its long axis is poorly determined.
fn round() -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let camera = Camera::new([525.0, 525.0, 320.0, 240.0], 640, 480).unwrap();
    let aside =
        Se3::new(So3::from_quaternion_xyzw([0.0, -0.2, 0.0, 0.98]).unwrap(), Vector3::new(1.0, 0.0, 0.2));
    let boxes = [[270.1, 224.8, 340.7, 283.0], [296.8, 206.1, 362.8, 289.9]];
    for ((key, pose), bounds) in [("x0", Se3::identity()), ("x1", aside)].into_iter().zip(boxes) {
        let bounding_box = BoundingBox::new(bounds).unwrap();
        values.insert(key, pose);
        graph.fix(key);
        let factor = BoundingBoxFactor { bounding_box, camera, model: BoxModel::Standard };
        graph.add([key, "q"], factor).noise(Noise::sigma(2.0).unwrap());
    }
    let semi_axes = SemiAxes::new(Vector3::new(0.04, 0.04, 0.12)).unwrap();
    let prior = SizePrior { semi_axes, order: AxisOrder::Sorted };
    graph.add(["q"], prior).noise(Noise::sigma(0.3).unwrap());
    let rotation = So3::from_quaternion_xyzw([-0.224325, -0.260509, 0.185454, 0.920554]).unwrap();
    let pose = Se3::new(rotation, Vector3::new(0.1, 0.1, 2.0));
    values.insert("q", DualQuadric { pose, semi_axes: Vector3::new(0.05, 0.05, 0.1) });
    (graph, values)
}

#[test]
fn what_still_moves_when_iterations_run_out_is_named() {
    let (graph, values) = round();
    let outcome = solve(&graph, &values, &LevenbergMarquardt::default(), &mut Silent).unwrap().outcome;
    assert_eq!(outcome.termination, Termination::MaxIterations);
    let moving = outcome.moving.unwrap();
    println!("{moving}");
    assert_eq!((moving.moving, &moving.keys[..]), (1, &["q".into()][..]));
}

#[test]
fn damped_steps_at_a_minimum_have_converged() {
    // Damping is needed up to the minimum and so never decreases; this must not count as a stall.
    let (graph, values) = round();
    let outcome = solve(&graph, &values, &Auto::default(), &mut Silent).unwrap().outcome;
    println!("{} {} {}", outcome.termination, outcome.final_cost, outcome.iterations);
    assert!(outcome.termination.is_converged(), "{}", outcome.termination);
    assert!((outcome.final_cost - 28.470_567).abs() < 1e-4, "{}", outcome.final_cost);
}
