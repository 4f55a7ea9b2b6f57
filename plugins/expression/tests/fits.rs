//! Curve fits with certified results: the Statistical Reference Datasets of NIST (public domain).
use manifactor_expression::Expression;
use manifactor_geometry::Point1;
use manifactor_graph::{Graph, Values};
use manifactor_solve::{
    Auto, GaussNewton, LevenbergMarquardt, Optimizer, Silent, Solution, Stall, Termination, solve,
};
use nalgebra::Vector1;

/// Fits `residual`, a formula of b1, b2, …, x and y, from `start`.
fn fit(residual: &str, points: &[[f64; 2]], start: &[f64], solver: &dyn Optimizer) -> Solution {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let names: Vec<String> = (1..=start.len()).map(|i| format!("b{i}")).collect();
    for (name, value) in names.iter().zip(start) {
        values.insert(name.as_str(), Point1::new(Vector1::new(*value)));
    }
    let variables: serde_json::Map<_, _> = names.iter().map(|name| (name.clone(), "point1".into())).collect();
    for [x, y] in points {
        let document = serde_json::json!({
            "variables": variables, "residual": [residual], "constants": { "x": x, "y": y },
        });
        let factor: Expression = serde_json::from_value(document).unwrap();
        graph.add(names.iter().map(String::as_str), factor);
    }
    solve(&graph, &values, solver, &mut Silent).unwrap()
}

fn assert_certified(solution: &Solution, certified: &[f64]) {
    assert!(solution.outcome.termination.is_converged(), "{}", solution.outcome.termination);
    for (i, expected) in certified.iter().enumerate() {
        let found = solution.values.get::<Point1>(&format!("b{}", i + 1)).unwrap().x;
        assert!((found / expected - 1.0).abs() < 1e-6, "b{}: {found}, not {expected}", i + 1);
    }
}

/// Misra1a: the monomolecular adsorption of a dental material.
const MISRA1A: [[f64; 2]; 14] = [
    [77.6, 10.07],
    [114.9, 14.73],
    [141.1, 17.94],
    [190.8, 23.93],
    [239.9, 29.61],
    [289.0, 35.18],
    [332.8, 40.02],
    [378.4, 44.82],
    [434.8, 50.76],
    [477.3, 55.05],
    [536.8, 61.01],
    [593.1, 66.40],
    [689.1, 75.47],
    [760.0, 81.78],
];

#[test]
fn misra1a_has_its_certified_parameters() {
    for start in [[500.0, 0.0001], [250.0, 0.0005]] {
        let solution = fit("b1 * (1 - exp(-b2 * x)) - y", &MISRA1A, &start, &Auto::default());
        assert_certified(&solution, &[2.3894212918e2, 5.5015643181e-4]);
    }
}

/// MGH09 (Kowalik and Osborne), on which every solver converges slowly.
const MGH09: [[f64; 2]; 11] = [
    [4.0, 0.1957],
    [2.0, 0.1947],
    [1.0, 0.1735],
    [0.5, 0.16],
    [0.25, 0.0844],
    [0.167, 0.0627],
    [0.125, 0.0456],
    [0.1, 0.0342],
    [0.0833, 0.0323],
    [0.0714, 0.0235],
    [0.0625, 0.0246],
];

#[test]
fn a_fit_that_converges_slowly_does_not_stop_early() {
    let model = "b1 * (x^2 + x * b2) / (x^2 + x * b3 + b4) - y";
    for solver in [&Auto::default() as &dyn Optimizer, &LevenbergMarquardt::default()] {
        let solution = fit(model, &MGH09, &[0.25, 0.39, 0.415, 0.39], solver);
        assert_certified(&solution, &[1.9280693458e-1, 1.9128232873e-1, 1.2305650693e-1, 1.3606233068e-1]);
    }
}

/// The cost falls for ever as b1 grows, to a limit without a minimum.
#[test]
fn a_fit_without_a_minimum_has_run_off() {
    for solver in
        [&Auto::default() as &dyn Optimizer, &GaussNewton::default(), &LevenbergMarquardt::default()]
    {
        let solution = fit("exp(-b1 * x) - y", &[[1.0, -1.0], [2.0, -1.0], [3.0, -1.0]], &[1.0], solver);
        let found = &solution.outcome.termination;
        assert_eq!(*found, Termination::Stalled { reason: Stall::RunOff }, "{found}");
    }
}

/// The slope along b1 vanishes once its inequality holds, which is a minimum. The cost of b2 stays.
#[test]
fn an_inequality_that_comes_to_hold_is_converged() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let factor = |name: &str, residual: &str| Expression::new([(name, "point1")], [residual]).unwrap();
    graph.add(["b1"], factor("b1", "where(1 - b1, 1 - b1, 0)"));
    graph.add(["b2"], factor("b2", "b2 - 1"));
    graph.add(["b2"], factor("b2", "b2 - 2"));
    for name in ["b1", "b2"] {
        values.insert(name, Point1::new(Vector1::new(0.0)));
    }
    for solver in
        [&Auto::default() as &dyn Optimizer, &LevenbergMarquardt::default(), &GaussNewton::default()]
    {
        let solution = solve(&graph, &values, solver, &mut Silent).unwrap();
        let found = &solution.outcome.termination;
        assert!(found.is_converged(), "{found}");
        assert!(solution.values.get::<Point1>("b1").unwrap().x >= 1.0 - 1e-9);
    }
}
