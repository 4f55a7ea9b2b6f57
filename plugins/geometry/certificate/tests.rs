use super::*;
use crate::{Chordal, So2, So3};
use manifactor_graph::loss::Huber;
use manifactor_solve::Start;
use nalgebra::{DMatrix, Vector2, Vector3, Vector6};
use std::f64::consts::TAU;

/// A regular ring of `n` poses that turn once, with a measurement from each pose to the next, including the
/// loop closure; the values turn `turns` times.
fn ring(n: usize, turns: f64) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let step = |turns: f64| Se2::exp(&Vector3::new(1.0, 0.0, TAU * turns / n as f64));
    let mut pose = Se2::identity();
    for i in 0..n {
        values.insert(Key::indexed("x", i), pose);
        pose = pose.compose(&step(turns));
        let keys = [Key::indexed("x", i), Key::indexed("x", (i + 1) % n)];
        graph.add(keys, Between { relative: step(1.0) }).noise(Noise::sigmas(&[10.0, 10.0, 0.1]).unwrap());
    }
    graph.fix("x0");
    (graph, values)
}

#[test]
fn a_cycle_without_noise_is_certified() {
    let (graph, values) = ring(8, 1.0);
    let certificate = certify(&graph, &values).unwrap();
    assert!(certificate.certified, "{certificate:?}");
    assert!(certificate.chordal_cost < 1e-12 && certificate.suboptimality < 1e-6);
    assert!(certificate.smallest_eigenvalue.abs() < 1e-9);
}

#[test]
fn a_ring_that_is_wrapped_around_is_a_local_minimum_and_not_certified() {
    for turns in [2.0, 0.0] {
        let (graph, values) = ring(12, turns);
        let certificate = certify(&graph, &values).unwrap();
        assert!(!certificate.certified, "{certificate:?}");
        assert!(certificate.chordal_cost > 1.0, "stays in its basin: {certificate:?}");
        assert!(certificate.smallest_eigenvalue < -1e-4);
        // The global minimum is zero, so the bound must not be above zero.
        assert_eq!(certificate.lower_bound, 0.0);
        assert!(certificate.suboptimality >= certificate.chordal_cost);
        let found = certify(&graph, &Chordal {}.start(&graph, &values).unwrap()).unwrap();
        assert!(found.certified && found.chordal_cost < 1e-12, "{found:?}");
    }
}

/// Poses in space with chords, and different noise in every measurement.
fn noisy(information: &DMatrix<f64>) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let pose = |i: usize| {
        let i = i as f64;
        Se3::new(So3::exp(&Vector3::new(0.3 * i, -0.2 * i, 0.5)), Vector3::new(i, i * i * 0.1, 0.5))
    };
    for i in 0..10 {
        values.insert(Key::indexed("x", i), pose(i));
        for k in i + 1..(i + 4).min(10) {
            let noise = Vector6::from_fn(|r, _| ((7 * i + 3 * k + 5 * r) % 11) as f64 * 0.01 - 0.05);
            let relative = pose(i).between(&pose(k)).compose(&Se3::exp(&noise));
            let keys = [Key::indexed("x", i), Key::indexed("x", k)];
            graph.add(keys, Between { relative }).noise(Noise::information(information.clone()).unwrap());
        }
    }
    graph.add(["x3"], Prior { value: pose(3) });
    (graph, values)
}

#[test]
fn with_noise_the_bound_is_tight_and_below_the_cost_of_the_graph() {
    let weights = [400.0, 400.0, 400.0, 100.0, 100.0, 100.0];
    let (graph, values) = noisy(&DMatrix::from_diagonal(&weights.to_vec().into()));
    let certificate = certify(&graph, &values).unwrap();
    assert!(certificate.certified, "{certificate:?}");
    assert!(certificate.chordal_cost > 0.1);
    assert!(certificate.suboptimality < 1e-6 * certificate.chordal_cost, "{certificate:?}");
    let solved = solve(&graph, &values, &GaussNewton::default(), &mut Silent).unwrap().outcome;
    let bound = certificate.cost_bound.unwrap();
    // The two costs differ by the curvature of rotations.
    assert!(bound <= solved.final_cost && bound > 0.99 * solved.final_cost, "{bound} {}", solved.final_cost);
    assert!(certificate.to_string().contains("certified: this is the basin of the global minimum"));
}

#[test]
fn of_uneven_noise_only_the_chordal_cost_is_bounded() {
    let root = DMatrix::from_fn(6, 6, |r, c| if r == c { 10.0 } else { ((r + 2 * c) % 5) as f64 * 0.5 });
    let (graph, values) = noisy(&root.tr_mul(&root));
    let certificate = certify(&graph, &values).unwrap();
    assert!(certificate.certified && certificate.cost_bound.is_none(), "{certificate:?}");
}

#[test]
fn what_is_no_pose_graph_is_refused_with_the_reason() {
    let refused = |graph: &Graph, values: &Values| certify(graph, values).unwrap_err().to_string();
    let (graph, values) = ring(4, 1.0);
    let mut robust = graph.clone();
    robust.factors_mut()[2].loss(Huber::default());
    assert!(refused(&robust, &values).contains("factor 2 has a robust loss"));
    let mut held = graph.clone();
    held.fix("x2");
    assert!(refused(&held, &values).contains("around `x0`"));
    let mut open = graph.clone();
    open.factors_mut()[1].noise(Noise::unit().observing(&[true, true, false]));
    assert!(refused(&open, &values).contains("factor 1 leaves a rotation or a translation open"));
    let mut other = graph.clone();
    other.add(["x0"], crate::Position::<2> { position: Default::default(), lever_arm: Default::default() });
    assert!(refused(&other, &values).contains("factor 4 is a `position_se2`"));
    let mut turns = Graph::new();
    turns.add(["a", "b"], Between { relative: So2::identity() });
    assert!(refused(&turns, &Values::new()).contains("needs a pose graph"));
}

#[test]
fn weights_are_inverses_of_mean_variances() {
    use crate::initialise::network::Information;
    let mut information = Information::<2> {
        turn: nalgebra::Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 8.0)),
        cross: nalgebra::SMatrix::zeros(),
        shift: nalgebra::Matrix2::from_diagonal(&Vector2::new(1.0, 4.0)),
    };
    assert_eq!((information.chordal_weight(), information.shift_weight()), (4.0, 1.6));
    assert!(!information.is_isotropic());
    information.shift[(1, 1)] = 1.0;
    assert!(information.is_isotropic());
    information.cross[(0, 2)] = 2.0;
    // From the joint covariance: (8 - 4)⁻¹ for the angle, (1 - 4/8)⁻¹ and 1 along x and y.
    assert!(
        (information.chordal_weight() - 2.0).abs() + (information.shift_weight() - 2.0 / 3.0).abs() < 1e-12
    );
}
