//! A custom solver: Levenberg-Marquardt, on the interface of the built-in ones.
use crate::solve_document;
use manifactor::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Steps damped along the diagonal of H: the damping is divided by ten after a good step, and multiplied by
/// ten after a bad one.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Marquardt {
    /// Damping of the first step, as a fraction of the diagonal.
    lambda: f64,
}

#[typetag::serialize(name = "test_marquardt")]
impl Optimizer for Marquardt {
    fn descend(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome {
        let stop = Stopping::default();
        let mut descent = match Descent::begin(problem, &stop, observer) {
            Ok(descent) => descent,
            Err(outcome) => return *outcome,
        };
        let (mut lambda, mut step) = (self.lambda, TrialStep::default());
        while lambda < 1e12 {
            if let Some(termination) = descent.next() {
                return descent.end(termination);
            }
            let damping: Vec<f64> = descent.diagonal().iter().map(|d| lambda * d.max(1e-6)).collect();
            step.control = lambda;
            let lower = descent.damped(&damping, &mut step)
                && matches!(descent.attempt(&step), TrialResult::Lower { gain } if gain > 1e-3);
            descent.record(&step, lower);
            lambda *= if lower { 0.1 } else { 10.0 };
            if let Some(termination) = if lower { descent.accept(&step) } else { None } {
                return descent.end(termination);
            }
        }
        let stalled = descent.stalled();
        descent.end(stalled)
    }
}
register!(dyn Optimizer, "test_marquardt", Marquardt);

/// A range to each of two beacons, with an initial value. It is nonlinear, so full steps overshoot.
const GRAPH: &str = r#"
variables = [
    { key = "x", value = { type = "point2", position = [0.2, 0.1] } },
    { key = "a", value = { type = "point2", position = [0.0, 0.0] }, fixed = true },
    { key = "b", value = { type = "point2", position = [4.0, 0.0] }, fixed = true },
]
factors = [
    { keys = ["a", "x"], factor = { type = "expression", variables = { a = "point2", x = "point2" }, residual = ["sqrt(dot(x - a, x - a)) - 5"] } },
    { keys = ["b", "x"], factor = { type = "expression", variables = { b = "point2", x = "point2" }, residual = ["sqrt(dot(x - b, x - b)) - 3"] } },
]
"#;

#[test]
fn a_graph_names_it() {
    let ours = solve_document(&format!("solver = {{ type = \"test_marquardt\", lambda = 1e-4 }}\n{GRAPH}"));
    assert!(ours.outcome.termination.is_converged(), "{}", ours.outcome.termination);
    assert!(ours.outcome.final_cost < 1e-15 && ours.outcome.undetermined.is_none());
    let theirs = solve_document(&format!("solver = {{ type = \"levenberg_marquardt\" }}\n{GRAPH}"));
    let distance = |solution: &Solution| {
        let x: &manifactor::geometry::Point2 = solution.values.get("x").unwrap();
        (x.0 - Vector2::new(4.0, 3.0)).norm()
    };
    assert!(distance(&ours) < 1e-6 && distance(&theirs) < 1e-6);
}

#[test]
fn what_nothing_constrains_is_named() {
    let open = GRAPH.lines().filter(|line| !line.contains("\"b\", \"x\"")).collect::<Vec<_>>().join("\n");
    let ours = solve_document(&format!("solver = {{ type = \"test_marquardt\", lambda = 1e-4 }}\n{open}"));
    assert!(ours.outcome.termination.is_converged());
    assert_eq!(ours.outcome.undetermined.unwrap().keys, [Key::from("x")]);
}
