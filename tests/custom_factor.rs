//! A factor from outside of the project: defined here, registered here, used from a document by name.
#![allow(missing_docs)]
use manifactor::config::{Document, Format, read_graph};
use manifactor::prelude::*;
use manifactor::quadric::DualQuadric;
use manifactor_testing::jacobian_law;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An object rests on a horizontal plane: r = z of its lowest point - height.
///
/// The lowest point of an ellipsoid is √(upᵀ R diag(s²) Rᵀ up) below its centre, along up = z.
///
/// ```toml
/// [[factors]]
/// keys   = ["q0"]
/// factor = { type = "rests_on", height = 0.75 }
/// noise  = { sigma = 0.01 }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RestsOn {
    /// Height of the plane, in metres.
    pub height: f64,
}

impl Residual for RestsOn {
    type Variables = (DualQuadric,);
    type Dim = U1;

    fn residual<T: Scalar>(&self, (quadric,): Lifted<Self::Variables, T>) -> Vector1<T> {
        let up = quadric.pose.rotation.inverse().act(&Direction::Z.lift());
        let below = up.component_mul(&quadric.semi_axes).norm_squared().sqrt();
        Vector1::new(quadric.centroid().z - below - T::from(self.height))
    }
}
register_factor!("rests_on", RestsOn);

const GRAPH: &str = r#"
[[variables]]
key   = "cup"
value = { type = "dual_quadric", translation = [1.0, 0.0, 0.9], rotation = [0.0, 0.0, 0.0, 1.0], semi_axes = [0.04, 0.04, 0.06] }
fixed = ["rx", "ry", "rz", "x", "y", "log_a", "log_b", "log_c"]

[[factors]]
keys   = ["cup"]
factor = { type = "rests_on", height = 0.75 }
noise  = { sigma = 0.01 }
"#;

#[test]
fn a_factor_of_ones_own_works_from_a_document() {
    let document = Document::parse("graph.toml", GRAPH, Format::Toml).unwrap();
    let (graph, values) = read_graph(&document).unwrap();
    let solution = solve(&graph, &values, &GaussNewton::default(), &mut Silent).unwrap();
    let cup: &DualQuadric = solution.values.get("cup").unwrap();
    assert!((cup.pose.translation.z - 0.81).abs() < 1e-9, "{cup:?}");
}

#[test]
fn its_jacobian_is_checked_in_a_line() {
    let document = Document::parse("graph.toml", GRAPH, Format::Toml).unwrap();
    let (graph, values) = read_graph(&document).unwrap();
    let cup = values.variable("cup").unwrap();
    jacobian_law(&*graph.factors()[0].factor, &[cup]).unwrap();
}

#[test]
fn a_mistake_in_its_parameters_is_told_with_its_place() {
    let text = GRAPH.replace("height", "hight");
    let document = Document::parse("graph.toml", text, Format::Toml).unwrap();
    let message = read_graph(&document).unwrap_err().to_string();
    assert!(message.contains("graph.toml:9:") && message.contains("height"), "{message}");
}
