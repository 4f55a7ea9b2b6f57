//! The default solver leaves a wrong minimum, and no other, independent of the unit of the noise.
use manifactor_geometry::{Between, Chordal, Se2, Se3};
use manifactor_graph::{Graph, Key, Noise, Values, register};
use manifactor_solve::{
    Auto, GaussNewton, LevenbergMarquardt, Optimizer, Outcome, Silent, Start, StartError, Stopping,
    Termination, solve,
};
use nalgebra::{Vector3, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::cell::{Cell, RefCell};
use std::f64::consts::TAU;
use std::ops::ControlFlow;

thread_local! {
    /// Number of calls to starts.
    static START_CALLS: Cell<usize> = const { Cell::new(0) };
    /// Values that the test's start returns. If set, it doubts every minimum.
    static RIVAL_VALUES: RefCell<Option<Values>> = const { RefCell::new(None) };
}

/// A start that does nothing unless a test sets its values.
///
/// ```toml
/// start = { type = "test_rival" }
/// ```
#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
struct Rival {}

#[typetag::serialize(name = "test_rival")]
impl Start for Rival {
    fn start(&self, _: &Graph, _: &Values) -> Result<Values, StartError> {
        START_CALLS.set(START_CALLS.get() + 1);
        let none = StartError::NotApplicable { start: "test_rival", needs: "a test" };
        RIVAL_VALUES.with_borrow(|rival| rival.clone().ok_or(none))
    }
    fn doubts(&self, _: &Graph, _: &Values) -> bool {
        RIVAL_VALUES.with_borrow(|rival| rival.is_some())
    }
}
register!(dyn Start, "test_rival", Rival);

/// Poses on a circle. The initial values go around `turns` times, which is a separate local minimum.
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
        // Unless the step at which it was stopped was the last one.
        assert!(outcome.termination == Termination::Interrupted || outcome.termination.is_converged());
        assert!(outcome.final_cost <= outcome.initial_cost);
    }
}

/// Poses along rings on a sphere, measured from the previous pose and the pose below, with errors of `error`
/// radians.
fn sphere(error: f64) -> (Graph, Values) {
    let (rings, each) = (8, 12);
    let turn = |by: Vector3<f64>| Se3::exp(&Vector6::new(by.x, by.y, by.z, 0.0, 0.0, 0.0));
    let place = |i: usize| {
        let (ring, along) = ((i / each + 1) as f64 / (rings + 1) as f64, i as f64 / each as f64);
        let out = Se3::exp(&Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 5.0));
        turn(Vector3::z() * (TAU * along)).compose(&turn(Vector3::y() * (0.5 * TAU * ring))).compose(&out)
    };
    let (mut graph, mut values, mut along) = (Graph::new(), Values::new(), place(0));
    values.insert("x0", along);
    for i in 1..rings * each {
        for (n, from) in [Some(i - 1), i.checked_sub(each)].into_iter().flatten().enumerate() {
            let angle = (7 * i + 3 * n) as f64;
            let off = turn(Vector3::new(angle.sin(), (2.0 * angle).cos(), (3.0 * angle).sin()) * error);
            let relative = place(from).between(&place(i)).compose(&off);
            if n == 0 {
                along = along.compose(&relative);
            }
            let noise = Noise::sigmas(&[0.05, 0.05, 0.05, 0.1, 0.1, 0.1]).unwrap();
            graph.add([Key::indexed("x", from), Key::indexed("x", i)], Between { relative }).noise(noise);
        }
        values.insert(Key::indexed("x", i), along);
    }
    graph.fix("x0");
    (graph, values)
}

/// Returns the graph with its information multiplied.
fn scaled(graph: &Graph, times: f64) -> Graph {
    let mut graph = graph.clone();
    for entry in graph.factors_mut() {
        entry.noise = entry.noise.weighted(times).unwrap();
    }
    graph
}

/// Solves and returns the outcome and the number of calls to starts.
fn ran(solver: &dyn Optimizer, graph: &Graph, values: &Values) -> (Outcome, usize) {
    START_CALLS.set(0);
    let outcome = solve(graph, values, solver, &mut Silent).unwrap().outcome;
    assert!(outcome.termination.is_converged(), "{}", outcome.termination);
    (outcome, START_CALLS.get())
}

#[test]
fn the_unit_of_the_noise_changes_nothing() {
    for (graph, values) in
        [ring(20, 2.0), ring(20, 0.0), ring(20, 1.0), sphere(0.02), sphere(0.2), sphere(0.5)]
    {
        let (one, asked) = ran(&Auto::default(), &graph, &values);
        for times in [0.01, 2.0, 4.0, 100.0, 1e6] {
            let (other, again) = ran(&Auto::default(), &scaled(&graph, times), &values);
            // Rounding decides whether a step of the size of rounding errors helps.
            let tried = |outcome: &Outcome| -> Vec<bool> {
                outcome.history.iter().filter(|h| h.step > 1e-6).map(|h| h.accepted).collect()
            };
            assert_eq!((again, tried(&other)), (asked, tried(&one)), "information times {times}");
            let cost = other.final_cost / times;
            assert!(
                (cost - one.final_cost).abs() <= 1e-6 * one.final_cost + 1e-9,
                "{cost}, {}",
                one.final_cost
            );
        }
    }
}

#[test]
fn a_minimum_of_noise_that_is_larger_than_stated_is_kept() {
    let (graph, values) = sphere(0.2);
    let graph = scaled(&graph, 100.0);
    let (plain, _) = ran(&GaussNewton::default(), &graph, &values);
    let (own, asked) = ran(&Auto::default(), &graph, &values);
    let freedom = 6.0 * (graph.factors().len() - values.len() + 1) as f64;
    assert!(2.0 * own.final_cost > 100.0 * freedom, "it does not fit the noise: {}", own.final_cost);
    assert_eq!((own.iterations, asked), (plain.iterations, 0), "and no other start is asked");
}

#[test]
fn from_a_start_that_leads_nowhere_it_goes_to_a_better_one_at_once() {
    let (graph, values) = sphere(0.9);
    let started = Chordal {}.start(&graph, &values).unwrap();
    let (best, _) = ran(&GaussNewton::default(), &graph, &started);
    let (own, asked) = ran(&Auto::default(), &graph, &values);
    assert!((own.final_cost - best.final_cost).abs() < 1e-6 * best.final_cost, "{}", own.final_cost);
    assert!(asked == 1 && own.iterations <= best.iterations + 3, "{} of {}", own.iterations, best.iterations);
}

#[test]
fn a_rival_is_dropped_once_it_has_cost_more_than_the_minimum() {
    let (graph, values) = sphere(0.02);
    let stop = Stopping { max_iterations: 100, ..Stopping::default() };
    let (plain, _) = ran(&GaussNewton { stop: stop.clone(), ..GaussNewton::default() }, &graph, &values);
    // A start from where the solver makes no progress for a long time.
    let mut rival = Values::new();
    for (i, (key, _)) in values.iter().enumerate() {
        let far = Vector6::from_fn(|r, _| 3.0 * ((i * (r + 2)) as f64).sin());
        rival.insert(key.clone(), Se3::exp(&far));
    }
    RIVAL_VALUES.set(Some(rival));
    let (own, asked) = ran(&Auto { stop, ..Auto::default() }, &graph, &values);
    RIVAL_VALUES.set(None);
    assert_eq!(asked, 1);
    assert!((own.final_cost - plain.final_cost).abs() < 1e-9 * plain.final_cost);
    assert!(own.iterations <= 2 * plain.iterations, "{} of {}", own.iterations, plain.iterations);
}
