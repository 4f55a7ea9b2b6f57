//! What nothing constrains is named, with its directions.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic, clippy::print_stdout)]
mod scene;
use manifactor_geometry::Se3;
use manifactor_graph::{Graph, Key, Manifold, Noise, Values};
use manifactor_quadric::{BoundingBox, BoundingBoxFactor, BoxModel, DualQuadric};
use manifactor_solve::{
    Auto, Dogleg, GaussNewton, LevenbergMarquardt, Optimizer, Silent, Termination, Undetermined, solve,
};
use nalgebra::Vector3;
use scene::{camera, desk, jitter, looking, sphere};
use std::collections::BTreeSet;

/// What each solver finds open: as its ending, or as a warning where it damps.
fn open(graph: &Graph, values: &Values) -> Vec<Undetermined> {
    let solvers: [Box<dyn Optimizer>; 4] = [
        Box::new(GaussNewton::default()),
        Box::new(Dogleg::default()),
        Box::new(LevenbergMarquardt::default()),
        Box::new(Auto::default()),
    ];
    let find = |solver: &dyn Optimizer| {
        let outcome = solve(graph, values, solver, &mut Silent).unwrap().outcome;
        let found = match outcome.termination.clone() {
            Termination::Indeterminate(found) => Some(found),
            _ => outcome.undetermined.clone(),
        };
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

/// Names of the directions in which a variable moves.
fn directions<'a>(open: &'a Undetermined, key: &str) -> BTreeSet<&'a str> {
    open.direction.iter().filter(|(k, _, _)| k.as_str() == key).map(|(_, name, _)| *name).collect()
}

fn thing(semi_axes: Vector3<f64>) -> DualQuadric {
    DualQuadric { pose: Se3::exp(&jitter(3, 0.2)), semi_axes }
}

/// Fixed cameras that see one quadric, which begins where it is.
fn seen(thing: &DualQuadric, eyes: &[Vector3<f64>]) -> (Graph, Values) {
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
    let ball = thing(Vector3::repeat(0.2));
    let (graph, mut values) = seen(&ball, &eyes);
    let at_rest = solve(&graph, &values, &GaussNewton::default(), &mut Silent).unwrap();
    assert!(
        at_rest.outcome.termination.is_converged(),
        "where there is nothing to do nobody asks what is open"
    );
    let at_rest = at_rest.diagnose(&graph).unwrap();
    assert_eq!(at_rest.condition, None);
    values.insert("q", DualQuadric { semi_axes: Vector3::repeat(0.25), ..ball });
    let Termination::Indeterminate(on_the_way) =
        solve(&graph, &values, &GaussNewton::default(), &mut Silent).unwrap().outcome.termination
    else {
        panic!("no step is determined")
    };
    for open in [at_rest.undetermined.unwrap(), on_the_way] {
        println!("{open}");
        assert_eq!((open.moving, open.keys[0].as_str()), (1, "q"));
        assert!(directions(&open, "q").is_subset(&["rx", "ry", "rz"].into()), "{open}");
    }
}

#[test]
fn a_quadric_that_is_seen_from_one_side_is_open() {
    let thing = thing(Vector3::new(0.1, 0.2, 0.3));
    for looks in [1, 5] {
        // however often it is looked at from the same place
        let (graph, mut values) = seen(&thing, &vec![Vector3::new(3.0, 0.0, 0.5); looks]);
        let diagnosis =
            solve(&graph, &values, &Auto::default(), &mut Silent).unwrap().diagnose(&graph).unwrap();
        values.insert("q", thing.retract(&jitter(1, 0.02)));
        for open in open(&graph, &values).into_iter().chain(diagnosis.undetermined) {
            assert_eq!((open.moving, open.keys), (1, vec!["q".into()]));
        }
    }
}
