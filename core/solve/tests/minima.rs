//! A solve ends at a minimum of the cost, not at a maximum or a saddle, for any unit of the noise.
use crate::toy::*;
use manifactor_graph::loss::Tukey;
use manifactor_graph::{Graph, Lifted, Noise, Residual, Scalar, Values, register_factor};
use manifactor_solve::{Optimizer, Silent, Solution, Termination, solve};
use nalgebra::{U1, U2, Vector1, Vector2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

const SOLVERS: [&str; 4] = ["gauss_newton", "levenberg_marquardt", "dogleg", "auto"];

fn solver(name: &str) -> Box<dyn Optimizer> {
    serde_json::from_str(&format!(r#"{{"type": "{name}"}}"#)).unwrap()
}

/// Solutions of every solver.
fn solutions(graph: &Graph, values: &Values) -> Vec<(&'static str, Solution)> {
    SOLVERS
        .into_iter()
        .map(|name| (name, solve(graph, values, &*solver(name), &mut Silent).unwrap()))
        .collect()
}

fn point(x: f64, y: f64) -> (Graph, Values) {
    let mut values = Values::new();
    values.insert("p", Plane { x, y });
    (Graph::new(), values)
}

/// r = x² - square: its derivative vanishes at 0, which is a maximum of the cost.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
struct SquareOf {
    square: f64,
}
impl Residual for SquareOf {
    type Variables = (Plane,);
    type Dim = U1;
    fn residual<T: Scalar>(&self, (p,): Lifted<Self::Variables, T>) -> Vector1<T> {
        Vector1::new(p.x * p.x - self.square)
    }
}
register_factor!("toy_square_of", SquareOf);

/// Freudenstein and Roth's function (Moré, Garbow, Hillstrom, 1981, number 2).
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
struct FreudensteinRoth {}
impl Residual for FreudensteinRoth {
    type Variables = (Plane,);
    type Dim = U2;
    fn residual<T: Scalar>(&self, (p,): Lifted<Self::Variables, T>) -> Vector2<T> {
        let (x, y) = (p.x, p.y);
        Vector2::new(x + ((T::from(5.0) - y) * y - 2.0) * y - 13.0, x + ((y + 1.0) * y - 14.0) * y - 29.0)
    }
}
register_factor!("toy_freudenstein_roth", FreudensteinRoth);

/// Two anchors at (±1, 0), and a point at distance 2 from both. On the line between them the cost has a
/// saddle.
fn between_two_anchors(x: f64, sigma: f64) -> (Graph, Values) {
    let (mut graph, mut values) = point(x, 0.0);
    for (key, x) in [("a", -1.0), ("b", 1.0)] {
        values.insert(key, Plane { x, y: 0.0 });
        graph.fix(key);
        graph.add([key, "p"], Distance { by: 2.0 }).noise(Noise::sigma(sigma).unwrap());
    }
    (graph, values)
}

#[test]
fn a_saddle_between_two_distances_is_left() {
    for (x, sigma) in [(0.0, 1.0), (0.3, 0.01), (-0.2, 1e6)] {
        let (graph, values) = between_two_anchors(x, sigma);
        for (name, Solution { outcome, values, .. }) in solutions(&graph, &values) {
            let p = values.get::<Plane>("p").unwrap();
            assert!(outcome.termination.is_converged(), "{name}: {}", outcome.termination);
            assert!((p.y.abs() - 3.0_f64.sqrt()).abs() < 1e-4 && p.x.abs() < 1e-4, "{name} from {x}: {p:?}");
        }
    }
}

#[test]
fn a_maximum_without_a_slope_is_left() {
    let (mut graph, values) = point(0.0, 1.0);
    graph.add(["p"], SquareOf { square: 4.0 });
    graph.add(["p"], At { at: [0.0, 0.0] }).noise(Noise::sigmas(&[1e3, 1.0]).unwrap());
    for (name, Solution { outcome, values, .. }) in solutions(&graph, &values) {
        let p = values.get::<Plane>("p").unwrap();
        assert!(outcome.termination.is_converged() && (p.x.abs() - 2.0).abs() < 1e-3, "{name}: {p:?}");
    }
}

#[test]
fn a_minimum_without_a_slope_stays() {
    let (mut graph, values) = point(0.0, 0.0);
    graph.add(["p"], SquareOf { square: -4.0 });
    graph.add(["p"], At { at: [0.0, 0.0] });
    for (name, Solution { outcome, values, .. }) in solutions(&graph, &values) {
        assert!(outcome.termination.is_converged(), "{name}: {}", outcome.termination);
        assert_eq!(*values.get::<Plane>("p").unwrap(), Plane { x: 0.0, y: 0.0 }, "{name}");
    }
}

#[test]
fn a_loss_that_gives_no_factor_a_weight_is_not_converged() {
    let (mut graph, values) = point(100.0, 100.0);
    for at in [[0.0, 0.0], [0.1, 0.0]] {
        graph.add(["p"], At { at }).loss(Tukey::default());
    }
    for (name, Solution { outcome, .. }) in solutions(&graph, &values) {
        assert!(
            matches!(outcome.termination, Termination::Indeterminate(_)),
            "{name}: {}",
            outcome.termination
        );
        assert!(outcome.termination.to_string().contains("2 of 2 take no part"), "{}", outcome.termination);
    }
}

#[test]
fn the_unit_of_the_noise_does_not_move_the_estimate() {
    let mut expected = None;
    for sigma in [1.0, 1e-8, 1e-3, 1e4, 1e8] {
        let (mut graph, values) = point(-1.2, 1.0);
        graph.add(["p"], Valley {}).noise(Noise::sigma(sigma).unwrap());
        graph.add(["p"], At { at: [3.0, 3.0] }).noise(Noise::sigma(3.0 * sigma).unwrap());
        for (name, Solution { outcome, values, .. }) in solutions(&graph, &values) {
            let p = values.get::<Plane>("p").unwrap();
            assert!(outcome.termination.is_converged(), "{name} {sigma}: {}", outcome.termination);
            let Plane { x, y } = *expected.get_or_insert(*p);
            assert!(
                (p.x - x).abs() < 1e-3 && (p.y - y).abs() < 1e-3,
                "{name} {sigma}: {p:?}, with 1 ({x}, {y})"
            );
        }
    }
}

#[test]
fn a_local_minimum_to_rounding_is_converged() {
    let (mut graph, values) = point(0.5, -2.0);
    graph.add(["p"], FreudensteinRoth {});
    for name in ["levenberg_marquardt", "dogleg", "auto"] {
        for relative_cost in [1e-8, 0.0] {
            let stop = format!(
                r#"{{"type": "{name}", "stop": {{"relative_cost": {relative_cost}, "max_iterations": 1000}}}}"#
            );
            let optimizer: Box<dyn Optimizer> = serde_json::from_str(&stop).unwrap();
            let Solution { outcome, .. } = solve(&graph, &values, &*optimizer, &mut Silent).unwrap();
            // half of the published 48.98425 or the global minimum, 0
            let is_minimum = (outcome.final_cost - 24.492_126_8).abs() < 1e-5 || outcome.final_cost < 1e-12;
            assert!(
                outcome.termination.is_converged() && is_minimum,
                "{name}: {} {}",
                outcome.termination,
                outcome.final_cost
            );
        }
    }
}

#[test]
fn a_point_that_starts_very_far_off_is_found() {
    // from further away, rounding hides the depth, and the diagnosis reports it as undetermined
    for (far, aside) in [1e2, 1e4, 1e5, 1e6, 1e7].into_iter().flat_map(|far| [(far, 0.3), (far, 1.5)]) {
        let (mut graph, values) = point(0.3, far);
        for from in [0.0, 1.0, -0.5] {
            graph.add(["p"], View { from, pixel: 100.0 * (aside - from) });
        }
        for (name, Solution { outcome, .. }) in solutions(&graph, &values) {
            assert!(outcome.final_cost < 1e-9, "{name} from {far} m, {aside} m: {outcome:?}");
        }
    }
}
