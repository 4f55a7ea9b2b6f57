//! Covariances against the inverse of the dense Hessian.
use crate::toy::*;
use manifactor_graph::{Graph, Noise, Values};
use manifactor_solve::{CovarianceError, GaussNewton, Problem, Silent, solve};
use nalgebra::DMatrix;

/// A chain of points with a measurement of the first, and a loop.
fn chain(n: usize) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for i in 0..n {
        values.insert(format!("p{i}"), Plane { x: i as f64, y: 0.0 });
    }
    graph.add(["p0"], At { at: [0.0, 0.0] }).noise(Noise::sigma(0.5).unwrap());
    for i in 1..n {
        let by = [1.0, 0.0];
        graph.add([format!("p{}", i - 1), format!("p{i}")], Apart { by }).noise(Noise::sigma(0.1).unwrap());
    }
    (graph, values)
}

#[test]
fn uncertainty_adds_up_along_a_chain() {
    let (graph, values) = chain(10);
    let marginals = Problem::compile(&graph, &values).unwrap().marginals().unwrap();
    for (i, (key, covariance)) in marginals.iter().enumerate() {
        assert_eq!(key.as_str(), format!("p{i}"));
        let expected = DMatrix::identity(2, 2) * (0.25 + 0.01 * i as f64);
        assert!((covariance - expected).amax() < 1e-12, "{key}: {covariance}");
    }
}

#[test]
fn a_graph_that_was_changed_since_the_solve_is_asked_as_it_is() {
    let (mut graph, values) = chain(3);
    let solution = solve(&graph, &values, &GaussNewton::default(), &mut Silent).unwrap();
    let of_p0 = |graph: &Graph| solution.marginals(graph, &["p0"]).unwrap()[0].covariance[(0, 0)];
    assert!((of_p0(&graph) - 0.25).abs() < 1e-12);
    assert!((of_p0(&graph.clone()) - 0.25).abs() < 1e-12);
    graph.factors_mut()[0].noise = Noise::sigma(3.0).unwrap();
    assert!((of_p0(&graph) - 9.0).abs() < 1e-9);
    graph.fix("p0");
    assert_eq!(of_p0(&graph), 0.0);
}

#[test]
fn joint_covariances_have_what_is_common() {
    let (graph, values) = chain(10);
    let mut problem = Problem::compile(&graph, &values).unwrap();
    let joint = problem.joint_covariance(&["p7", "p2"]).unwrap();
    assert!((joint[(0, 0)] - 0.32).abs() < 1e-12 && (joint[(3, 3)] - 0.27).abs() < 1e-12);
    // both share the error of the path to p2
    assert!((joint[(0, 2)] - 0.27).abs() < 1e-12 && joint[(0, 3)].abs() < 1e-12);
    let unknown = problem.joint_covariance(&["p2", "q"]).unwrap_err();
    assert_eq!(unknown.to_string(), "there is no variable `q`");
}

#[test]
fn what_is_held_is_certain() {
    let (mut graph, values) = chain(4);
    graph.fix_directions("p1", &["x"]);
    graph.fix("p3");
    let marginals = Problem::compile(&graph, &values).unwrap().marginals().unwrap();
    let of = |key: &str| &marginals.iter().find(|(k, _)| k.as_str() == key).unwrap().1;
    assert_eq!(of("p3").amax(), 0.0);
    assert!(of("p1")[(0, 0)] == 0.0 && of("p1")[(1, 1)] > 0.0);
    // between p1 and p3, which are both fixed along x: half the variance of a step
    assert!((of("p2")[(0, 0)] - 0.005).abs() < 1e-12);
}

#[test]
fn nothing_to_hold_it_is_an_error_with_a_name() {
    let (graph, values) = chain(3);
    let mut loose = Graph::new();
    for entry in graph.factors().iter().skip(1) {
        loose.push(entry.clone());
    }
    let error = Problem::compile(&loose, &values).unwrap().marginals().unwrap_err();
    assert!(matches!(error, CovarianceError::Indeterminate(_)), "{error}");
}

#[test]
fn leverages_add_up_to_the_number_of_unknowns() {
    let (mut graph, values) = chain(6);
    // a chain has no redundancy; a second measurement of one step shares its leverage
    let (by, noise) = ([1.0, 0.0], Noise::sigma(0.1).unwrap());
    graph.add(["p1", "p2"], Apart { by }).noise(noise);
    let leverages = Problem::compile(&graph, &values).unwrap().leverages().unwrap();
    for (i, rows) in leverages.iter().enumerate() {
        let expected = if [2, 6].contains(&i) { 0.5 } else { 1.0 };
        assert!(rows.iter().all(|h| (h - expected).abs() < 1e-8), "{i}: {rows:?}");
    }
    let total: f64 = leverages.iter().flatten().sum();
    assert!((total - 12.0).abs() < 1e-8);
}

#[test]
fn what_is_held_takes_nothing_up() {
    let (mut graph, values) = chain(3);
    graph.fix_directions("p1", &["x"]);
    let leverages = Problem::compile(&graph, &values).unwrap().leverages().unwrap();
    // along x the first point has two measurements: its own, and the one from the fixed point
    let total: f64 = leverages.iter().flatten().sum();
    assert!((total - 5.0).abs() < 1e-8, "{leverages:?}");
}

#[test]
fn what_nothing_constrains_takes_nothing_up() {
    let (graph, mut values) = chain(3);
    values.insert("alone", Plane { x: 0.0, y: 0.0 });
    let leverages = Problem::compile(&graph, &values).unwrap().leverages().unwrap();
    let total: f64 = leverages.iter().flatten().sum();
    assert!((total - 6.0).abs() < 1e-8, "{leverages:?}");
}

#[test]
fn a_question_takes_the_factorization_at_hand() {
    let (graph, values) = chain(200);
    let mut problem = Problem::compile(&graph, &values).unwrap();
    let all = problem.marginals().unwrap();
    let factorized = problem.times().factorize;
    for key in ["p0", "p77", "p199"] {
        let one = problem.factorized().unwrap().marginal(key).unwrap();
        let of_all = &all.iter().find(|(k, _)| k.as_str() == key).unwrap().1;
        assert!((&one - of_all).amax() < 1e-12, "{key}");
    }
    assert!(factorized > 0.0 && problem.times().factorize == factorized);
    // a changed problem has a different covariance: here a weight has changed
    problem.set_weights(&vec![0.25; problem.factors()]).unwrap();
    let one = problem.factorized().unwrap().marginal("p77").unwrap();
    assert!((one - &all[77].1 * 4.0).amax() < 1e-9 && problem.times().factorize > factorized);
}

#[test]
fn few_marginals_are_those_of_all() {
    let (graph, values) = chain(100);
    let solution = solve(&graph, &values, &GaussNewton::default(), &mut Silent).unwrap();
    let all = solution.marginals(&graph, &[]).unwrap();
    for one in solution.marginals(&graph, &["p3", "p99"]).unwrap() {
        let of_all = all.iter().find(|marginal| marginal.key == one.key).unwrap();
        assert!((one.covariance - &of_all.covariance).amax() < 1e-12);
    }
}
