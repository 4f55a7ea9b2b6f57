use super::*;
use manifactor_geometry::{Se3, So3};
use manifactor_graph::{Graph, Values};
use manifactor_quadric::testing::tilted;
use manifactor_quadric::{
    CentroidDepth, DualQuadric, HorizontalOrientationSmooth, VerticalOrientationSmooth,
};
use manifactor_solve::{LevenbergMarquardt, Silent, solve};
use manifactor_testing::{JacobianLaw, factor_laws};
use nalgebra::Vector3;

factor_laws! { max_mixture }

fn component(weight: f64, factor: impl Factor + 'static) -> Component {
    let noise = Noise::sigma(0.1).unwrap();
    Component { weight: Positive::new(weight).unwrap(), factor: Some(Arc::new(factor)), over: None, noise }
}
fn upright_or_flat() -> MaxMixture {
    let none =
        Component { weight: Positive::literal(1e-3), factor: None, over: None, noise: Noise::default() };
    let (upright, flat) = (
        component(0.6, VerticalOrientationSmooth::default()),
        component(0.3, HorizontalOrientationSmooth::default()),
    );
    MaxMixture::new(vec![upright, flat, none]).unwrap()
}

/// Final tilt of a solve that begins at some tilt.
fn solved(tilt: f64) -> f64 {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("q", tilted(tilt));
    graph.add(["q"], upright_or_flat());
    graph.fix_directions("q", &["x", "y", "z", "log_a", "log_b", "log_c", "rz"]);
    let solution = solve(&graph, &values, &LevenbergMarquardt::default(), &mut Silent).unwrap();
    let quadric: &DualQuadric = solution.values.get("q").unwrap();
    quadric.major_axis().z.abs().acos()
}

#[test]
fn the_estimate_decides_which_it_is() {
    assert!(solved(0.3) < 1e-6);
    assert!((solved(1.3) - std::f64::consts::FRAC_PI_2).abs() < 1e-6);
}

#[test]
fn what_fits_none_of_them_is_left_where_it_is() {
    // At 45° each of the two factors costs 25, and the component without a factor ln(600).
    assert!((solved(std::f64::consts::FRAC_PI_4) - std::f64::consts::FRAC_PI_4).abs() < 1e-9);
}

/// A depth of 1.5 m, measured from x, of either q0 or q1.
fn either(weights: [f64; 2]) -> MaxMixture {
    let depth = CentroidDepth { depth: Positive::new(1.5).unwrap() };
    let [first, second] = [1, 2]
        .map(|object| Component { over: Some(vec![0, object]), ..component(weights[object - 1], depth) });
    MaxMixture::new(vec![first, second]).unwrap()
}

#[test]
fn a_measurement_is_of_the_variable_that_fits_better() {
    let at = |z: f64| DualQuadric {
        pose: Se3::new(So3::identity(), Vector3::new(0.0, 0.0, z)),
        semi_axes: Vector3::new(0.3, 0.2, 0.1),
    };
    let camera = Se3::new(So3::identity(), Vector3::zeros());
    for (weights, expected) in [([1.0, 1.0], [1.5, 1.9]), ([1.0, 1e9], [1.3, 1.5])] {
        let (mut graph, mut values) = (Graph::new(), Values::new());
        values.insert("x", camera);
        values.insert("q0", at(1.3));
        values.insert("q1", at(1.9));
        graph.add(["x", "q0", "q1"], either(weights));
        graph.fix("x");
        for q in ["q0", "q1"] {
            graph.fix_directions(q, &["x", "y", "log_a", "log_b", "log_c", "rx", "ry", "rz"]);
        }
        let solution = solve(&graph, &values, &LevenbergMarquardt::default(), &mut Silent).unwrap();
        for (key, z) in ["q0", "q1"].into_iter().zip(expected) {
            let quadric: &DualQuadric = solution.values.get(key).unwrap();
            assert!((quadric.centroid().z - z).abs() < 1e-6, "{key} {}", quadric.centroid().z);
        }
    }
    JacobianLaw::default().check(&either([1.0, 2.0]), &[&camera, &at(1.3), &at(1.9)]).unwrap();
}

#[test]
fn the_cost_is_that_of_the_best_and_of_being_unlikely() {
    let flat = DualQuadric {
        pose: Se3::new(So3::identity(), Vector3::zeros()),
        semi_axes: Vector3::new(0.3, 0.2, 0.1),
    };
    let r = upright_or_flat().mixture.residual(&[&flat]).unwrap();
    assert!((0.5 * r.iter().map(|r| r * r).sum::<f64>() - 2f64.ln()).abs() < 1e-12, "{r:?}");
}

#[test]
fn components_that_do_not_fit_together_are_refused() {
    let read = |text: &str| serde_json::from_str::<MaxMixture>(text).unwrap_err().to_string();
    let upright = r#"{"weight": 1, "factor": {"type": "vertical_orientation"}}"#;
    assert!(read(&format!(r#"{{"components": [{upright}]}}"#)).contains("two components or more"));
    assert!(read(r#"{"components": [{"weight": 1}, {"weight": 2}]}"#).contains("none of the components"));
    let on = r#"{"weight": 1, "factor": {"type": "supporting_plane"}, "over": [1, 0]}"#;
    let error = read(&format!(r#"{{"components": [{upright}, {on}]}}"#));
    assert!(
        error.contains("component 1 has a plane at place 0, where another one has a dual_quadric"),
        "{error}"
    );
    let over = |over: &str| upright.replace("}}", &format!(r#"}}, "over": {over}}}"#));
    let both = |a: &str, b: &str| read(&format!(r#"{{"components": [{}, {}]}}"#, over(a), over(b)));
    assert!(both("[0]", "[0, 1]").contains("component 1: its factor is over dual_quadric"));
    assert!(both("[0]", "[64]").contains("component 1"), "{}", both("[0]", "[64]"));
    assert!(both("[0]", "[2]").contains("no component is over variable 1"));
    let noise = r#"{"weight": 1, "factor": {"type": "vertical_orientation"}, "noise": {"sigmas": [1, 2]}}"#;
    assert!(read(&format!(r#"{{"components": [{upright}, {noise}]}}"#)).contains("component 1"), "{error}");
    let text = serde_json::to_string(&upright_or_flat()).unwrap();
    assert_eq!(serde_json::to_string(&serde_json::from_str::<MaxMixture>(&text).unwrap()).unwrap(), text);
}
