//! Terminations of all solvers: they report values that are not finite, inactive factors and undetermined
//! directions.
use crate::toy::*;
use manifactor_graph::{Graph, Noise, Values};
use manifactor_solve::{Optimizer, Outcome, Silent, Solution, Stall, Termination, solve};

const SOLVERS: [&str; 5] = ["gauss_newton", "levenberg_marquardt", "dogleg", "auto", "gnc"];
const METHODS: [&str; 5] = ["auto", "cholesky", "dense", "qr", "conjugate_gradients"];

fn solver(name: &str, method: &str) -> Box<dyn Optimizer> {
    let linear = format!(r#""linear": {{"method": "{method}"}}"#);
    let settings = match name {
        "gnc" => format!(r#""solver": {{"type": "auto", {linear}}}"#),
        _ => linear,
    };
    serde_json::from_str(&format!(r#"{{"type": "{name}", {settings}}}"#)).unwrap()
}

/// Solutions of every solver.
fn solutions(graph: &Graph, values: &Values) -> Vec<(&'static str, Solution)> {
    let one = |name| (name, solve(graph, values, &*solver(name, "auto"), &mut Silent).unwrap());
    SOLVERS.into_iter().map(one).collect()
}

/// Points without a factor.
fn points(at: &[(&str, [f64; 2])]) -> (Graph, Values) {
    let mut values = Values::new();
    at.iter().for_each(|(key, [x, y])| drop(values.insert(*key, Plane { x: *x, y: *y })));
    (Graph::new(), values)
}

/// The factor that an outcome reports as not finite, and its first key.
fn blamed(outcome: &Outcome) -> (usize, &str) {
    let Termination::NonFinite { factor, keys } = &outcome.termination else { panic!("{outcome:?}") };
    (*factor, keys[0].as_str())
}

#[test]
fn a_gradient_that_is_nan_is_not_converged() {
    let (mut graph, values) = points(&[("good", [1.0, 2.0]), ("bad", [0.0, 0.0])]);
    graph.add(["good"], At { at: [0.0, 0.0] });
    graph.add(["bad"], At { at: [0.0, 0.0] });
    graph.add(["bad"], Root { less: 1.0 });
    for name in SOLVERS {
        for method in METHODS {
            let solution = solve(&graph, &values, &*solver(name, method), &mut Silent).unwrap();
            assert_eq!(blamed(&solution.outcome), (2, "bad"), "{name} {method}");
        }
    }
}

#[test]
fn a_step_to_where_there_is_no_derivative_is_not_converged() {
    let (mut graph, values) = points(&[("a", [0.0, 0.0]), ("b", [1.0, 0.0])]);
    graph.fix("a");
    graph.add(["b"], At { at: [0.0, 0.0] }).noise(Noise::unit().observing(&[false, true]));
    graph.add(["a", "b"], Distance { by: 0.0 });
    let solution = solve(&graph, &values, &*solver("gauss_newton", "auto"), &mut Silent).unwrap();
    assert_eq!((solution.outcome.iterations, blamed(&solution.outcome)), (1, (1, "a")));
}

#[test]
fn a_matrix_that_overflows_is_not_converged() {
    let (mut graph, values) = points(&[("p", [1.0, 0.0]), ("q", [2.0, 3.0])]);
    graph.add(["p"], At { at: [0.0, 0.0] });
    // its residual is zero, its derivative 1e160
    graph.add(["q"], At { at: [2.0, 3.0] }).noise(Noise::sigma(1e-160).unwrap());
    for (name, solution) in solutions(&graph, &values) {
        assert_eq!(blamed(&solution.outcome), (1, "q"), "{name}");
    }
}

#[test]
fn the_factor_with_the_cost_that_overflows_is_named() {
    let (mut graph, values) = points(&[("p", [1.0, 0.0]), ("q", [1e200, 3.0])]);
    graph.add(["p"], At { at: [0.0, 0.0] });
    graph.add(["q"], At { at: [0.0, 0.0] });
    for (name, solution) in solutions(&graph, &values) {
        assert_eq!(blamed(&solution.outcome), (1, "q"), "{name}");
    }
}

#[test]
fn steps_to_where_nothing_is_finite_are_not_taken_and_their_factor_is_named() {
    let (mut graph, values) = points(&[("p", [1.0, 0.0])]);
    graph.add(["p"], At { at: [0.0, 3.0] });
    graph.add(["p"], Cliff {});
    for (name, solution) in solutions(&graph, &values) {
        let Outcome { final_cost, initial_cost, .. } = solution.outcome;
        assert_eq!(blamed(&solution.outcome), (1, "p"), "{name}");
        assert!(final_cost < initial_cost, "{name}");
    }
}

#[test]
fn a_graph_without_factors_is_not_converged() {
    let (graph, values) = points(&[("p", [1.0, 0.0]), ("q", [1.0, 0.0])]);
    for (name, Solution { outcome, .. }) in solutions(&graph, &values) {
        assert!(matches!(outcome.termination, Termination::Indeterminate(_)), "{name} {outcome:?}");
        let text = "indeterminate: no factor that takes part touches p, q (the graph has no factors); add factors, \
                    or fix or remove what nothing touches";
        assert_eq!(outcome.termination.to_string(), text);
    }
}

#[test]
fn what_is_defined_nowhere_is_not_converged() {
    let (mut graph, values) = points(&[("p", [-1.0, 0.0])]);
    graph.add(["p"], Logarithm { to: 1.0 });
    graph.add(["p"], Logarithm { to: 2.0 });
    for (name, Solution { outcome, .. }) in solutions(&graph, &values) {
        let unconstrained = outcome.unconstrained.as_ref().unwrap();
        assert_eq!((unconstrained.active, unconstrained.factors, outcome.inactive), (0, 2, 2), "{name}");
        assert!(outcome.termination.to_string().contains("(2 of 2 take no part at these values)"), "{name}");
    }
}

#[test]
fn a_variable_without_a_factor_that_takes_part_is_named() {
    let (mut graph, values) = points(&[("p", [4.0, 0.0]), ("loose", [1.0, 0.0]), ("behind", [-1.0, 0.0])]);
    graph.add(["p"], At { at: [2.0, 3.0] });
    graph.add(["behind"], Logarithm { to: 1.0 });
    for (name, Solution { outcome, values, .. }) in solutions(&graph, &values) {
        let Termination::Indeterminate(unconstrained) = &outcome.termination else {
            panic!("{name}: {outcome:?}")
        };
        assert_eq!(unconstrained.keys, ["loose".into(), "behind".into()], "{name}");
        let inactive = &outcome.inactive_factors;
        assert_eq!(
            (inactive[0].factor, &*inactive[0].name, inactive.len()),
            (1, "toy_logarithm", 1),
            "{name}"
        );
        // the rest is solved, and variables without an active factor stay unchanged
        let at = |key| values.get::<Plane>(key).unwrap();
        assert!((at("p").x - 2.0).abs() + (at("p").y - 3.0).abs() < 1e-6, "{name}");
        assert_eq!((at("loose").x, at("behind").x), (1.0, -1.0), "{name}");
    }
}

#[test]
fn a_variable_that_is_held_needs_no_factor() {
    let (mut graph, values) = points(&[("p", [4.0, 0.0]), ("held", [1.0, 0.0])]);
    graph.add(["p"], At { at: [2.0, 3.0] });
    graph.fix("held");
    for (name, Solution { outcome, .. }) in solutions(&graph, &values) {
        assert!(outcome.termination.is_converged() && outcome.unconstrained.is_none(), "{name} {outcome:?}");
    }
}

#[test]
fn a_factor_of_weight_zero_takes_no_part() {
    let (mut graph, values) = points(&[("p", [4.0, 0.0]), ("q", [1.0, 0.0])]);
    graph.add(["p"], At { at: [2.0, 3.0] });
    graph.add(["q"], At { at: [2.0, 3.0] });
    let mut problem = manifactor_solve::Problem::compile(&graph, &values).unwrap();
    problem.set_weights(&[1.0, 0.0]).unwrap();
    let outcome = solver("levenberg_marquardt", "auto").descend(&mut problem, &mut Silent);
    let Termination::Indeterminate(unconstrained) = outcome.termination else { panic!("{outcome:?}") };
    assert_eq!((unconstrained.keys, unconstrained.active), (vec!["q".into()], 1));
}

#[test]
fn all_solvers_agree_where_nothing_holds_a_part() {
    // two points of known distance and direction but undetermined position, and a known point
    let (mut graph, values) = points(&[("a", [0.0, 0.0]), ("b", [5.0, 5.0]), ("c", [5.0, 5.0])]);
    graph.add(["a", "b"], Apart { by: [1.0, 0.0] });
    graph.add(["c"], At { at: [2.0, 3.0] });
    for name in SOLVERS {
        for method in &METHODS[..4] {
            let solution = solve(&graph, &values, &*solver(name, method), &mut Silent).unwrap();
            let outcome = &solution.outcome;
            assert!(outcome.termination.is_converged(), "{name} {method}: {}", outcome.termination);
            assert!(outcome.final_cost < 1e-12, "{name} {method}: {}", outcome.final_cost);
            let open =
                outcome.undetermined.as_ref().unwrap_or_else(|| panic!("{name} {method}: {outcome:?}"));
            assert_eq!(open.moving, 2, "{name} {method}: {open}");
            // the undetermined points have not drifted away
            let a = solution.values.get::<Plane>("a").unwrap();
            assert!((a.x - 2.0).abs() + (a.y - 2.5).abs() < 1e-3, "{name} {method}: {a:?}");
        }
    }
}

#[test]
fn a_jacobian_of_the_wrong_sign_stalls() {
    let (mut graph, values) = points(&[("p", [0.0, 0.0])]);
    graph.add(["p"], WrongSign { at: 3.0 });
    for (name, Solution { outcome, .. }) in solutions(&graph, &values) {
        let Termination::Stalled { reason } = outcome.termination else { panic!("{name}: {outcome:?}") };
        assert_ne!(reason, Stall::Domain, "{name}");
        assert_eq!((outcome.initial_cost, outcome.final_cost), (4.5, 4.5), "{name}");
    }
}
