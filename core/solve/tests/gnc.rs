//! Graduated non-convexity on problems that are simple enough to solve by hand.
use crate::toy::{Apart, At, Plane};
use manifactor_graph::{Graph, Noise, Values};
use manifactor_solve::{CompileError, Gnc, Optimizer, Problem, Silent, Solution, solve};

fn gnc(settings: &str) -> Box<dyn Optimizer> {
    serde_json::from_str(&format!(r#"{{"type": "gnc" {settings}}}"#)).unwrap()
}

fn run((graph, values): &(Graph, Values), settings: &str) -> Solution {
    let solution = solve(graph, values, &*gnc(settings), &mut Silent).unwrap();
    assert!(solution.outcome.termination.is_converged(), "{}", solution.outcome.termination);
    solution
}

fn rejected(solution: &Solution) -> Vec<usize> {
    solution.outcome.rejected.iter().map(|r| r.factor).collect()
}

/// One point, measured at the origin by `right` factors and at (8, 1) by `wrong` ones.
fn votes(right: usize, wrong: usize) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: 8.0, y: 2.0 });
    for i in 0..right + wrong {
        let off = 0.01 * (i as f64).sin();
        let at = if i < right { [off, -off] } else { [8.0 + off, 1.0] };
        graph.add(["p"], At { at }).noise(Noise::sigma(0.1).unwrap());
    }
    (graph, values)
}

/// Points on a line with odometry, and loop closures between distant points, `wrong` of them off by metres.
fn ladder(n: usize, wrong: usize) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let noise = || Noise::sigma(0.1).unwrap();
    for i in 0..n {
        values.insert(format!("p{i}"), Plane { x: i as f64, y: 0.3 });
        if i > 0 {
            graph.add([format!("p{}", i - 1), format!("p{i}")], Apart { by: [1.0, 0.0] }).noise(noise());
        }
    }
    for i in 3..n {
        let off = if i < 3 + wrong { 4.0 + i as f64 } else { 0.0 };
        graph.add([format!("p{}", i - 3), format!("p{i}")], Apart { by: [3.0, off] }).noise(noise());
    }
    graph.fix("p0");
    (graph, values)
}

#[test]
fn the_majority_decides() {
    for cost in ["truncated_least_squares", "geman_mcclure"] {
        let solution = run(&votes(6, 4), &format!(r#", "candidates": "all", "cost": "{cost}""#));
        assert_eq!(rejected(&solution), [6, 7, 8, 9], "{cost}");
        let p = solution.values.get::<Plane>("p").unwrap();
        assert!(p.x.abs() < 0.05 && p.y.abs() < 0.05, "{cost}: {p:?}");
    }
}

#[test]
fn factors_of_one_variable_and_odometry_are_trusted() {
    assert!(rejected(&run(&votes(6, 4), "")).is_empty());
    let solution = run(&ladder(12, 3), "");
    assert_eq!(rejected(&solution), [11, 12, 13]);
    let first = &solution.outcome.rejected[0];
    assert_eq!((&*first.name, first.keys[0].as_str(), first.keys[1].as_str()), ("toy_apart", "p0", "p3"));
    assert!(first.weight == 0.0 && first.cost > 100.0 && solution.outcome.final_cost < 1e-12);
}

#[test]
fn a_type_that_is_not_named_and_a_factor_that_is_trusted_stay() {
    let graph = ladder(12, 1);
    assert_eq!(rejected(&run(&graph, r#", "types": ["toy_apart"]"#)), [11]);
    assert!(rejected(&run(&graph, r#", "types": ["toy_at"]"#)).is_empty());
    assert!(!rejected(&run(&graph, r#", "inliers": [11]"#)).contains(&11));
    let error = solve(&graph.0, &graph.1, &*gnc(r#", "inliers": [20]"#), &mut Silent).unwrap_err();
    assert_eq!(error, CompileError::NoFactor { factor: 20, factors: 20 });
}

#[test]
fn the_threshold_is_in_standard_deviations() {
    // the mean is 0.2, so the last measurement is 0.6 off: six times its σ of 0.1
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: 0.1, y: 0.0 });
    for x in [0.0, 0.0, 0.0, 0.8] {
        graph.add(["p"], At { at: [x, 0.0] }).noise(Noise::sigma(0.1).unwrap());
    }
    let graph = (graph, values);
    for (threshold, expected) in [(7.0, vec![]), (5.0, vec![3])] {
        let solution = run(&graph, &format!(r#", "candidates": "all", "threshold": {threshold}"#));
        assert_eq!(rejected(&solution), expected, "{threshold}");
    }
}

#[test]
fn a_weight_counts_like_so_many_factors() {
    let (graph, values) = votes(3, 1);
    let mut twice = graph.clone();
    twice.push(graph.factors()[3].clone());
    let mut weighed = Problem::compile(&graph, &values).unwrap();
    weighed.set_weights(&[1.0, 1.0, 1.0, 2.0]).unwrap();
    let mut doubled = Problem::compile(&twice, &values).unwrap();
    let (a, b) = (weighed.linearize(), doubled.linearize());
    assert!((a.cost - b.cost).abs() < 1e-9 * b.cost && (weighed.cost().cost - b.cost).abs() < 1e-9 * b.cost);
    for (a, b) in weighed.normal_equations().3.iter().zip(doubled.normal_equations().3) {
        assert!((a - b).abs() < 1e-9 * b.abs());
    }
    let (a, b) = (weighed.marginals().unwrap(), doubled.marginals().unwrap());
    assert!((&a[0].1 - &b[0].1).norm() < 1e-12);
    // a zero weight equals removing the factor
    weighed.set_weights(&[1.0, 1.0, 1.0, 0.0]).unwrap();
    let mut without = graph.clone();
    without.factors_mut().pop();
    let mut without = Problem::compile(&without, &values).unwrap();
    assert_eq!(weighed.linearize().cost, without.linearize().cost);
}

#[test]
fn it_solves_a_compiled_problem_as_well() {
    let (graph, values) = ladder(12, 3);
    let mut problem = Problem::compile(&graph, &values).unwrap();
    let outcome = Gnc::default().descend(&mut problem, &mut Silent);
    assert_eq!(outcome.rejected.len(), 3);
    assert_eq!(problem.weights().iter().filter(|w| **w == 0.0).count(), 3);
}

#[test]
fn a_wrong_closure_between_neighbours_is_rejected_and_no_right_one() {
    for is_first in [false, true] {
        let (right, values) = ladder(12, 0);
        let mut graph = Graph::new();
        let mut wrong = right.factors().len();
        let push_wrong = |graph: &mut Graph| {
            graph.add(["p6", "p5"], Apart { by: [-9.0, 2.0] }).noise(Noise::sigma(0.1).unwrap());
        };
        if is_first {
            wrong = 0;
            push_wrong(&mut graph);
        }
        for entry in right.factors() {
            graph.push(entry.clone());
        }
        if !is_first {
            push_wrong(&mut graph);
        }
        graph.fix("p0");
        assert_eq!(rejected(&run(&(graph, values), "")), [wrong], "the first line: {is_first}");
    }
}
