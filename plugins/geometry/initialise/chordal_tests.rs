use super::*;
use crate::testing::{any_se2, any_se3};
use crate::{BearingRange2, Coordinates, Landmark, Point2};
use manifactor_graph::checked::Positive;
use manifactor_graph::{Key, Manifold, Noise};
use nalgebra::{DMatrix, DVector, Vector2, Vector3, Vector6};
use proptest::prelude::*;

/// A ring with chords through the given poses, measured without noise.
fn ring<P: Pose<D>, const D: usize>(truth: &[P]) -> (Graph, Values)
where
    Between<P>: Factor,
{
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let n = truth.len();
    for (i, pose) in truth.iter().enumerate() {
        // All values but the first are far from the truth.
        values.insert(Key::indexed("x", i), if i == 0 { *pose } else { P::identity() });
        for step in [1, 2] {
            let k = (i + step) % n;
            let relative = P::compose(&P::inverse(pose), &truth[k]);
            graph.add([Key::indexed("x", i), Key::indexed("x", k)], Between { relative });
        }
    }
    (graph, values)
}

/// Largest distance of an initial value on the ring from the truth.
fn error<P: Pose<D>, const D: usize>(truth: &[P]) -> f64
where
    Between<P>: Factor,
{
    let (graph, values) = ring(truth);
    let started = Chordal {}.start(&graph, &values).unwrap();
    let one = |(i, pose): (usize, &P)| {
        let found = started.get::<P>(Key::indexed("x", i)).unwrap();
        (found.rotation() - pose.rotation()).norm() + (found.translation() - pose.translation()).norm()
    };
    truth.iter().enumerate().map(one).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn without_noise_the_truth_is_found(
        flat in prop::collection::vec(any_se2(), 5..9),
        space in prop::collection::vec(any_se3(), 5..9),
    ) {
        let turns_in_space: Vec<So3> = space.iter().map(|x| x.rotation).collect();
        let turns: Vec<So2> = flat.iter().map(|x| x.rotation).collect();
        let errors = [error(&flat), error(&space), error(&turns), error(&turns_in_space)];
        prop_assert!(errors.iter().all(|e| *e < 1e-6), "{errors:?}");
    }
}

fn cost(graph: &Graph, values: &Values) -> f64 {
    let one = |entry: &manifactor_graph::FactorEntry| {
        let variables: Vec<_> = entry.keys.iter().map(|k| values.variable(k.as_str()).unwrap()).collect();
        let r = DVector::from_vec(entry.factor.erased().residual(&variables).unwrap());
        0.5 * r.dot(&(entry.noise.information_matrix(r.len()).unwrap() * &r))
    };
    graph.factors().iter().map(one).sum()
}

/// A triangle that does not close, with full information matrices.
fn open_triangle() -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for (k, keys) in [["x0", "x1"], ["x1", "x2"], ["x2", "x0"]].into_iter().enumerate() {
        values.insert(keys[0], Se3::identity());
        let relative = Se3::exp(&Vector6::new(0.1, 2.0 + 0.2 * k as f64, 0.3, 1.0, 0.2, -0.1));
        let root =
            DMatrix::from_fn(6, 6, |r, c| if r == c { 3.0 } else { ((r * 5 + c * 3 + k) % 7) as f64 * 0.2 });
        graph.add(keys, Between { relative }).noise(Noise::information(root.tr_mul(&root)).unwrap());
    }
    (graph, values)
}

#[test]
fn positions_minimise_the_whole_cost_with_the_rotations_held() {
    let (graph, values) = open_triangle();
    let started = Chordal {}.start(&graph, &values).unwrap();
    let least = cost(&graph, &started);
    assert!(least > 1e-3, "the triangle does not close");
    for key in ["x1", "x2"] {
        for direction in 0..6 {
            let mut shift = Vector3::zeros();
            shift[direction / 2] = if direction % 2 == 0 { 1e-3 } else { -1e-3 };
            let mut moved = started.clone();
            let x = started.get::<Se3>(key).unwrap();
            moved.insert(key, Se3::new(x.rotation, x.translation + shift));
            assert!(cost(&graph, &moved) > least);
        }
    }
}

#[test]
fn held_poses_and_priors_are_where_it_starts_from() {
    let step = |x: f64| Between { relative: Se2::exp(&Vector3::new(x, 0.0, 0.5)) };
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for key in ["a0", "a1", "b0", "b1", "c0", "c1"] {
        values.insert(key, Se2::exp(&Vector3::new(7.0, 8.0, 0.9)));
    }
    for [x, y] in [["a0", "a1"], ["b0", "b1"], ["c0", "c1"]] {
        graph.add([x, y], step(1.0));
    }
    graph.fix("a1");
    graph.add(["b1"], Prior { value: Se2::identity() });
    let started = Chordal {}.start(&graph, &values).unwrap();
    let get = |key| *started.get::<Se2>(key).unwrap();
    assert_eq!(Some(&get("a1")), values.get::<Se2>("a1").ok());
    assert!(get("b1").log().norm() < 1e-12, "at its prior");
    assert!(get("c0").local(values.get::<Se2>("c0").unwrap()).norm() < 1e-12, "the first of its part");
    assert!(cost(&graph, &started) < 1e-20);
    let keys: Vec<_> = started.iter().map(|(key, _)| key.as_str()).collect();
    assert_eq!(keys, ["a0", "a1", "b0", "b1", "c0", "c1"]);
}

#[test]
fn points_move_along_with_the_poses_that_saw_them() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for key in ["x0", "x1"] {
        values.insert(key, Se2::identity());
    }
    for key in ["held", "seen", "prior", "ranged"] {
        values.insert(key, Point2::new(Vector2::new(9.0, 9.0)));
    }
    graph.add(["x0", "x1"], Between { relative: Se2::exp(&Vector3::new(1.0, 0.0, 0.0)) });
    for key in ["held", "seen", "prior"] {
        graph.add(["x1", key], Landmark { position: Coordinates::new(Vector2::new(1.0, 0.0)).unwrap() });
    }
    graph.add(["x1", "ranged"], BearingRange2::new(So2::exp(0.0), Positive::literal(3.0)));
    graph.add(["prior"], Prior { value: Point2::new(Vector2::new(2.5, 0.0)) });
    graph.fix("held");
    let started = Chordal {}.start(&graph, &values).unwrap();
    let x = |key| started.get::<Point2>(key).unwrap().x;
    assert_eq!((x("held"), x("prior")), (9.0, 9.0));
    assert!((x("seen") - 2.0).abs() + (x("ranged") - 4.0).abs() < 1e-12);
}

#[test]
fn measurements_without_a_direction_leave_it_as_it_is() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("x0", Se2::identity());
    values.insert("x1", Se2::new(So2::exp(0.7), Vector2::new(5.0, 6.0)));
    let relative = Se2::exp(&Vector3::new(1.0, 2.0, 0.3));
    let only = |rows: &[bool]| Noise::unit().observing(rows);
    graph.add(["x0", "x1"], Between { relative }).noise(only(&[false, false, true]));
    let x1 = *Chordal {}.start(&graph, &values).unwrap().get::<Se2>("x1").unwrap();
    assert!((x1.rotation.angle() - 0.3).abs() < 1e-12 && x1.translation == Vector2::new(5.0, 6.0));
    graph.factors_mut()[0].noise(only(&[true, true, false]));
    let x1 = *Chordal {}.start(&graph, &values).unwrap().get::<Se2>("x1").unwrap();
    assert!(
        (x1.rotation.angle() - 0.7).abs() < 1e-12 && (x1.translation - relative.translation).norm() < 1e-9
    );
    // One measured coordinate does not determine the position of x1.
    graph.factors_mut()[0].noise(only(&[true, false, true]));
    let error = Chordal {}.start(&graph, &values).unwrap_err();
    assert!(error.to_string().contains("leave the positions of some of the 2 variables"), "{error}");
}

#[test]
fn values_may_be_missing() {
    let (graph, _) = open_triangle();
    let started = Chordal {}.start(&graph, &Values::new()).unwrap();
    assert!(graph.check(&started).is_empty() && started.len() == 3);
}

#[test]
fn without_relative_poses_it_does_not_apply() {
    let mut graph = Graph::new();
    graph.add(["p", "q"], Between { relative: Point2::new(Vector2::x()) });
    let error = Chordal {}.start(&graph, &Values::new()).unwrap_err();
    assert!(matches!(error, StartError::NotApplicable { start: "chordal", .. }), "{error}");
    let mut wrong = Values::new();
    wrong.insert("x0", So2::identity());
    let (graph, _) = open_triangle();
    let error = Chordal {}.start(&graph, &wrong).unwrap_err();
    assert_eq!(error.to_string(), "the variable `x0` is of type so2, not se3");
}
