//! Bounds: the minimum within them, their multipliers, and what they do not allow.
use crate::toy::*;
use manifactor_graph::{Graph, Interval, Noise, ValueError, Values};
use manifactor_solve::{
    ActiveBound, Auto, CompileError, Dogleg, GaussNewton, LevenbergMarquardt, LinearSolver, Method,
    Optimizer, Problem, Side, Silent, Solution, Start, StartError, solve,
};
use proptest::prelude::*;

fn solvers(method: Method) -> Vec<Box<dyn Optimizer>> {
    let linear = LinearSolver { method, ..LinearSolver::default() };
    vec![
        Box::new(GaussNewton { linear: linear.clone(), ..GaussNewton::default() }),
        Box::new(LevenbergMarquardt { linear: linear.clone(), ..LevenbergMarquardt::default() }),
        Box::new(Dogleg { linear: linear.clone(), ..Dogleg::default() }),
        Box::new(Auto { linear, ..Auto::default() }),
    ]
}

fn interval(min: f64, max: f64) -> Interval {
    Interval::new(min..=max).unwrap()
}

/// Checks the conditions of Karush, Kuhn and Tucker: the gradient of the cost is zero within the bounds, and presses
/// against those that the outcome names, with the multiplier as its size.
fn assert_minimum(graph: &Graph, solution: &Solution, tolerance: f64) {
    let outcome = &solution.outcome;
    assert!(outcome.termination.is_converged(), "{}", outcome.termination);
    let mut unbounded = Graph::new();
    unbounded.factors_mut().extend(graph.factors().iter().cloned());
    let mut problem = Problem::compile(&unbounded, &solution.values).unwrap();
    problem.linearize();
    for (key, value) in solution.values.all::<Plane>() {
        for (i, (direction, x)) in [("x", value.x), ("y", value.y)].into_iter().enumerate() {
            let gradient = problem.normal_equations().3[problem.unknowns(key.as_str()).unwrap().start + i];
            let is_named = |bound: &&ActiveBound| bound.key == *key && bound.direction == direction;
            let expected = match outcome.active_bounds.iter().find(is_named) {
                None => 0.0,
                Some(bound) => {
                    assert_eq!(x, bound.value, "{key}.{direction}");
                    if bound.side == Side::Min { bound.multiplier } else { -bound.multiplier }
                }
            };
            assert!(
                (gradient - expected).abs() <= tolerance,
                "{key}.{direction} = {x}: {gradient}, {expected}"
            );
            let bounds = graph.bounds().get(key).and_then(|b| b.iter().find(|(name, _)| *name == direction));
            assert!(bounds.is_none_or(|(_, interval)| interval.contains(x)), "{key}.{direction} = {x}");
        }
    }
}

#[test]
fn the_valley_ends_at_its_bound() {
    // problem 2 of Hock and Schittkowski, Test Examples for Nonlinear Programming Codes, 1981
    let a = (598f64 / 1200.0).sqrt();
    let expected = 2.0 * a * ((1.0 / (400.0 * a.powi(3))).acos() / 3.0).cos();
    let (mut graph, mut values) = (Graph::new(), Values::new());
    graph.add(["p"], Valley {});
    graph.bound("p", "y", Interval::new(1.5..).unwrap());
    values.insert("p", Plane { x: 2.0, y: 3.0 });
    for solver in solvers(Method::Auto) {
        let solution = solve(&graph, &values, &*solver, &mut Silent).unwrap();
        assert_minimum(&graph, &solution, 1e-6);
        let p = solution.values.get::<Plane>("p").unwrap();
        assert!((p.x - expected).abs() < 1e-9 && p.y == 1.5, "{solver:?}: {p:?}");
        // its cost is 2 ½ Σ r²
        assert!((2.0 * solution.outcome.final_cost - 0.050_426_187_9).abs() < 1e-9, "{solver:?}");
        let bound = &solution.outcome.active_bounds[0];
        assert_eq!(
            format!("{bound}"),
            format!("p.y is at its minimum, 1.5 (multiplier {:.3e})", bound.multiplier)
        );
    }
}

#[test]
fn a_bound_that_the_minimum_does_not_touch_changes_nothing() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    graph.add(["p"], Valley {});
    graph.bound("p", "y", Interval::new(-1.5..).unwrap());
    values.insert("p", Plane { x: -2.0, y: 1.0 });
    for solver in solvers(Method::Auto) {
        let solution = solve(&graph, &values, &*solver, &mut Silent).unwrap();
        let p = solution.values.get::<Plane>("p").unwrap();
        assert!((p.x - 1.0).abs() < 1e-6 && (p.y - 1.0).abs() < 1e-6, "{solver:?}: {p:?}");
        assert!(solution.outcome.active_bounds.is_empty());
    }
}

#[test]
fn steps_do_not_leave_the_domain_that_the_bounds_give() {
    // ln x is undefined below 0, where full steps from 10 would lead
    let (mut graph, mut values) = (Graph::new(), Values::new());
    graph.add(["p"], Logarithm { to: 0.5 });
    graph.add(["p"], At { at: [-3.0, 0.0] }).noise(Noise::sigma(10.0).unwrap());
    graph.bound("p", "x", Interval::new(0.75..).unwrap());
    values.insert("p", Plane { x: 10.0, y: 1.0 });
    for solver in solvers(Method::Auto) {
        let solution = solve(&graph, &values, &*solver, &mut Silent).unwrap();
        assert_minimum(&graph, &solution, 1e-6);
        assert_eq!(solution.values.get::<Plane>("p").unwrap().x, 0.75, "{solver:?}");
        assert!(solution.outcome.history.iter().all(|record| record.trial_cost.is_some()), "{solver:?}");
    }
}

#[test]
fn a_maximum_between_bounds_is_left() {
    // the distance from the origin is 1 at best: its cost has a maximum at the origin along x
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("o", Plane { x: 0.0, y: 0.0 });
    values.insert("p", Plane { x: 1e-7, y: 0.0 });
    graph.fix("o");
    graph.add(["o", "p"], Distance { by: 1.0 });
    graph.bound("p", "x", interval(-0.25, 0.5));
    graph.bound("p", "y", interval(-0.1, 0.1));
    for solver in solvers(Method::Auto) {
        let solution = solve(&graph, &values, &*solver, &mut Silent).unwrap();
        let p = solution.values.get::<Plane>("p").unwrap();
        assert!(solution.outcome.termination.is_converged(), "{solver:?}: {}", solution.outcome.termination);
        assert!(p.x == 0.5 && p.y.abs() <= 0.1, "{solver:?}: {p:?}");
    }
}

#[test]
fn a_coordinate_at_its_bound_is_certain() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for key in ["p", "q"] {
        values.insert(key, Plane { x: 1.0, y: 1.0 });
        graph.add([key], At { at: [-1.0, 3.0] });
    }
    graph.add(["p", "q"], Apart { by: [0.0, 0.0] });
    graph.bound("p", "x", Interval::new(0.0..).unwrap());
    let solution = solve(&graph, &values, &Auto::default(), &mut Silent).unwrap();
    let marginals = solution.marginals(&graph, &[]).unwrap();
    let [p, q] = [&marginals[0].covariance, &marginals[1].covariance];
    assert_eq!((p[(0, 0)], p[(0, 1)]), (0.0, 0.0));
    // as if p.x were fixed: q.x has a prior and a measurement of unit noise
    assert!((q[(0, 0)] - 0.5).abs() < 1e-12 && (p[(1, 1)] - 2.0 / 3.0).abs() < 1e-12);
    let leverages = solution.leverages(&graph).unwrap();
    let total: f64 = leverages.iter().flatten().sum();
    assert!((total - 3.0).abs() < 1e-9, "{total} of three unknowns");
}

#[test]
fn bounds_that_do_not_fit_are_errors() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: 1.0, y: 1.0 });
    graph.add(["p"], At { at: [0.0, 0.0] });
    let errors = |graph: &Graph| match Problem::compile(graph, &values).unwrap_err() {
        CompileError::Graph(errors) => errors.iter().map(ToString::to_string).collect::<Vec<_>>(),
        error => panic!("{error}"),
    };
    let mut wrong = graph.clone();
    wrong.bound("p", "z", interval(0.0, 1.0));
    wrong.bound("p", "y", interval(2.0, 3.0));
    wrong.bound("q", "x", interval(0.0, 1.0));
    assert_eq!(
        errors(&wrong),
        [
            "`p` has no direction `z`; its directions are x, y",
            "`p`: y = 1 is out of its bounds: from 2 to 3; begin within them",
            "`q` is to have bounds, but there is no such variable",
        ]
    );
    let mut never = graph.clone();
    never.bound("p", "x", Interval::new(2.0..).unwrap());
    never.bound("p", "x", Interval::new(..=1.0).unwrap());
    let text = "`p`: the bounds of x exclude each other: 2 or more, and 1 or less; change one of them";
    assert_eq!(errors(&never), [text]);
    graph.bound("p", "x", Interval::new(..=2.0).unwrap());
    let mut problem = Problem::compile(&graph, &values).unwrap();
    let mut outside = Values::new();
    outside.insert("p", Plane { x: 3.0, y: 1.0 });
    let error = problem.set_values(&outside).unwrap_err();
    assert_eq!(error.to_string(), "`p`: x = 3 is out of its bounds: 2 or less; begin within them");
    assert_eq!(problem.values().get::<Plane>("p").unwrap().x, 1.0);
    let given: &dyn Start = &manifactor_solve::GivenStart::default();
    assert_eq!(given.initial_values(&graph, &outside).unwrap_err(), StartError::Value(error.clone()));
    assert!(matches!(error, ValueError::OutOfBounds(_)));
    assert_eq!(graph.within_bounds(outside).get::<Plane>("p").unwrap().x, 2.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// A chain of points with priors, at random places within random bounds: a convex problem, whose minimum is where
    /// the conditions hold.
    #[test]
    fn chains_within_random_bounds_reach_the_minimum(
        places in proptest::collection::vec((-3.0..3.0, -3.0..3.0), 8),
        limits in proptest::collection::vec((-2.0..0.5, 0.0..2.0, -2.0..0.5, 0.0..2.0, 0u8..4), 8),
        sigma in 0.05..5.0,
    ) {
        let (mut graph, mut values) = (Graph::new(), Values::new());
        for (i, ((x, y), (x0, dx, y0, dy, which))) in places.iter().zip(&limits).enumerate() {
            let key = format!("p{i}");
            graph.add([key.as_str()], At { at: [*x, *y] });
            if i > 0 {
                graph.add([format!("p{}", i - 1), key.clone()], Apart { by: [0.3, 0.1] }).noise(Noise::sigma(sigma).unwrap());
            }
            if which & 1 > 0 {
                graph.bound(key.as_str(), "x", interval(*x0, x0 + dx));
            }
            if which & 2 > 0 {
                graph.bound(key.as_str(), "y", interval(*y0, y0 + dy));
            }
            values.insert(key, Plane { x: x0 + 0.5 * dx, y: y0 + dy });
        }
        let mut costs = vec![];
        for method in [Method::Auto, Method::Cholesky, Method::Qr, Method::ConjugateGradients] {
            for solver in solvers(method) {
                let solution = solve(&graph, &values, &*solver, &mut Silent).unwrap();
                assert_minimum(&graph, &solution, 1e-5);
                costs.push(solution.outcome.final_cost);
            }
        }
        let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
        prop_assert!(costs.iter().all(|cost| *cost <= least * (1.0 + 1e-7)), "{costs:?}");
    }
}
