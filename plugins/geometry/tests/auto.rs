//! The default solver leaves a minimum that does not fit the noise.
use manifactor_geometry::{Between, Se2};
use manifactor_graph::{Graph, Key, Noise, Values};
use manifactor_solve::{Auto, LevenbergMarquardt, Optimizer, Silent, Termination, solve};
use nalgebra::Vector3;
use std::f64::consts::TAU;
use std::ops::ControlFlow;

/// Poses on a circle, that begin where they go around `turns` times: a minimum of its own.
fn ring(n: usize, turns: f64) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let step = |turns: f64| Se2::exp(&Vector3::new(1.0, 0.0, TAU * turns / n as f64));
    let mut pose = Se2::identity();
    for i in 0..n {
        values.insert(Key::indexed("x", i), pose);
        pose = pose.compose(&step(turns));
        let keys = [Key::indexed("x", i), Key::indexed("x", (i + 1) % n)];
        graph.add(keys, Between { relative: step(1.0) }).noise(Noise::sigmas(&[0.1, 0.1, 0.01]).unwrap());
    }
    graph.fix("x0");
    (graph, values)
}

fn cost(solver: &dyn Optimizer, (graph, values): &(Graph, Values)) -> f64 {
    let solution = solve(graph, values, solver, &mut Silent).unwrap();
    assert!(solution.outcome.termination.is_converged(), "{}", solution.outcome.termination);
    let ended: f64 = solution.factors.iter().map(|f| f.cost).sum();
    assert!((ended - solution.outcome.final_cost).abs() <= 1e-9 * ended, "the values are those of the cost");
    solution.outcome.final_cost
}

#[test]
fn a_ring_that_is_wrapped_around_is_unwound() {
    for turns in [2.0, 0.0] {
        let ring = ring(20, turns);
        assert!(cost(&LevenbergMarquardt::default(), &ring) > 100.0, "it begins in another basin");
        assert!(cost(&Auto::default(), &ring) < 1e-9);
    }
}

#[test]
fn who_watches_may_stop_it_at_any_step() {
    let (graph, values) = ring(20, 2.0);
    for last in 1..=2 {
        let mut seen = 0;
        let mut observer = |_: &manifactor_solve::IterationRecord| {
            seen += 1;
            if seen == last { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let outcome = solve(&graph, &values, &Auto::default(), &mut observer).unwrap().outcome;
        assert!(seen == last && outcome.history.len() == last, "{seen} of {last}");
        // unless the step that it was stopped at was the last
        assert!(outcome.termination == Termination::Interrupted || outcome.termination.is_converged());
        assert!(outcome.final_cost <= outcome.initial_cost);
    }
}
