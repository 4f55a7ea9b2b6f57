//! Formulas compared with the equivalent built-in factors, and in the examples.
use manifactor::config::{Document, Format, graph_schema, read_graph, to_toml, write_graph};
use manifactor::geometry::{Point1, Se3};
use manifactor::prelude::*;
use manifactor::quadric::DualQuadric;
use manifactor::slam::estimate::Estimate;
use manifactor::slam::run::Run;
use manifactor::slam::run_document::RunDocument;

fn example(name: &str) -> Document {
    let path = format!("{}/examples/02_expression/{name}", env!("CARGO_MANIFEST_DIR"));
    Document::open(path).unwrap_or_else(|e| panic!("{e}"))
}

fn estimates() -> Vec<Estimate> {
    let mut document = example("desk.toml");
    document.set(&["source.trajectory.frames=40"]).unwrap();
    let document = RunDocument::read(&document).unwrap_or_else(|e| panic!("{e}"));
    let mut run = Run::new(&document, None);
    document.variants.iter().map(|variant| run.run_variant(variant, &mut Silent).unwrap().0).collect()
}

fn apart(a: &Values, b: &Values) -> f64 {
    let distance = |(key, x): (&Key, &dyn Variable)| {
        let local = x.erased().local(b.variable(key.as_str()).unwrap()).unwrap();
        local.iter().fold(0.0f64, |most, d| most.max(d.abs()))
    };
    a.iter().map(distance).fold(0.0, f64::max)
}

#[test]
fn the_paper_s_factors_as_formulas_come_to_the_built_in_ones_solution() {
    let both = estimates();
    let [formulas, built_in] = both.as_slice() else { panic!("two variants") };
    let count = |estimate: &Estimate, name: &str| {
        estimate.mapping.graph.factors().iter().filter(|f| f.factor.typetag_name() == name).count()
    };
    let oriented = count(built_in, "vertical_orientation") + count(built_in, "horizontal_orientation");
    assert!(count(built_in, "vertical_orientation") > 0 && count(built_in, "horizontal_orientation") > 0);
    assert_eq!(count(formulas, "expression"), oriented);
    let distance = apart(&formulas.solution.values, &built_in.solution.values);
    assert!(distance < 1e-9, "{distance}");
    let (a, b) = (&formulas.solution.outcome, &built_in.solution.outcome);
    assert!((a.final_cost - b.final_cost).abs() <= 1e-9 * b.final_cost);
}

#[test]
fn a_rule_gets_up_from_gravity_only_where_its_formula_asks_for_it() {
    let run = |residual: &str| {
        let mut document = example("desk.toml");
        let rule = format!(
            "semantics=[{{ classes = [\"cup\"], factor = {{ type = \"expression\", variables = {{ q = \"dual_quadric\" }}, \
             residual = [\"{residual}\"] }} }}]"
        );
        document.set(&[&rule]).unwrap();
        let document = RunDocument::read(&document).unwrap_or_else(|e| panic!("{e}"));
        document.variants[0].settings.semantics[0].factor.clone()
    };
    let tilted = Direction::new(Vector3::new(0.0, -1.0, 0.0)).unwrap();
    let oriented = run("dot(major_axis(q), up)");
    assert!(oriented.wants_up() && oriented.instantiate(None).is_err());
    let text = serde_json::to_string(&oriented.instantiate(Some(tilted)).unwrap()).unwrap();
    assert!(text.contains(r#""up":[0.0,-1.0,0.0]"#), "{text}");
    let sized = run("norm(semi_axes(q)) - 0.1");
    assert!(!sized.wants_up() && sized.instantiate(None).is_ok());
}

#[test]
fn the_cups_come_to_stand_on_the_table() {
    let (graph, values) = read_graph(&example("graph.toml")).unwrap_or_else(|e| panic!("{e}"));
    let solution = solve(&graph, &values, &LevenbergMarquardt::default(), &mut Silent).unwrap();
    assert!(solution.outcome.termination.is_converged());
    let height = solution.values.get::<Point1>("table").unwrap().x;
    assert!((height - 0.72).abs() < 0.01, "{height}");
    for key in ["q0", "q1"] {
        let lowest = solution.values.get::<DualQuadric>(key).unwrap().axes_aligned_box().min.z;
        assert!((lowest - height).abs() < 0.01, "{key}: {lowest}");
    }
}

#[test]
fn documents_round_trip_to_the_letter() {
    let (graph, values) = read_graph(&example("graph.toml")).unwrap();
    for format in [Format::Toml, Format::Json, Format::Yaml] {
        let text = write_graph(&graph, &values, format).unwrap();
        let (again, values) = read_graph(&Document::parse("again", text.clone(), format).unwrap()).unwrap();
        assert_eq!(write_graph(&again, &values, format).unwrap(), text);
    }
    // a pose as a constant, and a custom up direction
    let text = r#"{"type":"expression","variables":{"x":"se3"},"residual":["log(inverse(goal) * x)","dot(up, position(x))"],"constants":{"goal":{"type":"se3","translation":[0.1,0.2,0.3],"rotation":[0.0,0.6,0.0,0.8]}},"up":[0.0,0.6,0.8],"domain":["z(position(x)) + 1"]}"#;
    let factor: Box<dyn Factor> = serde_json::from_str(text).unwrap();
    assert_eq!(serde_json::to_string(&factor).unwrap(), text);
    assert!(to_toml(&factor).is_ok());
    let goal = Se3 { translation: Vector3::new(0.1, 0.2, 0.3), ..Se3::identity() };
    assert_eq!(factor.erased().residual(&[&goal]).unwrap().len(), 7);
}

#[test]
fn a_mistake_in_a_formula_is_shown_at_its_column() {
    let text = example("graph.toml").source().text().replace(
        "extent(q, up) - height\"] }\nnoise = { sigma = 0.01 }\n\n[[factors]]\nkeys = [\"q1\"",
        "extnt(q, up) - height\"] }\nnoise = { sigma = 0.01 }\n\n[[factors]]\nkeys = [\"q1\"",
    );
    let error = read_graph(&Document::parse("graph.toml", text.clone(), Format::Toml).unwrap()).unwrap_err();
    let [error] = error.iter().collect::<Vec<_>>()[..] else { panic!("{error}") };
    assert_eq!(error.place.text(), "extnt");
    assert_eq!(error.message(), "unknown function `extnt`");
    assert_eq!(error.help().unwrap(), "did you mean `extent`?");
}

#[test]
fn the_schema_knows_formulas() {
    let schema = graph_schema();
    let of = &schema["$defs"]["factor.expression"]["properties"];
    for field in ["type", "variables", "residual", "constants", "up", "domain"] {
        assert!(of.get(field).is_some(), "{field}");
    }
    assert_eq!(of["variables"]["additionalProperties"]["type"], "string");
}
