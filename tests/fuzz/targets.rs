//! What strangers' bytes go through: nothing here may panic, hang, or leave a value that is not finite.
use manifactor::config::{Document, Format, read_graph, write_graph};
use manifactor::formats::pose_graph::{self, Options, Repair};
use manifactor::formats::{bal, detections, tum};
use manifactor::prelude::*;
use manifactor::slam::run_document::RunDocument;
use manifactor::solve::Auto;

/// A target by name.
pub type Target = (&'static str, fn(&[u8]));

/// All of them.
pub const TARGETS: [Target; 8] = [
    ("pose_graph", pose_graph),
    ("bundle", bundle),
    ("trajectory", trajectory),
    ("detections", detections),
    ("toml", toml),
    ("json", json),
    ("yaml", yaml),
    ("expression", expression),
];

/// Graphs of more are read, but not solved: fuzzers are there for many small inputs.
const SOLVED: usize = 64;

/// g2o and TORO files, by each policy of repair.
pub fn pose_graph(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    for repair in [Repair::Error, Repair::Reject, Repair::Clamp] {
        let options = Options { repair, ..Options::default() };
        if let Ok(read) = pose_graph::parse(&text, "graph.g2o", &options) {
            three_steps(&read.graph, &read.values);
        }
    }
}

/// Bundle adjustments in BAL's form.
pub fn bundle(data: &[u8]) {
    if let Ok(read) = bal::parse(&String::from_utf8_lossy(data), "scene.bal", true) {
        three_steps(&read.graph, &read.values);
    }
}

/// TUM's trajectories: what is read is read back from what is written.
pub fn trajectory(data: &[u8]) {
    if let Ok(read) = tum::parse(&String::from_utf8_lossy(data), "poses.txt") {
        let again = tum::parse(&tum::format(&read.poses), "poses.txt").unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(again.poses.len(), read.poses.len());
    }
}

/// Boxes of a detector.
pub fn detections(data: &[u8]) {
    if let Ok(read) = detections::parse(&String::from_utf8_lossy(data), "boxes.csv") {
        assert!(read.iter().all(|d| d.xmin < d.xmax && d.ymin < d.ymax));
    }
}

/// Documents in TOML.
pub fn toml(data: &[u8]) {
    document(data, Format::Toml);
}

/// Documents in JSON.
pub fn json(data: &[u8]) {
    document(data, Format::Json);
}

/// Documents in YAML.
pub fn yaml(data: &[u8]) {
    document(data, Format::Yaml);
}

/// Formulas over two poses and an ellipsoid.
pub fn expression(data: &[u8]) {
    let formula = serde_json::Value::from(String::from_utf8_lossy(data));
    let pose = r#"{ "type": "se3", "rotation": [0, 0, 0.6, 0.8], "translation": [1, 2, 3] }"#;
    let graph = format!(
        r#"{{ "variables": [
            {{ "key": "a", "value": {pose} }},
            {{ "key": "q", "value": {{ "type": "dual_quadric", "rotation": [0, 0, 0, 1], "translation": [0, 0, 9], "semi_axes": [1, 2, 3] }} }}],
           "factors": [{{ "keys": ["a", "q"], "factor": {{ "type": "expression",
            "variables": {{ "a": "se3", "q": "dual_quadric" }}, "residual": [{formula}] }} }}] }}"#
    );
    document(graph.as_bytes(), Format::Json);
}

/// As a graph, and as a run.
fn document(data: &[u8], format: Format) {
    let Ok(document) = Document::parse("document", String::from_utf8_lossy(data), format) else { return };
    // nothing is loaded: sources may be as large as they like
    let _ = RunDocument::read(&document);
    let Ok((graph, values)) = read_graph(&document) else { return };
    let written = write_graph(&graph, &values, format).unwrap_or_else(|e| panic!("{e}"));
    let again = Document::parse("written", written, format).and_then(|document| read_graph(&document));
    let (graph, values) = again.unwrap_or_else(|e| panic!("{e}"));
    three_steps(&graph, &values);
}

/// A few steps of the default solver, where graph and values fit each other.
fn three_steps(graph: &Graph, values: &Values) {
    if values.len() > SOLVED || graph.factors().len() > SOLVED {
        return;
    }
    let solver = Auto { stop: Stopping { max_iterations: 3, ..Stopping::default() }, ..Auto::default() };
    let Ok(solution) = solve(graph, values, &solver, &mut Silent) else { return };
    for (key, value) in solution.values.iter() {
        assert!(value.erased().is_finite(), "{key} is not finite: {:?}", solution.outcome.termination);
    }
    // a diagnosis may find that nothing can be said, but has to end
    let _ = solution.diagnose(graph);
}
