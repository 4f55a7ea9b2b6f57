//! Requirements for every registered type, checked over the whole catalogue.
use manifactor::config::{Definitions, Document, Format, Node, Value};
use manifactor::geometry::AnyCamera;
use manifactor::graph::catalogue::{Entry, Kind, all, entries};
use manifactor::graph::loss::Loss;
use manifactor::graph::{Factor, Noise, Variable};
use manifactor::quadric::initialise::Initialiser;
use manifactor::slam::association::Association;
use manifactor::slam::gravity::Gravity;
use manifactor::slam::motion::MotionModel;
use manifactor::slam::run_document::RunDocument;
use manifactor::slam::schema::run_root;
use manifactor::slam::source::SequenceSource;
use manifactor::solve::{Optimizer, Start};
use manifactor_testing::catalogue::{documentation_law, factor_law, loss_law, manifold_law};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::Value as Json;

/// An identifier for messages, such as `geometry.between_se3`.
fn id(entry: &Entry) -> String {
    format!("{} `{}` of {}", entry.kind, entry.name, entry.module)
}

#[test]
fn names_are_unique_within_a_kind() {
    for pair in all().windows(2) {
        assert_ne!(
            (pair[0].kind, pair[0].name),
            (pair[1].kind, pair[1].name),
            "{} is registered twice",
            id(pair[1])
        );
    }
}

#[test]
fn the_plugins_are_linked() {
    for (kind, name) in [
        ("factor", "between_se3"),
        ("factor", "vertical_orientation"),
        ("variable", "dual_quadric"),
        ("solver", "levenberg_marquardt"),
        ("source", "simulated"),
        ("loss", "cauchy"),
    ] {
        assert!(entries(kind).iter().any(|e| e.name == name), "no {kind} `{name}`");
    }
}

#[test]
fn every_type_has_docs_and_an_example_and_documented_fields() {
    for entry in all() {
        documentation_law(entry).unwrap_or_else(|e| panic!("{e}"));
        let summary = entry.summary();
        assert!((10..=200).contains(&summary.len()), "summary of {}: {summary:?}", id(entry));
        let schema = (entry.schema)();
        for (field, of) in schema.get("properties").and_then(Json::as_object).into_iter().flatten() {
            let described = of.get("description").is_some() || of.get("$ref").is_some();
            assert!(described, "field `{field}` of {} has no docs", id(entry));
        }
    }
}

#[test]
fn every_factor_agrees_with_its_derivatives() {
    for entry in entries("factor") {
        let defined = factor_law(entry, 256).unwrap_or_else(|e| panic!("{e}")).defined;
        assert!(defined > 0, "{} is defined nowhere around its example", id(entry));
    }
}

#[test]
fn every_manifold_keeps_the_laws() {
    for entry in entries("variable") {
        manifold_law(entry, 256).unwrap_or_else(|e| panic!("{}: {e}", id(entry)));
    }
}

#[test]
fn every_loss_is_tempered_as_the_definition_says() {
    for entry in entries("loss") {
        loss_law(entry).unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
fn every_example_reads_and_writes_the_same_type_again() {
    for entry in all() {
        let example = example(entry);
        let tables = tables_of_type(example.root(), entry.name);
        assert!(
            !tables.is_empty(),
            "the example of {} does not show it:\n{}",
            id(entry),
            example.source().text()
        );
        for table in tables {
            let tagged = table.to_json().unwrap();
            round_trip(entry, &tagged);
        }
    }
}

#[test]
fn noise_in_the_examples_of_factors_fits_their_rows() {
    for entry in entries("factor") {
        let example = example(entry);
        let Value::Table(root) = &example.root().value else { continue };
        let Some(Value::Array(factors)) = root.get("factors").map(|f| &f.node.value) else { continue };
        for factor in factors {
            let factor = factor.to_json().unwrap();
            let noise: Noise = factor
                .get("noise")
                .map_or_else(Noise::default, |n| serde_json::from_value(n.clone()).unwrap());
            let signature = serde_json::from_value::<Box<dyn Factor>>(factor["factor"].clone())
                .unwrap()
                .erased()
                .signature();
            let rows = signature.rows.unwrap();
            assert!(
                noise.whitener(rows).is_ok(),
                "{} has {rows} rows, its example's noise has not",
                id(entry)
            );
            let keys = factor["keys"].as_array().unwrap().len();
            assert!(signature.many || keys == signature.variables.len(), "{}: {keys} keys", id(entry));
        }
    }
}

fn example(entry: &Entry) -> Document {
    let text = entry.example().unwrap_or_else(|| panic!("{} has no example", id(entry)));
    Document::parse(id(entry), text, Format::Toml).unwrap_or_else(|e| panic!("{e}"))
}

/// Returns all tables in a document whose `type` is this name.
fn tables_of_type<'a>(node: &'a Node, name: &str) -> Vec<&'a Node> {
    match &node.value {
        Value::Table(table) => {
            let is_it = table.get("type").is_some_and(|f| f.node.value == Value::String(name.into()));
            let inner = table.values().flat_map(|field| tables_of_type(&field.node, name));
            is_it.then_some(node).into_iter().chain(inner).collect()
        }
        Value::Array(items) => items.iter().flat_map(|item| tables_of_type(item, name)).collect(),
        _ => vec![],
    }
}

/// Calls a function with the type of a kind. A new kind needs a new arm.
macro_rules! for_kind {
    ($kind:expr, $call:ident($($argument:expr),*)) => {
        match $kind {
            k if k == <dyn Factor as Kind>::NAME => $call::<Box<dyn Factor>>($($argument),*),
            k if k == <dyn Variable as Kind>::NAME => $call::<Box<dyn Variable>>($($argument),*),
            k if k == <dyn Loss as Kind>::NAME => $call::<Box<dyn Loss>>($($argument),*),
            k if k == <dyn Optimizer as Kind>::NAME => $call::<Box<dyn Optimizer>>($($argument),*),
            k if k == <dyn Start as Kind>::NAME => $call::<Box<dyn Start>>($($argument),*),
            k if k == <dyn SequenceSource as Kind>::NAME => $call::<Box<dyn SequenceSource>>($($argument),*),
            k if k == <dyn Association as Kind>::NAME => $call::<Box<dyn Association>>($($argument),*),
            k if k == <dyn Gravity as Kind>::NAME => $call::<Box<dyn Gravity>>($($argument),*),
            k if k == <dyn AnyCamera as Kind>::NAME => $call::<Box<dyn AnyCamera>>($($argument),*),
            k if k == <dyn MotionModel as Kind>::NAME => $call::<Box<dyn MotionModel>>($($argument),*),
            k if k == <dyn Initialiser as Kind>::NAME => $call::<Box<dyn Initialiser>>($($argument),*),
            other => panic!("the kind `{other}` is new: add it to this test"),
        }
    };
}

/// Reads a table, and writes the result again.
fn again(entry: &Entry, tagged: &Json) -> Result<Json, serde_json::Error> {
    fn of<T: Serialize + DeserializeOwned>(tagged: &Json) -> Result<Json, serde_json::Error> {
        serde_json::to_value(serde_json::from_value::<T>(tagged.clone())?)
    }
    for_kind!(entry.kind, of(tagged))
}

fn round_trip(entry: &Entry, tagged: &Json) {
    let written = again(entry, tagged).unwrap_or_else(|e| panic!("{}: {e}", id(entry)));
    assert_eq!(written["type"], entry.name);
    let twice = again(entry, &written).unwrap_or_else(|e| panic!("{}: {e}", id(entry)));
    assert_eq!(written, twice, "{}", id(entry));
}

/// Checks that a default in a schema is the value that is read when a document omits the field.
fn defaults_are_those_read(schema: &Json, root: &Json, read: &Json, at: &str) -> usize {
    let named = schema.get("$ref").and_then(Json::as_str).and_then(|r| r.strip_prefix('#'));
    let schema = named.and_then(|pointer| root.pointer(pointer)).unwrap_or(schema);
    let properties = schema.get("properties").and_then(Json::as_object).into_iter().flatten();
    let mut compared = 0;
    for (name, property) in properties {
        let (at, read) = (format!("{at}.{name}"), read.get(name).unwrap_or(&Json::Null));
        if let Some(default) = property.get("default") {
            assert!(same(default, read), "{at}: the schema says {default}, what is read is {read}");
            compared += 1;
        }
        compared += defaults_are_those_read(property, root, read, &at);
    }
    compared
}

/// Compares values; null, an empty list and an empty table count as absent.
fn same(a: &Json, b: &Json) -> bool {
    let is_nothing = |x: &Json| {
        matches!(x, Json::Null | Json::Bool(false))
            || *x == Json::Array(vec![])
            || *x == serde_json::json!({})
    };
    match (a, b) {
        (Json::Object(a), Json::Object(b)) => {
            let names: std::collections::BTreeSet<&String> = a.keys().chain(b.keys()).collect();
            names
                .into_iter()
                .all(|name| same(a.get(name).unwrap_or(&Json::Null), b.get(name).unwrap_or(&Json::Null)))
        }
        _ => a == b || (is_nothing(a) && is_nothing(b)),
    }
}

#[test]
fn the_defaults_of_a_runs_schema_are_those_that_are_read() {
    let mut definitions = Definitions::new();
    let root = run_root(&mut definitions);
    let schema = definitions.document(root);
    let document = Document::parse("run.toml", "source = { type = 'simulated' }", Format::Toml).unwrap();
    let run = RunDocument::read(&document).unwrap();
    let read = serde_json::to_value(&run.variants[0].settings).unwrap();
    let compared = defaults_are_those_read(&schema, &schema, &read, "run");
    assert!(compared > 25, "{compared}");
}

#[test]
fn the_defaults_of_every_schema_are_those_that_are_read() {
    let mut compared = 0;
    for entry in all() {
        let schema = Json::from((entry.schema)());
        let required: Vec<&str> = schema
            .get("required")
            .and_then(Json::as_array)
            .into_iter()
            .flatten()
            .filter_map(Json::as_str)
            .collect();
        for table in tables_of_type(example(entry).root(), entry.name) {
            let mut least = table.to_json().unwrap();
            least
                .as_object_mut()
                .unwrap()
                .retain(|name, _| name == "type" || required.contains(&name.as_str()));
            // some types need one of two fields, which a list of required fields cannot express
            if let Ok(read) = again(entry, &least) {
                compared += defaults_are_those_read(&schema, &schema, &read, &id(entry));
            }
        }
    }
    assert!(compared > 100, "{compared}");
}

#[test]
fn the_example_of_a_literal_graph_is_one() {
    let source = include_str!("../core/config/graph_document/read.rs");
    let example = source.split("/// ```toml").nth(1).unwrap().split("/// ```").next().unwrap();
    let text: String = example.lines().map(|line| line.trim_start_matches("///").to_owned() + "\n").collect();
    let document = Document::parse("read.rs", text, Format::Toml).unwrap();
    let (graph, values) = manifactor::config::read_graph(&document).unwrap();
    assert_eq!((graph.factors().len(), values.len()), (3, 3));
}
