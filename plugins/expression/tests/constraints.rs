//! Fits subject to equality constraints: problems of Hock and Schittkowski, Test Examples for Nonlinear Programming
//! Codes, 1981.
use manifactor_expression::Expression;
use manifactor_geometry::Point1;
use manifactor_graph::{Graph, Interval, Noise, Values};
use manifactor_solve::{
    Auto, Dogleg, GaussNewton, Gnc, LevenbergMarquardt, LinearSolver, Method, Optimizer, Side, Silent,
    Solution, Stall, Termination, solve,
};
use nalgebra::Vector1;

fn solvers() -> Vec<Box<dyn Optimizer>> {
    let qr = LinearSolver { method: Method::Qr, ..LinearSolver::default() };
    vec![
        Box::new(Auto::default()),
        Box::new(Dogleg::default()),
        Box::new(LevenbergMarquardt::default()),
        Box::new(LevenbergMarquardt { linear: qr, ..LevenbergMarquardt::default() }),
    ]
}

/// A graph of variables x1, x2, … with one factor for each formula.
fn graph(residuals: &[&str], constraints: &[&str], start: &[f64]) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for (i, value) in start.iter().enumerate() {
        values.insert(format!("x{}", i + 1), Point1::new(Vector1::new(*value)));
    }
    for (i, formula) in residuals.iter().chain(constraints).enumerate() {
        let names: Vec<String> =
            (1..=start.len()).map(|k| format!("x{k}")).filter(|name| formula.contains(name)).collect();
        let variables: serde_json::Map<_, _> =
            names.iter().map(|name| (name.clone(), "point1".into())).collect();
        let document = serde_json::json!({ "variables": variables, "residual": [formula] });
        let factor: Expression = serde_json::from_value(document).unwrap();
        let entry = graph.add(names.iter().map(String::as_str), factor);
        if i >= residuals.len() {
            entry.constraint();
        }
    }
    (graph, values)
}

fn x(solution: &Solution, n: usize) -> Vec<f64> {
    (1..=n).map(|i| solution.values.get::<Point1>(&format!("x{i}")).unwrap().x).collect()
}

/// Solves with each solver, and compares the minimum and its value, Σ r². Returns the multipliers.
fn assert_minimum(
    residuals: &[&str],
    constraints: &[&str],
    start: &[f64],
    expected: &[f64],
    value: f64,
) -> Vec<f64> {
    let (graph, values) = graph(residuals, constraints, start);
    let mut multipliers = vec![];
    for solver in solvers() {
        let solution = solve(&graph, &values, &*solver, &mut Silent).unwrap();
        let outcome = &solution.outcome;
        assert!(outcome.termination.is_converged(), "{solver:?}: {}", outcome.termination);
        assert!(outcome.constraints.iter().flat_map(|c| &c.residual).all(|c| c.abs() <= 1e-9));
        assert!((2.0 * outcome.final_cost - value).abs() <= 1e-6 * (1.0 + value), "{}", outcome.final_cost);
        assert!((graph.cost(&solution.values).unwrap() - outcome.final_cost).abs() <= 1e-9 * (1.0 + value));
        for (found, expected) in x(&solution, start.len()).iter().zip(expected) {
            assert!((found - expected).abs() < 1e-4, "{solver:?}: {found}, not {expected}");
        }
        multipliers = outcome.constraints.iter().flat_map(|c| c.multipliers.clone()).collect();
    }
    multipliers
}

#[test]
fn problem_6() {
    assert_minimum(&["1 - x1"], &["10 * (x2 - x1^2)"], &[-1.2, 1.0], &[1.0, 1.0], 0.0);
}

#[test]
fn problem_27_is_no_regular_point() {
    // the derivative of its constraint by x3 vanishes at the minimum, so that JᵀJ has no curvature along x3
    let (graph, values) = graph(&["(x1 - 1) / 10", "x2 - x1^2"], &["x1 + x3^2 + 1"], &[2.0, 2.0, 2.0]);
    for solver in solvers() {
        let solution = solve(&graph, &values, &*solver, &mut Silent).unwrap();
        let is_there = x(&solution, 3).iter().zip([-1.0, 1.0, 0.0]).all(|(x, at)| (x - at).abs() < 1e-3);
        assert!(is_there || !solution.outcome.termination.is_converged(), "{solver:?}");
    }
}

#[test]
fn problem_28_has_a_linear_constraint() {
    let residuals = ["x1 + x2", "x2 + x3"];
    assert_minimum(&residuals, &["x1 + 2 * x2 + 3 * x3 - 1"], &[-4.0, 1.0, 1.0], &[0.5, -0.5, 0.5], 0.0);
}

#[test]
fn problem_42_has_its_multipliers() {
    let residuals = ["x1 - 1", "x2 - 2", "x3 - 3", "x4 - 4"];
    let constraints = ["x1 - 2", "x3^2 + x4^2 - 2"];
    let expected = [2.0, 2.0, 0.6 * 2f64.sqrt(), 0.8 * 2f64.sqrt()];
    let value = 28.0 - 10.0 * 2f64.sqrt();
    let multipliers = assert_minimum(&residuals, &constraints, &[1.0; 4], &expected, value);
    // ∇f + λᵀ∇c = 0 by hand: x1 - 1 + λ₁ = 0, x3 - 3 + 2 λ₂ x3 = 0
    let by_hand = [-1.0, (3.0 / expected[2] - 1.0) / 2.0];
    for (found, expected) in multipliers.iter().zip(by_hand) {
        assert!((found / expected - 1.0).abs() < 1e-6, "{found}, not {expected}");
    }
}

#[test]
fn problems_48_to_52() {
    let p48 = ["x1 - 1", "x2 - x3", "x4 - x5"];
    assert_minimum(
        &p48,
        &["x1 + x2 + x3 + x4 + x5 - 5", "x3 - 2 * (x4 + x5) + 3"],
        &[3.0, 5.0, -3.0, 2.0, -2.0],
        &[1.0; 5],
        0.0,
    );
    let p50 = ["x1 - x2", "x2 - x3", "(x3 - x4)^2", "x4 - x5"];
    assert_minimum(
        &p50,
        &["x1 + 2 * x2 + 3 * x3 - 6", "x2 + 2 * x3 + 3 * x4 - 6", "x3 + 2 * x4 + 3 * x5 - 6"],
        &[35.0, -31.0, 11.0, 5.0, -5.0],
        &[1.0; 5],
        0.0,
    );
    let constraints = ["x1 + 3 * x2", "x3 + x4 - 2 * x5", "x2 - x5"];
    let p51 = ["x1 - x2", "x2 + x3 - 2", "x4 - 1", "x5 - 1"];
    let linear = ["x1 + 3 * x2 - 4", "x3 + x4 - 2 * x5", "x2 - x5"];
    assert_minimum(&p51, &linear, &[2.5, 0.5, 2.0, -1.0, 0.5], &[1.0; 5], 0.0);
    let p52 = ["4 * x1 - x2", "x2 + x3 - 2", "x4 - 1", "x5 - 1"];
    let expected = [-33.0, 11.0, 180.0, -158.0, 11.0].map(|x| x / 349.0);
    assert_minimum(&p52, &constraints, &[2.0; 5], &expected, 1859.0 / 349.0);
}

#[test]
fn problem_60_has_bounds_as_well() {
    let residuals = ["x1 - 1", "x1 - x2", "(x2 - x3)^2"];
    let constraints = ["x1 * (1 + x2^2) + x3^4 - 4 - 3 * sqrt(2)"];
    let (mut graph, values) = graph(&residuals, &constraints, &[2.0; 3]);
    for i in 1..=3 {
        graph.bound(format!("x{i}"), "x", Interval::new(-10.0..=10.0).unwrap());
    }
    let mut values_at_bounds = vec![];
    for solver in solvers() {
        let solution = solve(&graph, &values, &*solver, &mut Silent).unwrap();
        assert!(solution.outcome.termination.is_converged(), "{solver:?}: {}", solution.outcome.termination);
        assert!((2.0 * solution.outcome.final_cost - 0.032_568_200_25).abs() < 1e-8);
        let mut tighter = graph.clone();
        tighter.bound("x3", "x", Interval::new(..=1.5).unwrap());
        let mut begin = values.clone();
        begin.insert("x3", Point1::new(Vector1::new(1.0)));
        let solution = solve(&tighter, &begin, &*solver, &mut Silent).unwrap();
        assert!(solution.outcome.termination.is_converged(), "{solver:?}: {}", solution.outcome.termination);
        let [bound] = &solution.outcome.active_bounds[..] else { panic!("{:?}", solution.outcome) };
        assert_eq!((bound.key.as_str(), bound.side, x(&solution, 3)[2]), ("x3", Side::Max, 1.5));
        values_at_bounds.push(x(&solution, 3));
    }
    for other in &values_at_bounds {
        assert!(other.iter().zip(&values_at_bounds[0]).all(|(a, b)| (a - b).abs() < 1e-6), "{other:?}");
    }
}

#[test]
fn problems_77_and_79_have_curved_constraints() {
    let p77 = ["x1 - 1", "x1 - x2", "x3 - 1", "(x4 - 1)^2", "(x5 - 1)^3"];
    let constraints = ["x1^2 * x4 + sin(x4 - x5) - 2 * sqrt(2)", "x2 + x3^4 * x4^2 - 8 - sqrt(2)"];
    let expected = [1.166172, 1.182111, 1.380257, 1.506036, 0.6109203];
    assert_minimum(&p77, &constraints, &[2.0; 5], &expected, 0.241_505_128_79);
    let p79 = ["x1 - 1", "x1 - x2", "x2 - x3", "(x3 - x4)^2", "(x4 - x5)^2"];
    let constraints =
        ["x1 + x2^2 + x3^3 - 2 - 3 * sqrt(2)", "x2 - x3^2 + x4 + 2 - 2 * sqrt(2)", "x1 * x5 - 2"];
    let expected = [1.191127, 1.362603, 1.472818, 1.635017, 1.679081];
    assert_minimum(&p79, &constraints, &[2.0; 5], &expected, 0.078_776_820_87);
}

#[test]
fn the_minimum_does_not_depend_on_units() {
    for scale in [1e-6, 1.0, 1e6] {
        let (mut graph, values) = graph(&["x1 - 3", "x2 - 4"], &["x1^2 + x2^2 - 1"], &[1.0, 2.0]);
        graph.factors_mut().iter_mut().take(2).for_each(|entry| entry.noise = Noise::sigma(scale).unwrap());
        let solution = solve(&graph, &values, &Auto::default(), &mut Silent).unwrap();
        assert!(solution.outcome.termination.is_converged(), "{}", solution.outcome.termination);
        let found = x(&solution, 2);
        assert!((found[0] - 0.6).abs() < 1e-7 && (found[1] - 0.8).abs() < 1e-7, "{scale}: {found:?}");
        let covariance = &solution.marginals(&graph, &[]).unwrap()[0].covariance;
        // variance along the circle, (-0.8, 0.6), with the curvature of JᵀJ: 0.64 σ²
        assert!((covariance[(0, 0)] / (0.64 * scale * scale) - 1.0).abs() < 1e-5, "{scale}: {covariance}");
        let mut changed = graph.clone();
        changed.fix("x2");
        changed.set_fixed("x2", manifactor_graph::Fixed::Whole(false));
        // the graph has another version, so that the problem is compiled again
        assert_eq!(&solution.marginals(&changed, &[]).unwrap()[0].covariance, covariance);
    }
}

#[test]
fn constraints_that_contradict_each_other_are_no_solution() {
    let (graph, values) = graph(&["x1 - 3"], &["x1 - 1", "x1 - 2"], &[0.0]);
    for solver in solvers() {
        let outcome = solve(&graph, &values, &*solver, &mut Silent).unwrap().outcome;
        assert_eq!(outcome.termination, Termination::Stalled { reason: Stall::Violation }, "{solver:?}");
    }
}

#[test]
fn a_descent_alone_does_not_take_a_violation_for_a_minimum() {
    let (graph, values) = graph(&["x1 - 3"], &["x1 - 1"], &[0.0]);
    let solution = GaussNewton::default().solve(&graph, &values, &mut Silent).unwrap();
    assert_eq!(solution.outcome.termination, Termination::Stalled { reason: Stall::Violation });
    let solution = solve(&graph, &values, &Gnc::default(), &mut Silent).unwrap();
    assert!(solution.outcome.termination.is_converged() && (x(&solution, 1)[0] - 1.0).abs() < 1e-9);
}
