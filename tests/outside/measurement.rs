//! A measurement: the distance between an object and the camera, as from a laser range finder.
use manifactor::config::{Document, Format};
use manifactor::geometry::Se3;
use manifactor::graph::checked::Positive;
use manifactor::prelude::*;
use manifactor::quadric::DualQuadric;
use manifactor::slam::measurement::{Measurement, MeasurementSigmas, ResidualRows, UsualDepth};
use manifactor::slam::register_measurement;
use manifactor::slam::run::Run;
use manifactor::slam::run_document::RunDocument;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::sync::Arc;

/// Distance of an object's centre from the camera: r = |c - t| - distance.
///
/// ```toml
/// [[factors]]
/// keys = ["x0", "q0"]
/// factor = { type = "test_distance", distance = 2.0 }
/// ```
#[derive(Debug, Clone, Copy, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Distance {
    /// Measured distance. Unit: metres.
    distance: Positive,
}

impl Residual for Distance {
    type Variables = (Se3, DualQuadric);
    type Dim = U1;

    fn residual<T: Scalar>(&self, (pose, object): Lifted<Self::Variables, T>) -> Vector1<T> {
        Vector1::new((object.centroid() - pose.translation).norm() - self.distance.get())
    }
}
register_factor!("test_distance", Distance);

impl Measurement for Distance {
    fn name(&self) -> &'static str {
        "test_distance"
    }
    fn to_value(&self) -> serde_json::Value {
        serde_json::json!({ "distance": self.distance })
    }
    fn factor(&self) -> Arc<dyn Factor> {
        Arc::new(*self)
    }
    fn deviations(&self, _: &MeasurementSigmas, _: &ResidualRows) -> ResidualRows {
        ResidualRows::repeat(0.01)
    }
    fn cost_of_new(&self, usual: &UsualDepth) -> f64 {
        usual.cost(self.distance.get())
    }
}
register_measurement!("test_distance", Distance);

/// Lines of JSON for a camera that moves to the right and sees one ball of 0.2 m, 2 m ahead. `field` is the
/// name of the distance, possibly a wrong one.
fn lines(field: &str) -> String {
    let mut text = String::new();
    for i in 0..20 {
        let x = 0.05 * f64::from(i);
        // angles of the ball's outline from the optical axis
        let [centre, half] = [(-x).atan2(2.0), (0.1 / x.hypot(2.0)).asin()];
        let [left, right] = [centre - half, centre + half].map(|angle| 320.0 + 500.0 * angle.tan());
        let high = 500.0 * 0.1 / (4.0_f64 - 0.01).sqrt();
        let distance = x.hypot(2.0);
        writeln!(
            text,
            "{{\"timestamp\": {i}, \"pose\": {{\"translation\": [{x}, 0, 0], \"rotation\": [0, 0, 0, 1]}}, \"boxes\": [{{\"box\": \
             [{left}, {}, {right}, {}], \"class\": \"ball\", \"{field}\": {{\"distance\": {distance}}}}}]}}",
            240.0 - high,
            240.0 + high,
        )
        .unwrap();
    }
    text
}

fn run(field: &str, association: &str) -> (usize, usize, String) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("frames.jsonl"), lines(field)).unwrap();
    let text = format!(
        "source = {{ type = 'json_lines', file = 'frames.jsonl', camera = {{ fx = 500, fy = 500, cx = 320, cy = 240, width = 640, height = 480 }} }}
         objects = {{ initialiser = {{ type = 'rays' }} }}
         association = {{ type = '{association}' }}"
    );
    let name = folder.path().join("run.toml").display().to_string();
    let document = RunDocument::read(&Document::parse(name, text, Format::Toml).unwrap()).unwrap();
    let mut run = Run::new(&document, None);
    let (estimate, report) = run.run_variant(&document.variants[0], &mut Silent).unwrap();
    let factors = estimate.mapping.graph.factors().iter();
    let distances = factors.filter(|entry| entry.factor.typetag_name() == "test_distance").count();
    (distances, report.counts.objects, format!("{:?}", report.warnings))
}

#[test]
fn a_line_has_it_the_association_uses_it_and_the_graph_gets_its_factor() {
    let (distances, objects, warnings) = run("test_distance", "likelihood");
    assert_eq!((distances, objects), (20, 1), "{warnings}");
}

#[test]
fn a_field_of_another_name_is_an_error_with_the_names_there_are() {
    let (distances, objects, warnings) = run("test_distanze", "likelihood");
    assert_eq!((distances, objects), (0, 0));
    let expected = "unknown field `test_distanze`, expected one of `box`, `class`, `score`, `scores`, `object`, `camera`, `ellipse`, `view`, `depth`, `test_distance`";
    assert!(warnings.contains(expected), "{warnings}");
}
