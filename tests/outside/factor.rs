//! A factor: `examples/01_new_factor/rests_on.rs`, as in the author's guide.
use crate::rests_on::RestsOn;
use crate::solve_document;
use manifactor::config::{Document, Format};
use manifactor::graph::catalogue;
use manifactor::prelude::*;
use manifactor::quadric::DualQuadric;
use manifactor::slam::run::Run;
use manifactor::slam::run_document::RunDocument;
use manifactor_testing::catalogue::{documentation_law, factor_law};

const FLOATING: &str = r#"
[[variables]]
key = "q0"
value = { type = "dual_quadric", translation = [0.3, 0.1, 1.5], rotation = [0.0, 0.6, 0.0, 0.8], semi_axes = [0.1, 0.2, 0.3] }
fixed = ["rx", "ry", "rz", "log_a", "log_b", "log_c"]

[[factors]]
keys = ["q0"]
factor = { type = "rests_on", height = 0.7 }
noise = { sigma = 0.01 }
"#;

#[test]
fn it_obeys_the_laws_of_every_factor() {
    let entry = catalogue::find("factor", "rests_on").unwrap();
    documentation_law(entry).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(factor_law(entry, 256).unwrap_or_else(|e| panic!("{e}")).defined, 256);
}

#[test]
fn a_graph_names_it_and_the_object_comes_down() {
    let solution = solve_document(FLOATING);
    assert!(solution.outcome.termination.is_converged(), "{}", solution.outcome.termination);
    let quadric: &DualQuadric = solution.values.get("q0").unwrap();
    assert!((quadric.axes_aligned_box().min.z - 0.7).abs() < 1e-9);
}

#[test]
fn a_misspelled_field_is_an_error_at_its_line() {
    let text = FLOATING.replace("height", "heigth");
    let document = Document::parse("graph.toml", text, Format::Toml).unwrap();
    let error = manifactor::config::read_graph(&document).unwrap_err().to_string();
    assert!(error.starts_with("graph.toml:9:") && error.contains("did you mean `height`"), "{error}");
}

#[test]
fn a_run_names_it_among_its_semantics() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/01_new_factor/desk.toml");
    let mut document = Document::open(path).unwrap_or_else(|e| panic!("{e}"));
    document.set(&["source.trajectory.frames=20", "source.scene.objects=5"]).unwrap();
    let document = RunDocument::read(&document).unwrap_or_else(|e| panic!("{e}"));
    let mut run = Run::new(&document, None);
    let (estimate, _) = run.run_variant(&document.variants[1], &mut Silent).unwrap();
    let factors = estimate.mapping.graph.factors().iter();
    assert!(factors.filter(|f| f.factor.typetag_name() == "rests_on").count() > 0);
}

#[test]
fn its_error_is_the_height_over_the_plane() {
    let solid = |z: f64| DualQuadric {
        pose: manifactor::geometry::Se3 {
            translation: Vector3::new(0.0, 0.0, z),
            ..manifactor::geometry::Se3::identity()
        },
        semi_axes: Vector3::new(0.1, 0.2, 0.3),
    };
    let factor = RestsOn { height: 0.7, ..RestsOn::default() };
    let r = |z: f64| factor.residual::<f64>((solid(z),)).x;
    assert!(r(1.0).abs() < 1e-15 && (r(1.5) - 0.5).abs() < 1e-15);
}
