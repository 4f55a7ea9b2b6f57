//! A curve fit whose cost has a narrow valley, from a start far away.
use manifactor_geometry::Point3;
use manifactor_graph::{Graph, Lifted, Residual, Scalar, Values, register_factor};
use manifactor_solve::{LevenbergMarquardt, Silent, Solution, Stopping, solve};
use nalgebra::{U1, Vector1, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A peak: y = b₁/b₂ exp(-((x - b₃)/b₂)²/2), the model of Eckerle4 (NIST).
///
/// ```toml
/// [[factors]]
/// keys = ["b"]
/// factor = { type = "test_peak", x = 1.0, y = 2.0 }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
struct Peak {
    x: f64,
    y: f64,
}

impl Residual for Peak {
    type Variables = (Point3,);
    type Dim = U1;
    fn residual<T: Scalar>(&self, (b,): Lifted<Self::Variables, T>) -> Vector1<T> {
        let offset = (-b.z + self.x) / b.y;
        Vector1::new(b.x / b.y * (-offset * offset * 0.5).exp() - self.y)
    }
}
register_factor!("test_peak", Peak);

/// Returns the solution of Levenberg-Marquardt.
fn fitted(graph: &Graph, start: [f64; 3], max_iterations: usize) -> Solution {
    let mut values = Values::new();
    values.insert("b", Point3::new(start));
    let stop = Stopping { max_iterations, ..Stopping::default() };
    solve(graph, &values, &LevenbergMarquardt { stop, ..Default::default() }, &mut Silent).unwrap()
}

fn found(solution: &Solution) -> Vector3<f64> {
    solution.values.get::<Point3>("b").unwrap().0
}

#[test]
fn steps_along_a_valley_have_not_converged() {
    let truth = Vector3::new(1.55, 4.1, 451.5);
    let mut graph = Graph::new();
    for i in 0..35 {
        let x = 400.0 + 100.0 * f64::from(i) / 34.0;
        let y = Peak { x, y: 0.0 }.residual::<f64>((truth,)).x;
        graph.add(["b"], Peak { x, y });
    }
    for max_iterations in [50, 100, 200, 300, 500] {
        let solution = fitted(&graph, [1.0, 10.0, 500.0], max_iterations);
        let is_right = (found(&solution) - truth).norm() < 1e-4;
        let converged = solution.outcome.termination.is_converged();
        assert_eq!(converged, is_right, "{max_iterations}: {}", solution.outcome.termination);
    }
}
