//! A solver: one that is made of two others.
use crate::solve_document;
use manifactor::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Levenberg-Marquardt as long as it takes to get near, then Gauss-Newton.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Relay {
    /// Steps of the first.
    first: usize,
}

#[typetag::serialize(name = "test_relay")]
impl Optimizer for Relay {
    fn solve(&self, problem: &mut Problem, observer: &mut dyn Observer) -> Outcome {
        let stop = Stopping { max_iterations: self.first, ..Stopping::default() };
        let begun = LevenbergMarquardt { stop, ..LevenbergMarquardt::default() }.solve(problem, observer);
        let ended = GaussNewton::default().solve(problem, observer);
        Outcome { initial_cost: begun.initial_cost, iterations: begun.iterations + ended.iterations, ..ended }
    }
}
register!(dyn Optimizer, "test_relay", Relay);

#[test]
fn a_graph_names_it() {
    let solution = solve_document(
        r#"
solver = { type = "test_relay", first = 2 }
variables = [{ key = "x", value = { type = "se2", translation = [1.0, 2.0], angle = 0.5 } }]
factors = [{ keys = ["x"], factor = { type = "prior_se2", value = { translation = [0.0, 0.0], angle = 0.0 } } }]
"#,
    );
    assert!(solution.outcome.termination.is_converged());
    assert!(solution.outcome.final_cost < 1e-20 && solution.outcome.initial_cost > 1.0);
}
