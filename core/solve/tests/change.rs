//! Measurements and noise of a compiled problem, changed in place.
use crate::toy::*;
use manifactor_graph::{Graph, Noise, Values};
use manifactor_solve::{GaussNewton, Optimizer, Problem, ProblemChangeError, Silent};

fn tracked() -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("x", Plane { x: 0.0, y: 0.0 });
    graph.add(["x"], At { at: [1.0, 0.0] }).noise(Noise::sigma(0.5).unwrap());
    graph.add(["x"], At { at: [3.0, 0.0] }).noise(Noise::sigma(0.5).unwrap());
    (graph, values)
}

fn solved(problem: &mut Problem) -> f64 {
    assert!(GaussNewton::default().descend(problem, &mut Silent).termination.is_converged());
    problem.values().get::<Plane>("x").unwrap().x
}

#[test]
fn a_loop_changes_measurements_and_noise_and_compiles_once() {
    let (mut graph, values) = tracked();
    let mut problem = Problem::compile(&graph, &values).unwrap();
    assert!((solved(&mut problem) - 2.0).abs() < 1e-12);
    for at in [5.0, 7.0] {
        problem.factor_mut::<At>(1).unwrap().at = [at, 0.0];
        assert!((solved(&mut problem) - (1.0 + at) / 2.0).abs() < 1e-12);
    }
    problem.set_noise(1, &Noise::sigma(1.0).unwrap()).unwrap();
    let changed = solved(&mut problem);
    let covariance = problem.factorized().unwrap().marginal("x").unwrap();
    // equals the changed graph, compiled again
    graph.factors_mut()[1] = {
        let mut other = Graph::new();
        other.add(["x"], At { at: [7.0, 0.0] }).noise(Noise::sigma(1.0).unwrap());
        other.factors()[0].clone()
    };
    let mut anew = Problem::compile(&graph, &values).unwrap();
    assert!((changed - solved(&mut anew)).abs() < 1e-12);
    assert!((covariance - anew.factorized().unwrap().marginal("x").unwrap()).amax() < 1e-12);
}

#[test]
fn what_does_not_fit_is_refused_and_changes_nothing() {
    let (graph, values) = tracked();
    let mut problem = Problem::compile(&graph, &values).unwrap();
    let before = problem.linearize();
    assert_eq!(
        problem.factor_mut::<At>(2).unwrap_err(),
        ProblemChangeError::NoFactor { factor: 2, factors: 2 }
    );
    let wrong = problem.factor_mut::<Apart>(0).unwrap_err().to_string();
    assert!(wrong.contains("factor 0 is a ") && wrong.contains("Apart"), "{wrong}");
    let kind = problem.set_noise(0, &Noise::unit()).unwrap_err();
    assert_eq!(kind, ProblemChangeError::NoiseKind { factor: 0 });
    let rows = problem.set_noise(0, &Noise::sigmas(&[1.0, 1.0, 1.0]).unwrap()).unwrap_err();
    assert!(matches!(rows, ProblemChangeError::Noise { factor: 0, .. }), "{rows}");
    assert_eq!(problem.linearize(), before);
}
