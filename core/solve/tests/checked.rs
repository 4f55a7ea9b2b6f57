//! Arguments from code are checked like a config, and long steps can be interrupted.
use crate::toy::*;
use manifactor_graph::checked::NotNegative;
use manifactor_graph::{
    Dimension, Graph, Jet, JetOf, Manifold, Scalar, ValueError, Values, register_manifold,
};
use manifactor_solve::{
    Auto, ConjugateGradients, Dogleg, GaussNewton, Gnc, IterationRecord, LevenbergMarquardt, LinearSolver,
    Method, Observer, Optimizer, Problem, Silent, Termination, WeightError, solve,
};
use nalgebra::{U1, Vector1};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::sync::Arc;

/// A number that is not a point in the plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
struct Other<T = f64>(T);

impl Manifold for Other {
    type Dim = U1;
    type Of<T: Scalar> = Other<T>;
    const TANGENT: &'static [&'static str] = &["x"];
    fn lift<T: Scalar>(&self) -> Other<T> {
        Other(T::from(self.0))
    }
    fn seed(&self) -> Other<JetOf<U1>> {
        Other(<U1 as Dimension>::Jet::with_gradient(self.0, &[1.0]))
    }
    fn retract(&self, delta: &Vector1<f64>) -> Self {
        Other(self.0 + delta.x)
    }
    fn local(&self, other: &Self) -> Vector1<f64> {
        Vector1::new(other.0 - self.0)
    }
    fn is_finite(&self) -> bool {
        self.0.is_finite()
    }
}
register_manifold!("test_other", Other);

/// Points in a row with a measurement of the first.
fn row(n: usize) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    graph.add(["p0"], At { at: [0.0, 0.0] });
    for i in 0..n {
        values.insert(format!("p{i}"), Plane { x: 0.3 * i as f64, y: (i as f64).sin() });
        if i > 0 {
            graph.add([format!("p{}", i - 1), format!("p{i}")], Apart { by: [1.0, 0.0] });
        }
    }
    (graph, values)
}

fn problem() -> Problem {
    let (graph, values) = row(3);
    Problem::compile(&graph, &values).unwrap()
}

#[test]
fn weights_are_checked() {
    let mut problem = problem();
    for wrong in [&[][..], &[1.0, 1.0], &[1.0; 4]] {
        let error = problem.set_weights(wrong).unwrap_err();
        assert_eq!(error, WeightError::Count { weights: wrong.len(), factors: 3 });
    }
    for wrong in [-1.0, f64::INFINITY, f64::NAN] {
        let error = problem.set_weights(&[1.0, wrong, 1.0]).unwrap_err();
        assert!(matches!(error, WeightError::Domain { factor: 1, .. }), "{error}");
    }
    assert_eq!(problem.weights(), &[] as &[f64], "what is refused changes nothing");
    problem.set_weights(&[1.0, 0.0, 2.5]).unwrap();
}

#[test]
fn values_are_checked() {
    let mut problem = problem();
    let before = format!("{:?}", problem.values());
    let mut refused = |key: &str, value: Box<dyn manifactor_graph::Variable>| {
        let mut values = Values::new();
        values.insert("p0", Plane { x: 7.0, y: 7.0 });
        values.insert_boxed(key.into(), value);
        let error = problem.set_values(&values).unwrap_err();
        assert_eq!(format!("{:?}", problem.values()), before, "what is refused changes nothing");
        error
    };
    let key = "stranger".into();
    assert_eq!(refused("stranger", Box::new(Plane { x: 0.0, y: 0.0 })), ValueError::Missing { key });
    let (key, expected, found) = ("p1".into(), "toy_plane", "test_other");
    assert_eq!(refused("p1", Box::new(Other(0.0))), ValueError::WrongType { key, expected, found });
    let key = "p1".into();
    assert_eq!(refused("p1", Box::new(Plane { x: f64::NAN, y: 0.0 })), ValueError::NotFinite { key });
    // values for some of the variables are enough
    let mut values = Values::new();
    values.insert("p2", Plane { x: 7.0, y: 7.0 });
    problem.set_values(&values).unwrap();
    assert_eq!(problem.values().get::<Plane>("p2").unwrap().x, 7.0);
}

#[test]
fn a_config_is_checked_when_it_is_read() {
    for (settings, expected) in [
        (r#""stop": {"relative_cost": -1e-9}"#, "expected a finite number, 0 or more, got -0.000000001"),
        (r#""linear": {"memory_gib": -1}"#, "expected a finite number, 0 or more, got -1"),
        (r#""max_lambda": 0"#, "expected a finite number above zero, got 0"),
        (r#""decrease": 0.5"#, "expected a finite number, 1 or more, got 0.5"),
        (r#""diagonal": [2, 1]"#, "expected two numbers, 0 ≤ least ≤ most, got [2, 1]"),
    ] {
        let text = format!(r#"{{"type": "levenberg_marquardt", {settings}}}"#);
        let error = serde_json::from_str::<Box<dyn Optimizer>>(&text).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

/// Requests the end at the third poll.
struct Third(usize);

impl Observer for Third {
    fn iteration(&mut self, _: &IterationRecord) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
    fn poll(&mut self) -> ControlFlow<()> {
        self.0 += 1;
        if self.0 < 3 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }
}

fn by(linear: &LinearSolver) -> [Box<dyn Optimizer>; 5] {
    let linear = || linear.clone();
    [
        Box::new(GaussNewton { linear: linear(), ..Default::default() }),
        Box::new(LevenbergMarquardt { linear: linear(), ..Default::default() }),
        Box::new(Dogleg { linear: linear(), ..Default::default() }),
        Box::new(Auto { linear: linear(), ..Default::default() }),
        Box::new(Gnc {
            solver: Arc::new(Auto { linear: linear(), ..Default::default() }),
            ..Default::default()
        }),
    ]
}

#[test]
fn a_step_by_conjugate_gradients_can_be_interrupted() {
    let (graph, values) = row(40);
    let conjugate_gradients = ConjugateGradients {
        tolerance: NotNegative::literal(0.0),
        max_iterations: usize::MAX,
        ..Default::default()
    };
    let linear =
        LinearSolver { method: Method::ConjugateGradients, conjugate_gradients, ..Default::default() };
    for solver in by(&linear) {
        let mut observer = Third(0);
        let solution = solve(&graph, &values, &*solver, &mut observer).unwrap();
        assert_eq!(solution.outcome.termination, Termination::Interrupted, "{solver:?}");
        assert_eq!((observer.0, solution.outcome.history.len()), (3, 0), "{solver:?}");
        assert_eq!(solution.outcome.final_cost, solution.outcome.initial_cost, "{solver:?}");
    }
}

#[test]
fn refinement_can_be_interrupted_and_ends_where_it_gains_nothing() {
    let (graph, values) = row(40);
    let linear = LinearSolver { refinements: usize::MAX, ..Default::default() };
    for solver in by(&linear) {
        let solution = solve(&graph, &values, &*solver, &mut Third(2)).unwrap();
        assert_eq!(solution.outcome.termination, Termination::Interrupted, "{solver:?}");
        let solution = solve(&graph, &values, &*solver, &mut Silent).unwrap();
        assert!(solution.outcome.termination.is_converged(), "{solver:?}: {}", solution.outcome.termination);
    }
}
