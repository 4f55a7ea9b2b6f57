//! Functions that read untrusted bytes: none may panic, hang, or leave a value that is not finite.
// the root of a separate package for cargo-fuzz, and a module of the tests
#[path = "targets/experiments.rs"]
mod experiments;
#[path = "targets/files.rs"]
mod files;
#[path = "targets/history.rs"]
mod history;
#[path = "targets/mapper.rs"]
mod mapper;
#[path = "targets/replay.rs"]
mod replay;
#[path = "targets/smoother.rs"]
mod smoother;
#[path = "targets/stream.rs"]
mod stream;
#[path = "targets/view.rs"]
mod view;

pub use experiments::{experiment, trials};
pub use files::{prior_map, record};
pub use history::history;
pub use mapper::mapper;
pub use replay::replay;
pub use smoother::session;
pub use stream::{frame_journal, json_lines};
pub use view::view;

use manifactor::config::{Document, Errors, Format, read_graph, read_graph_section, to_json, write_graph};
use manifactor::formats::pose_graph::{self, InformationRepair, PoseGraphOptions};
use manifactor::formats::{accelerometer, bal, detections, timestamps, tum};
use manifactor::prelude::*;
use manifactor::slam::run::estimate;
use manifactor::slam::run_document::RunDocument;
use manifactor::slam::sequence::Sequence;
use manifactor::slam::simulator::SimulatedSource;
use manifactor::solve::{Auto, IterationRecord};
use manifactor_graph::checked::Count;
use std::num::NonZero;
use std::ops::ControlFlow;
use std::sync::{Arc, LazyLock};

/// A target: its name, its function, and the number of changed inputs in a test run, smaller for slow
/// targets.
pub type Target = (&'static str, fn(&[u8]), usize);

/// All targets.
pub const TARGETS: [Target; 20] = [
    ("pose_graph", pose_graph, 2000),
    ("bundle", bundle, 2000),
    ("trajectory", trajectory, 2000),
    ("detections", detections, 2000),
    ("toml", toml, 2000),
    ("json", json, 2000),
    ("yaml", yaml, 2000),
    ("expression", expression, 2000),
    ("run", run, 2000),
    ("json_lines", json_lines, 500),
    ("frame_journal", frame_journal, 300),
    ("prior_map", prior_map, 500),
    ("record", record, 300),
    ("session", session, 500),
    ("mapper", mapper, 100),
    ("replay", replay, 500),
    ("experiment", experiment, 200),
    ("trials", trials, 200),
    ("view", view, 500),
    ("history", history, 300),
];

/// Largest graph that is solved; larger ones are only read. Fuzzers are for many small inputs.
const SOLVED: usize = 64;

/// Reads g2o and TORO files with each policy of repair.
pub fn pose_graph(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    for repair in [InformationRepair::Error, InformationRepair::Reject, InformationRepair::Clamp] {
        let options = PoseGraphOptions { repair, ..PoseGraphOptions::default() };
        if let Ok(read) = pose_graph::parse(&text, "graph.g2o", &options) {
            three_steps(&read.graph, &read.values, &Auto::default());
        }
    }
}

/// Reads bundle adjustments in BAL's format.
pub fn bundle(data: &[u8]) {
    if let Ok(read) = bal::parse(&String::from_utf8_lossy(data), "scene.bal", true) {
        three_steps(&read.graph, &read.values, &Auto::default());
    }
}

/// Reads TUM trajectories, and lists of times and accelerations. Trajectories are written and read back.
pub fn trajectory(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let _ = (accelerometer::parse(&text, "accelerometer.txt"), timestamps::parse(&text, "rgb.txt"));
    if let Ok(read) = tum::parse(&String::from_utf8_lossy(data), "poses.txt") {
        let again = tum::parse(&tum::format(&read.poses), "poses.txt").unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(again.poses.len(), read.poses.len());
    }
}

/// Reads boxes of a detector.
pub fn detections(data: &[u8]) {
    if let Ok(read) = detections::parse(&String::from_utf8_lossy(data), "boxes.csv") {
        assert!(read.iter().all(|d| d.xmin < d.xmax && d.ymin < d.ymax));
    }
}

/// Reads documents in TOML.
pub fn toml(data: &[u8]) {
    document(data, Format::Toml);
}

/// Reads documents in JSON.
pub fn json(data: &[u8]) {
    document(data, Format::Json);
}

/// Reads documents in YAML.
pub fn yaml(data: &[u8]) {
    document(data, Format::Yaml);
}

/// Reads formulas over two poses and an ellipsoid.
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

/// Reads runs, with a small simulation instead of their source: from the document to the report.
pub fn run(data: &[u8]) {
    static SEQUENCE: LazyLock<Arc<Sequence>> = LazyLock::new(|| {
        let mut simulation = SimulatedSource::default();
        simulation.trajectory.frames = Count::literal(6);
        simulation.scene.objects = Count::literal(2);
        Arc::new(simulation.simulate().unwrap_or_else(|e| panic!("{e}")))
    });
    let Ok(document) = Document::parse("run.toml", String::from_utf8_lossy(data), Format::Toml) else {
        return;
    };
    let Ok(run) = RunDocument::read(&document) else { return };
    for variant in run.variants.into_iter().take(2) {
        let mut settings = variant.settings;
        settings.objects.refinements = settings.objects.refinements.min(1);
        if let Some(variance) = &mut settings.variance_components {
            variance.rounds = variance.rounds.min(NonZero::<usize>::MIN.saturating_add(1));
        }
        let Ok((found, report)) = estimate("fuzzed", SEQUENCE.clone(), &settings, &mut third()) else {
            continue;
        };
        is_finite(&found.solution.values);
        let _ = to_json(&report);
    }
}

/// Reads a document as a graph, with its solver and its start, and as a run.
fn document(data: &[u8], format: Format) {
    let Ok(document) = Document::parse("document", String::from_utf8_lossy(data), format) else { return };
    // nothing is loaded, so sources may have any size
    let _ = RunDocument::read(&document);
    let errors = Errors::new();
    let read = document.section(&errors).map(|mut section| {
        let (graph, values) = read_graph_section(&mut section);
        let optimizer = section.optional::<Box<dyn Optimizer>>("solver");
        let start = section.optional::<Box<dyn Start>>("start");
        section.finish();
        (graph, values, optimizer, start)
    });
    let Ok((graph, values, optimizer, start)) = errors.finish(read) else { return };
    let written = write_graph(&graph, &values, format).unwrap_or_else(|e| panic!("{e}"));
    let again = Document::parse("written", written, format).and_then(|document| read_graph(&document));
    let (graph, mut values) = again.unwrap_or_else(|e| panic!("{e}"));
    if values.len() > SOLVED {
        return;
    }
    if let Some(Ok(begin)) = start.map(|start| start.start(&graph, &values)) {
        values = begin;
    }
    three_steps(&graph, &values, &*optimizer.unwrap_or_else(|| Box::new(Auto::default())));
}

/// Ends a solve at its third step.
fn third() -> impl Observer {
    let mut steps = 0;
    move |_: &IterationRecord| {
        steps += 1;
        if steps < 3 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }
}

/// Makes a few steps if graph and values fit together.
fn three_steps(graph: &Graph, values: &Values, solver: &dyn Optimizer) {
    if values.len() > SOLVED || graph.factors().len() > SOLVED {
        return;
    }
    let Ok(solution) = solve(graph, values, solver, &mut third()) else { return };
    is_finite(&solution.values);
    // a diagnosis may be empty, but has to end
    let _ = solution.diagnose(graph);
}

/// Fails if a value is not finite.
fn is_finite(values: &Values) {
    for (key, value) in values.iter() {
        assert!(value.erased().is_finite(), "{key} is not finite");
    }
}

/// A folder for one input, removed at the end.
fn temporary() -> tempfile::TempDir {
    tempfile::tempdir().unwrap_or_else(|e| panic!("{e}"))
}

/// Relative difference that the normalization of a rotation may leave.
const ROUNDING: f64 = 1e-12;

/// Fails if two documents differ by more than rounding.
fn assert_alike(a: &serde_json::Value, b: &serde_json::Value) {
    use serde_json::Value::{Array, Number, Object};
    match (a, b) {
        (Number(x), Number(y)) => {
            let [x, y] = [x, y].map(|n| n.as_f64().unwrap_or_default());
            assert!((x - y).abs() <= ROUNDING * x.abs().max(1.0), "{x} and {y}");
        }
        (Array(a), Array(b)) if a.len() == b.len() => a.iter().zip(b).for_each(|(a, b)| assert_alike(a, b)),
        (Object(a), Object(b)) if a.keys().eq(b.keys()) => {
            a.values().zip(b.values()).for_each(|(a, b)| assert_alike(a, b));
        }
        _ => assert_eq!(a, b),
    }
}
