//! Fits within bounds: problems of Hock and Schittkowski, Test Examples for Nonlinear Programming Codes, 1981.
use manifactor_expression::Expression;
use manifactor_geometry::Point1;
use manifactor_graph::{Graph, Interval, Values};
use manifactor_solve::{Auto, Dogleg, LevenbergMarquardt, Optimizer, Side, Silent, Solution, solve};
use nalgebra::Vector1;
use std::ops::RangeInclusive;

fn solvers() -> Vec<Box<dyn Optimizer>> {
    vec![Box::new(Auto::default()), Box::new(Dogleg::default()), Box::new(LevenbergMarquardt::default())]
}

/// Minimizes the squares of formulas of x1, x2, … (and i = 1, …, n if there are several) from `start` within `bounds`.
fn fit(
    residual: &[&str],
    n: usize,
    start: &[f64],
    bounds: &[RangeInclusive<f64>],
    solver: &dyn Optimizer,
) -> Solution {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let names: Vec<String> = (1..=start.len()).map(|i| format!("x{i}")).collect();
    for ((name, value), range) in names.iter().zip(start).zip(bounds) {
        values.insert(name.as_str(), Point1::new(Vector1::new(*value)));
        if let Ok(interval) = Interval::new(range.clone()) {
            graph.bound(name.as_str(), "x", interval);
        }
    }
    let variables: serde_json::Map<_, _> = names.iter().map(|name| (name.clone(), "point1".into())).collect();
    for i in 1..=n {
        let constants = if n > 1 { serde_json::json!({ "i": i as f64 }) } else { serde_json::json!({}) };
        let document =
            serde_json::json!({ "variables": variables, "residual": residual, "constants": constants });
        let factor: Expression = serde_json::from_value(document).unwrap();
        graph.add(names.iter().map(String::as_str), factor);
    }
    let solution = solve(&graph, &values, solver, &mut Silent).unwrap();
    assert!(solution.outcome.termination.is_converged(), "{solver:?}: {}", solution.outcome.termination);
    solution
}

fn assert_close(solution: &Solution, expected: &[f64]) {
    for (i, expected) in expected.iter().enumerate() {
        let found = solution.values.get::<Point1>(&format!("x{}", i + 1)).unwrap().x;
        assert!((found - expected).abs() < 1e-6, "x{}: {found}, not {expected}", i + 1);
    }
}

#[test]
fn problem_1_has_its_minimum_within_the_bounds() {
    for solver in solvers() {
        let bounds = [f64::NEG_INFINITY..=f64::INFINITY, -1.5..=f64::INFINITY];
        let solution = fit(&["10 * (x2 - x1^2)", "1 - x1"], 1, &[-2.0, 1.0], &bounds, &*solver);
        assert_close(&solution, &[1.0, 1.0]);
    }
}

#[test]
fn problem_25_keeps_its_power_defined() {
    // at x2 > 25.7 the logarithm is undefined
    let residual = ["exp(-exp(x3 * ln(25 + (-50 * ln(0.01 * i))^(2/3) - x2)) / x1) - 0.01 * i"];
    for solver in solvers() {
        let bounds = [0.1..=100.0, 0.0..=25.6, 0.0..=5.0];
        let solution = fit(&residual, 99, &[100.0, 12.5, 3.0], &bounds, &*solver);
        assert_close(&solution, &[50.0, 25.0, 1.5]);
    }
}

/// Wood's function, the objective of problem 38.
const WOOD: [&str; 6] = [
    "10 * (x2 - x1^2)",
    "1 - x1",
    "sqrt(90) * (x4 - x3^2)",
    "1 - x3",
    "sqrt(10) * (x2 + x4 - 2)",
    "(x2 - x4) / sqrt(10)",
];

#[test]
fn problem_38_has_its_minimum_within_the_bounds() {
    for solver in solvers() {
        let bounds = [-10.0..=10.0, -10.0..=10.0, -10.0..=10.0, -10.0..=10.0];
        let solution = fit(&WOOD, 1, &[-3.0, -1.0, -3.0, -1.0], &bounds, &*solver);
        assert_close(&solution, &[1.0, 1.0, 1.0, 1.0]);
    }
}

#[test]
fn woods_function_presses_against_a_tighter_bound() {
    // problem 38 with x1 at most 0.8
    let mut costs = vec![];
    for solver in solvers() {
        let bounds = [-10.0..=0.8, -10.0..=10.0, -10.0..=10.0, -10.0..=10.0];
        let solution = fit(&WOOD, 1, &[0.5, 0.5, 0.5, 0.5], &bounds, &*solver);
        let [bound] = &solution.outcome.active_bounds[..] else {
            panic!("{:?}", solution.outcome.active_bounds)
        };
        assert_eq!((bound.key.as_str(), bound.side, bound.value), ("x1", Side::Max, 0.8));
        let cost = |max: f64| {
            let bounds = [-10.0..=max, -10.0..=10.0, -10.0..=10.0, -10.0..=10.0];
            fit(&WOOD, 1, &[0.5, 0.5, 0.5, 0.5], &bounds, &*solver).outcome.final_cost
        };
        // the multiplier is the decrease of the cost by a bound that is relaxed
        let decrease = (cost(0.8 - 1e-4) - cost(0.8 + 1e-4)) / 2e-4;
        assert!((decrease / bound.multiplier - 1.0).abs() < 1e-5, "{decrease}, {}", bound.multiplier);
        costs.push(solution.outcome.final_cost);
    }
    assert!(costs.iter().all(|cost| (cost / costs[0] - 1.0).abs() < 1e-9), "{costs:?}");
}
