//! Every solver on problems whose answer is known.
use crate::toy::*;
use manifactor_graph::loss::{Cauchy, GemanMcClure};
use manifactor_graph::{Graph, Noise, Values};
use manifactor_solve::{
    Auto, Dogleg, GaussNewton, LevenbergMarquardt, Optimizer, Problem, Silent, Solution, Termination, solve,
};
use std::ops::ControlFlow;

fn solvers() -> Vec<Box<dyn Optimizer>> {
    vec![
        Box::new(GaussNewton::default()),
        Box::new(LevenbergMarquardt::default()),
        Box::new(Dogleg::default()),
        Box::new(Auto::default()),
    ]
}

fn run(graph: &Graph, values: &Values, solver: &dyn Optimizer) -> Solution {
    solve(graph, values, solver, &mut Silent).unwrap()
}

fn point(solution: &Solution, key: &str) -> [f64; 2] {
    let p = solution.values.get::<Plane>(key).unwrap();
    [p.x, p.y]
}

fn close(a: [f64; 2], b: [f64; 2]) {
    assert!((a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6, "{a:?} is not {b:?}");
}

/// Points 0 to n-1 on a line, one apart, the first at the origin.
fn chain(n: usize) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for i in 0..n {
        values.insert(format!("p{i}"), Plane { x: 0.3 * i as f64, y: (i as f64).sin() });
    }
    for i in 1..n {
        graph.add([format!("p{}", i - 1), format!("p{i}")], Apart { by: [1.0, 0.0] });
    }
    (graph, values)
}

#[test]
fn the_valley_is_followed_to_its_end() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: -1.2, y: 1.0 });
    graph.add(["p"], Valley {});
    for solver in solvers() {
        let solution = run(&graph, &values, &*solver);
        assert!(solution.outcome.termination.is_converged(), "{solver:?}: {:?}", solution.outcome);
        close(point(&solution, "p"), [1.0, 1.0]);
    }
}

#[test]
fn converged_is_the_estimate_and_not_a_later_one() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: -1.8, y: 0.0 });
    graph.add(["p"], TwoMinima {});
    for solver in solvers() {
        let solution = run(&graph, &values, &*solver);
        let converged = solution.outcome.termination.is_converged();
        assert_eq!(converged, (point(&solution, "p")[0] + 1.177_02).abs() < 1e-4, "{solver:?} {solution:?}");
        assert_eq!(converged, solver.typetag_name() != "gauss_newton", "{solver:?}");
        assert!(solution.outcome.final_cost <= solution.outcome.initial_cost);
    }
}

#[test]
fn a_held_variable_stays_and_the_rest_follows() {
    let (mut graph, values) = chain(6);
    graph.fix("p5");
    for solver in solvers() {
        let solution = run(&graph, &values, &*solver);
        let held = *values.get::<Plane>("p5").unwrap();
        close(point(&solution, "p5"), [held.x, held.y]);
        close(point(&solution, "p0"), [held.x - 5.0, held.y]);
    }
}

#[test]
fn a_held_direction_stays_and_the_other_moves() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: 5.0, y: 5.0 });
    graph.add(["p"], At { at: [1.0, 2.0] });
    graph.fix_directions("p", &["y"]);
    for solver in solvers() {
        close(point(&run(&graph, &values, &*solver), "p"), [1.0, 5.0]);
    }
}

#[test]
fn rows_that_were_not_observed_do_not_pull() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: 5.0, y: 5.0 });
    graph.add(["p"], At { at: [1.0, 2.0] });
    graph.add(["p"], At { at: [f64::MAX, 4.0] }).noise(Noise::unit().observing(&[false, true]));
    close(point(&run(&graph, &values, &GaussNewton::default()), "p"), [1.0, 3.0]);
}

#[test]
fn a_factor_may_have_any_number_of_variables() {
    for n in [1, 3, 12] {
        let (mut graph, mut values) = chain(n);
        values.insert("other", Plane { x: 0.0, y: 7.0 });
        graph.add(["other"], At { at: [0.0, 0.0] });
        graph.add((0..n).map(|i| format!("p{i}")), Centre { at: [10.0, 1.0] });
        for solver in solvers() {
            let solution = run(&graph, &values, &*solver);
            close(point(&solution, "p0"), [10.0 - (n as f64 - 1.0) / 2.0, 1.0]);
        }
    }
}

#[test]
fn a_robust_loss_ignores_what_lies_far_off() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: 0.4, y: 0.1 });
    for at in [[0.0, 0.0], [0.1, 0.0], [-0.1, 0.0]] {
        graph.add(["p"], At { at }).noise(Noise::sigma(0.1).unwrap());
    }
    graph
        .add(["p"], At { at: [100.0, 50.0] })
        .noise(Noise::sigma(0.1).unwrap())
        .loss(GemanMcClure::default());
    graph.add(["p"], At { at: [-90.0, 50.0] }).noise(Noise::sigma(0.1).unwrap()).loss(Cauchy::default());
    for solver in solvers() {
        let [x, y] = point(&run(&graph, &values, &*solver), "p");
        assert!(x.abs() < 1e-3 && y.abs() < 1e-3, "{x} {y}");
    }
}

#[test]
fn nothing_that_holds_a_chain_is_named() {
    let (graph, values) = chain(20);
    for solver in solvers() {
        let outcome = run(&graph, &values, &*solver).outcome;
        assert!(outcome.termination.is_converged(), "{solver:?}: {}", outcome.termination);
        let open = outcome.undetermined.unwrap();
        assert_eq!(open.moving, 20, "{solver:?}: {open}");
    }
}

#[test]
fn a_free_direction_is_named_with_its_variable() {
    let (mut graph, mut values) = chain(5);
    graph.add(["p0"], At { at: [0.0, 0.0] });
    values.insert("loose", Plane { x: 1.0, y: 1.0 });
    graph.add(["loose"], At { at: [1.0, 0.0] }).noise(Noise::unit().observing(&[true, false]));
    for solver in solvers() {
        let open = run(&graph, &values, &*solver).outcome.undetermined.unwrap();
        assert_eq!((open.moving, open.keys[0].as_str()), (1, "loose"));
        assert!(open.direction.len() == 1 && open.direction[0].1 == "y", "{open}");
        assert_eq!(
            open.to_string(),
            "nothing constrains loose.y by 1.00; add a prior or another measurement, or fix one of them"
        );
    }
}

#[test]
fn a_step_out_of_a_domain_is_not_taken() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    // a full step from 10 leads to 10 - 10 ln 1000 < 0
    values.insert("p", Plane { x: 10.0, y: 0.0 });
    graph.add(["p"], Logarithm { to: 0.01 });
    graph.add(["p"], At { at: [0.0, 0.0] }).noise(Noise::sigmas(&[1e6, 1.0]).unwrap());
    for solver in solvers() {
        let solution = run(&graph, &values, &*solver);
        assert!(solution.outcome.termination.is_converged(), "{solver:?} {:?}", solution.outcome);
        close(point(&solution, "p"), [0.01, 0.0]);
    }
}

#[test]
fn a_factor_outside_its_domain_is_counted_and_left_out() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: -1.0, y: 0.0 });
    graph.add(["p"], Logarithm { to: 3.0 });
    graph.add(["p"], At { at: [-2.0, 0.0] });
    for solver in solvers() {
        let solution = run(&graph, &values, &*solver);
        assert_eq!((solution.outcome.inactive, solution.outcome.factors), (1, 2));
        assert!(!solution.factors[0].defined && solution.factors[1].defined);
        close(point(&solution, "p"), [-2.0, 0.0]);
    }
}

#[test]
fn a_factor_that_comes_into_its_domain_takes_part() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: -1.0, y: 0.0 });
    graph.add(["p"], Logarithm { to: 3.0 }).noise(Noise::sigma(1e-4).unwrap());
    graph.add(["p"], At { at: [2.0, 0.0] });
    for solver in solvers() {
        let solution = run(&graph, &values, &*solver);
        assert_eq!(solution.outcome.inactive, 0);
        let [x, _] = point(&solution, "p");
        assert!((x - 3.0).abs() < 1e-4, "{solver:?} {x} {:?}", solution.outcome.termination);
    }
}

#[test]
fn a_residual_that_is_not_finite_is_named() {
    let (mut graph, mut values) = chain(3);
    values.insert("bad", Plane { x: -1.0, y: 0.0 });
    graph.add(["bad"], Careless {});
    for solver in solvers() {
        let outcome = run(&graph, &values, &*solver).outcome;
        let Termination::NonFinite { factor, keys } = outcome.termination else { panic!("it is not finite") };
        assert_eq!((factor, keys[0].as_str()), (2, "bad"));
    }
}

#[test]
fn an_interrupt_keeps_the_best_so_far() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: -1.2, y: 1.0 });
    graph.add(["p"], Valley {});
    let mut seen = 0;
    let mut observer = |_: &manifactor_solve::IterationRecord| {
        seen += 1;
        if seen < 12 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    };
    let solution = solve(&graph, &values, &LevenbergMarquardt::default(), &mut observer).unwrap();
    assert_eq!(solution.outcome.termination, Termination::Interrupted);
    assert_eq!(solution.outcome.history.len(), 12);
    assert!(solution.outcome.final_cost < solution.outcome.initial_cost);
}

#[test]
fn everything_wrong_with_a_graph_is_told_at_once() {
    let (mut graph, values) = chain(2);
    graph.add(["p0", "p7"], Apart { by: [0.0, 0.0] });
    graph.add(["p0", "p0"], Apart { by: [0.0, 0.0] });
    graph.add(["p0", "p1"], At { at: [0.0, 0.0] });
    graph.add(["p0"], At { at: [0.0, 0.0] }).noise(Noise::sigmas(&[1.0, 1.0, 1.0]).unwrap());
    graph.fix_directions("p1", &["z"]);
    let error = Problem::compile(&graph, &values).unwrap_err().to_string();
    for part in [
        "factor 1 (toy_apart): there is no variable `p7`",
        "factor 2 (toy_apart) names the variable `p0` twice",
        "factor 3 (toy_at) connects 1 variables, got 2 keys",
        "factor 4 (toy_at): the noise has 3 rows, the residual 2",
        "`p1` has no direction `z`; its directions are x, y",
    ] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn threads_change_no_bit() {
    let (mut graph, values) = chain(400);
    graph.add(["p0"], At { at: [0.0, 0.0] });
    for i in 0..390 {
        let (a, b) = (format!("p{i}"), format!("p{}", i + 3 + i % 7));
        graph.add([a, b], Distance { by: 2.5 }).loss(Cauchy::default());
    }
    let bits = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let solution = pool.install(|| run(&graph, &values, &LevenbergMarquardt::default()));
        let points = solution.values.all::<Plane>().map(|(_, p)| (p.x.to_bits(), p.y.to_bits()));
        (solution.outcome.final_cost.to_bits(), solution.outcome.iterations, points.collect::<Vec<_>>())
    };
    let one = bits(1);
    assert_eq!(one, bits(2));
    assert_eq!(one, bits(5));
}

#[test]
fn the_gradient_is_that_of_the_cost() {
    let (mut graph, values) = chain(8);
    for i in 0..5 {
        let keys = [format!("p{i}"), format!("p{}", i + 3)];
        graph.add(keys, Distance { by: 2.5 }).loss(Cauchy::default()).noise(Noise::sigma(0.3).unwrap());
    }
    let mut problem = Problem::compile(&graph, &values).unwrap();
    problem.linearize();
    for i in 0..8 {
        let key = format!("p{i}");
        let range = problem.unknowns(&key).unwrap();
        let gradient = problem.normal_equations().3[range].to_vec();
        for d in 0..2 {
            let mut cost = |h: f64| {
                let mut moved = values.clone();
                let p = *values.get::<Plane>(&key).unwrap();
                let step = if d == 0 { [h, 0.0] } else { [0.0, h] };
                moved.insert(key.as_str(), Plane { x: p.x + step[0], y: p.y + step[1] });
                problem.set_values(&moved).unwrap();
                problem.cost().cost
            };
            let numeric = (cost(1e-6) - cost(-1e-6)) / 2e-6;
            problem.set_values(&values).unwrap();
            assert!(
                (numeric - gradient[d]).abs() < 1e-6 * (1.0 + numeric.abs()),
                "{numeric} {}",
                gradient[d]
            );
        }
    }
}

#[test]
fn the_diagnosis_names_the_worst_factors_and_the_condition() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: 0.0, y: 0.0 });
    values.insert("q", Plane { x: 0.0, y: 0.0 });
    for i in 0..14 {
        graph.add(["p"], At { at: [i as f64, 0.0] });
    }
    graph.add(["p", "q"], Apart { by: [0.0, 0.0] }).noise(Noise::sigma(10.0).unwrap());
    graph.add(["q"], At { at: [6.5, 0.0] }).loss(GemanMcClure::default());
    let diagnosis = run(&graph, &values, &GaussNewton::default()).diagnose(&graph).unwrap();
    let worst: Vec<usize> = diagnosis.worst.iter().map(|f| f.factor).collect();
    assert_eq!(worst.len(), 10);
    assert!(worst[..4].iter().all(|f| [0, 1, 12, 13].contains(f)), "{worst:?}");
    let first = &diagnosis.worst[0];
    assert_eq!((&*first.name, first.keys[0].as_str(), first.weight), ("toy_at", "p", 1.0));
    assert!((first.cost - 0.5 * 6.5 * 6.5).abs() < 1e-6 && (first.residual[0].abs() - 6.5).abs() < 1e-6);
    // two blocks that are almost uncoupled: [1, c; c, 1] with c = 0.01/√(14.01·1.01) has eigenvalues 1 ± c
    let c = 0.01 / (14.01_f64 * 1.01).sqrt();
    let condition = diagnosis.condition.unwrap();
    assert!(condition >= 1.0 - 1e-9 && condition <= (1.0 + c) / (1.0 - c) + 1e-9, "{condition}");
}

#[test]
fn the_condition_is_that_of_the_scaled_matrix() {
    // two points with k times more information between them than to the ground: eigenvalues 1 and 1 + 2k
    for k in [10.0, 1e6] {
        let (mut graph, mut values) = (Graph::new(), Values::new());
        for key in ["p", "q"] {
            values.insert(key, Plane { x: 0.0, y: 1.0 });
            graph.add([key], At { at: [0.0, 0.0] });
        }
        graph.add(["p", "q"], Apart { by: [0.0, 0.0] }).noise(Noise::sigma((1.0_f64 / k).sqrt()).unwrap());
        let condition = Problem::compile(&graph, &values).unwrap().condition().unwrap();
        assert!((condition / (1.0 + 2.0 * k) - 1.0).abs() < 0.05, "{condition}");
    }
    let (graph, values) = chain(5);
    assert_eq!(Problem::compile(&graph, &values).unwrap().condition(), None);
}

#[test]
fn a_factor_on_a_thousand_variables_is_compiled() {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let keys: Vec<String> = (0..1000).map(|i| format!("p{i}")).collect();
    for (i, key) in keys.iter().enumerate() {
        values.insert(key.as_str(), Plane { x: i as f64, y: 0.0 });
        graph.add([key.as_str()], At { at: [0.0, 0.0] });
    }
    graph.add(keys.iter().map(String::as_str), Centre { at: [0.0, 1.0] });
    let mut problem = Problem::compile(&graph, &values).unwrap();
    let (entries, unknowns) = (problem.normal_equations().1.len(), problem.dim());
    assert_eq!((entries, unknowns), (unknowns * (unknowns + 1) / 2, 2000), "all are coupled");
    let sum: f64 = (0..1000).map(|i| f64::from(i).powi(2)).sum();
    assert!((problem.linearize().cost - 0.5 * (sum + 499.5_f64.powi(2) + 1.0)).abs() < 1e-3);
}

#[test]
fn the_cost_of_a_graph_is_that_of_a_solve() {
    let (mut graph, mut values) = chain(5);
    graph
        .add(["p1", "p3"], Apart { by: [0.0, 5.0] })
        .noise(Noise::sigma(0.1).unwrap())
        .loss(Cauchy::default());
    for solver in solvers() {
        let solution = run(&graph, &values, &*solver);
        let (before, after) = (graph.cost(&values).unwrap(), graph.cost(&solution.values).unwrap());
        assert!((before / solution.outcome.initial_cost - 1.0).abs() < 1e-12, "{before}");
        assert!((after / solution.outcome.final_cost - 1.0).abs() < 1e-9, "{after}");
    }
    // no variable has to be free, and a factor that is not defined does not count
    let before = graph.cost(&values).unwrap();
    (0..5).for_each(|i| graph.fix(format!("p{i}")));
    graph.add(["p2"], Cliff {});
    assert!(graph.cost(&values).unwrap() > before);
    // its residual is NaN
    values.insert("p2", Plane { x: -1.0, y: 0.0 });
    assert!(graph.cost(&values).unwrap().is_nan());
    values.remove("p2");
    let wrong = graph.cost(&values).unwrap_err();
    assert!(wrong.iter().all(|error| error.to_string().contains("`p2`")), "{wrong:?}");
}
