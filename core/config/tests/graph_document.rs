//! Graph documents: their content, round trips, and the errors of wrong ones.

use crate::plugin::{Balance, Height, Offset, Plane, Real, Unit};
use manifactor_config::{Document, Format, read_graph, write_graph};
use manifactor_graph::loss::{Cauchy, Huber};
use manifactor_graph::{Fixed, Graph, Noise, Values};
use nalgebra::DMatrix;
use proptest::prelude::*;

const GOOD: &str = r#"
[[variables]]
key = "x0"
value = { type = "plane", x = 0.0, y = 1 }
fixed = true

[[variables]]
key = "x1"
value = { type = "plane", x = 0.5, y = 1.0 }
fixed = ["y"]

[[variables]]
key = "h"
value = { type = "real", value = 2.0 }

[[factors]]
keys = ["x0", "x1"]
factor = { type = "offset", measured = [0.5, 0.25] }
noise = { sigmas = [0.1, 0.2] }
loss = { type = "huber", scale = 2.0 }

[[factors]]
keys = ["x1", "h"]
factor = { type = "height" }
"#;

fn read(format: Format, text: &str) -> Result<(Graph, Values), String> {
    let document = Document::parse("graph", text, format).map_err(|e| e.to_string())?;
    read_graph(&document).map_err(|e| e.to_string())
}

fn said(format: Format, text: &str) -> String {
    read(format, text).expect_err("an error")
}

/// Returns the good document with a part replaced.
fn wrong(part: &str, by: &str) -> String {
    assert!(GOOD.contains(part), "{part}");
    said(Format::Toml, &GOOD.replace(part, by))
}

#[test]
fn an_entry_stands_for_a_factor_for_each_value() {
    let each = |more: &str| {
        GOOD.replace("measured = [0.5, 0.25] }\nnoise = { sigmas = [0.1, 0.2] }", &format!("}}\n{more}"))
    };
    let (graph, _) = read(
        Format::Toml,
        &each("each.factor.measured = [[0.5, 0.25], [0.0, 1.0]]\neach.noise = [{ sigma = 0.1 }, { sigmas = [1.0, 2.0] }]"),
    )
    .unwrap();
    let offsets: Vec<_> = graph.factors()[..2]
        .iter()
        .map(|entry| {
            assert_eq!(entry.keys, ["x0", "x1"].map(Into::into));
            assert!(entry.loss.is_some());
            (entry.factor.erased().as_any().downcast_ref::<Offset>().unwrap().measured, entry.noise.clone())
        })
        .collect();
    let noises = [Noise::sigma(0.1).unwrap(), Noise::sigmas(&[1.0, 2.0]).unwrap()];
    assert_eq!(offsets, [([0.5, 0.25], noises[0].clone()), ([0.0, 1.0], noises[1].clone())]);
    assert_eq!(graph.factors().len(), 3);
    let keys = GOOD.replace("keys = [\"x0\", \"x1\"]", "each.keys = [[\"x0\", \"x1\"], [\"x1\", \"x0\"]]");
    assert_eq!(read(Format::Toml, &keys).unwrap().0.factors()[1].keys, ["x1", "x0"].map(Into::into));
    for (more, expected) in [
        ("each = 3", "graph:19:8: expected fields with an array of values"),
        ("each = []", "expected fields with an array of values"),
        ("each = {}", "expected fields with an array of values"),
        ("each.factor.measured = []", "expected fields with an array of values"),
        ("each.factor = { measured = 3 }", "graph:19:28: expected fields with an array of values"),
        (
            "each.factor.measured = [[0.5, 0.25], [0.0]]",
            "graph:19:38: expected an array of 2, found 1 element",
        ),
        ("each.factor.measured = [[0.5, 0.25], [0.0, nan]]", "nan"),
        ("each.factor = { measured = [[1.0, 2.0]], meassured = [1] }", "unknown field `meassured`"),
        (
            "each.factor.measured = [[0.5, 0.25]]\neach.noise.sigma = [1.0, 2.0]",
            "`noise.sigma` has 2 values, `factor.measured` has 1",
        ),
        (
            "each.factor.type = [\"offset\"]",
            "`factor.type` is given here for all factors, and in `each` for each of them",
        ),
        ("each.keys = [[\"x0\", \"x1\"]]", "`keys` is given here for all factors"),
    ] {
        let said = said(Format::Toml, &each(more));
        assert!(said.contains(expected), "{more}: {said}");
    }
}

#[test]
fn a_graph_is_read() {
    let (graph, values) = read(Format::Toml, GOOD).unwrap();
    assert_eq!(values.len(), 3);
    assert_eq!(values.get::<Plane>("x1"), Ok(&Plane { x: 0.5, y: 1.0 }));
    assert_eq!(graph.fixed()["x0"], Fixed::Whole(true));
    assert_eq!(graph.fixed()["x1"], Fixed::Directions(vec!["y".into()]));
    assert!(!graph.fixed().contains_key("h"));
    let [offset, height] = graph.factors() else { panic!("two factors") };
    assert_eq!(offset.factor.erased().as_any().downcast_ref(), Some(&Offset { measured: [0.5, 0.25] }));
    assert_eq!(offset.noise, Noise::sigmas(&[0.1, 0.2]).unwrap());
    assert!(offset.loss.as_ref().unwrap().erased().as_any().is::<Huber>());
    assert!(height.noise.is_default() && height.loss.is_none());
    assert_eq!(height.keys.iter().map(|k| k.as_str()).collect::<Vec<_>>(), ["x1", "h"]);
}

#[test]
fn all_errors_of_a_graph_are_told_at_once() {
    let text = r#"
[[variables]]
key = "x0"
value = { type = "plan", x = 0.0, y = 1 }
fixd = true

[[variables]]
key = "x1"
value = { type = "plane", x = "0.5", y = 1.0 }

[[variables]]
key = "x2"
value = { type = "plane", x = nan, y = 1.0 }

[[variables]]
key = "x3"
value = { type = "plane", x = 0.0, y = 1.0 }
fixed = ["x", "z"]

[[variables]]
key = "x3"
value = { type = "real", value = 2.0 }

[[variables]]
key = "h"
value = { type = "real", value = 2.0 }
fixed = "yes"

[[factors]]
keys = ["x0", "x9"]
factor = { type = "offset", measured = [0.5, 0.25], weight = 1 }

[[factors]]
keys = ["x3", "h"]
factor = { type = "offset", measured = [0.5, 0.25] }
noise = { sigmas = [0.1, 0.2, 0.3] }
loss = { type = "hubert" }

[[factors]]
keys = ["x3"]
factor = { type = "height" }
noise = { sigma = -1.0 }

[[factors]]
keys = ["x3", "x3"]
factor = { type = "offset", measured = [0.5] }

[[factors]]
factor = { type = "plane" }

[[factors]]
keys = ["h", 3]
factor = { type = "balance" }
sigma = 2.0

[[factors]]
keys = ["x3", "x3"]
factor = { type = "offset", measured = [0.5, 1] }

[solver]
"#;
    let losses = "`cauchy`, `constraint`, `dcs`, `fair`, `geman_mcclure`, `huber`, `l1`, `l2`, `tempered`, `tukey` and `welsch`";
    let expected = format!(
        "graph:4:18: unknown variable `plan` (did you mean `plane`? there are `plane` and `real`)\n\
         graph:5:1: unknown field `fixd` (did you mean `fixed`? there are `key`, `value`, `fixed` and `bounds`)\n\
         graph:9:31: expected a number, found the text \"0.5\"\n\
         graph:13:31: `nan` is not a finite number\n\
         graph:18:15: unknown direction `z` (there are `x` and `y`)\n\
         graph:21:7: variable `x3` is given twice; first given here: graph:16:7 (remove or rename one of them)\n\
         graph:27:9: expected true, false, or an array of directions of the tangent space, found the text \"yes\"\n\
         graph:30:15: unknown variable `x9` (there are `x0`, `x1`, `x2`, `x3` and `h`)\n\
         graph:31:53: unknown field `weight` (there is only `measured`)\n\
         graph:34:15: `offset` takes a variable of type `plane` here, `h` is of type `real`; \
         it is declared here: graph:25:7 (of type `plane`: `x3`)\n\
         graph:36:9: the noise has 3 rows, the residual 2\n\
         graph:37:17: unknown loss `hubert` (did you mean `huber`? there are {losses})\n\
         graph:40:8: `height` connects 2 variables, found 1 key\n\
         graph:42:9: a standard deviation must be a finite number above zero, got -1\n\
         graph:46:40: expected an array of 2, found 1 element\n\
         graph:48:1: missing field `keys`\n\
         graph:49:19: `plane` is a variable, not a factor (there are `balance`, `height` and `offset`)\n\
         graph:52:14: expected a text, found the number 3\n\
         graph:54:1: unknown field `sigma` (there are `keys`, `name`, `factor`, `noise`, `loss` and `each`)\n\
         graph:57:15: `offset` connects `x3` to itself (a factor's variables have to be different ones)\n\
         graph:60:2: unknown field `solver` (there are `variables` and `factors`)"
    );
    similar(&said(Format::Toml, text), &expected);
}

/// Compares line by line, so that a failure shows the line.
fn similar(said: &str, expected: &str) {
    for (said, expected) in said.lines().zip(expected.lines()) {
        assert_eq!(said, expected);
    }
    assert_eq!(said.lines().count(), expected.lines().count(), "{said}");
}

#[test]
fn json_and_yaml_point_at_the_same_mistakes() {
    let json = r#"{"variables": [
  {"key": "x0", "value": {"type": "plane", "x": 0, "y": 0}},
  {"key": "x0", "value": {"type": "plane", "x": 0, "y": 0}}],
 "factors": [
  {"keys": ["x0", "xO"], "factor": {"type": "offset", "measured": [1, "a"]}}]}"#;
    similar(
        &said(Format::Json, json),
        "graph:3:11: variable `x0` is given twice; first given here: graph:2:11 (remove or rename one of them)\n\
         graph:5:19: unknown variable `xO` (there is only `x0`)\n\
         graph:5:71: expected a number, found the text \"a\"",
    );
    let yaml = "
variables:
- {key: x0, value: {type: plane, x: 0, y: .inf}}
factors:
- keys: [x0, x0, x0]
  factor:
    type: offset
    measured: [1, 2]
  noise:
    information:
    - [1, 2]
    - [2, 1]
";
    similar(
        &said(Format::Yaml, yaml),
        "graph:3:43: `.inf` is not a finite number\n\
         graph:5:9: `offset` connects 2 variables, found 3 keys\n\
         graph:10:5: the matrix is not positive definite: its smallest eigenvalue is -1e0",
    );
}

#[test]
fn single_mistakes_are_said_alone() {
    assert_eq!(
        wrong("[[variables]]\nkey = \"h\"", "[[variables]]"),
        "graph:12:1: missing field `key`\ngraph:22:15: unknown variable `h` (there are `x0` and `x1`)"
    );
    assert_eq!(wrong(", \"h\"]", "]"), "graph:23:8: `height` connects 2 variables, found 1 key");
    assert_eq!(
        wrong("keys = [\"x1\", \"h\"]", "keys = []"),
        "graph:23:8: `height` connects variables, and no key is given"
    );
    assert_eq!(
        wrong("0.1, 0.2]", "0.1, 0.2], sigma = 1"),
        "graph:19:9: expected one of sigma, sigmas, covariance, information; got sigma and sigmas"
    );
    assert_eq!(wrong("scale = 2.0", "scale = 0"), "graph:20:34: expected a finite number above zero, got 0");
    assert_eq!(said(Format::Toml, "factors = []"), "graph:1:1: missing field `variables`");
    assert_eq!(said(Format::Json, "{\"variables\": 3}"), "graph:1:15: expected an array, found the number 3");
}

#[test]
fn the_nearest_of_many_variables_is_suggested() {
    let mut text = String::new();
    for i in 0..50 {
        text += &format!("[[variables]]\nkey = \"pose_{i}\"\nvalue = {{ type = \"real\", value = 1 }}\n");
    }
    text += "[[factors]]\nkeys = [\"pose7\"]\nfactor = { type = \"balance\" }\n";
    assert_eq!(said(Format::Toml, &text), "graph:152:9: unknown variable `pose7` (did you mean `pose_7`?)");
}

#[test]
fn every_format_is_written_to_be_read() {
    let (graph, values) = read(Format::Toml, GOOD).unwrap();
    let toml = write_graph(&graph, &values, Format::Toml).unwrap();
    assert!(
        toml.contains(
            "[[variables]]\nkey = \"x1\"\nvalue = { type = \"plane\", x = 0.5, y = 1.0 }\nfixed = [\"y\"]\n"
        ),
        "{toml}"
    );
    assert!(toml.contains("\nloss = { type = \"huber\", scale = 2.0 }\n"), "{toml}");
    let json = write_graph(&graph, &values, Format::Json).unwrap();
    assert_eq!(json.lines().count(), 11, "{json}");
    let empty = write_graph(&Graph::new(), &Values::new(), Format::Toml).unwrap();
    assert!(read(Format::Toml, &empty).unwrap().1.is_empty());
}

#[test]
fn a_variable_held_without_a_value_is_not_written() {
    let mut graph = Graph::new();
    graph.fix("x7");
    let error = write_graph(&graph, &Values::new(), Format::Json).unwrap_err();
    assert_eq!(error.to_string(), "the graph fixes or bounds `x7`, but there is no value for it");
}

#[test]
fn a_value_that_is_not_finite_is_not_written() {
    let mut values = Values::new();
    values.insert("h", Real { value: f64::INFINITY });
    let error = write_graph(&Graph::new(), &values, Format::Yaml).unwrap_err();
    assert_eq!(error.to_string(), "`variables[0].value.value` is inf: documents hold finite numbers only");
}

fn finite() -> impl Strategy<Value = f64> {
    any::<f64>().prop_filter("finite", |x| x.is_finite())
}

fn positive() -> impl Strategy<Value = f64> {
    prop_oneof![1e-3..1e3_f64, (-300.0..300.0_f64).prop_map(|e| 10.0_f64.powf(e))]
}

fn any_noise() -> impl Strategy<Value = Noise> {
    let matrix = || {
        (1e-3..1e3_f64, 1e-3..1e3_f64, -0.9..0.9_f64)
            .prop_map(|(a, b, r)| DMatrix::from_row_slice(2, 2, &[a * a, r * a * b, r * a * b, b * b]))
    };
    prop_oneof![
        Just(Noise::unit()),
        positive().prop_map(|s| Noise::sigma(s).unwrap()),
        [positive(), positive()].prop_map(|s| Noise::sigmas(&s).unwrap()),
        matrix().prop_map(|m| Noise::covariance(m).unwrap()),
        matrix().prop_map(|m| Noise::information(m).unwrap()),
        Just(Noise::sigma(0.5).unwrap().observing(&[true, false])),
    ]
}

prop_compose! {
    fn any_graph()(
        points in prop::collection::vec((finite(), finite(), 0..4_usize), 2..8),
        numbers in prop::collection::vec(finite(), 1..4),
        names in prop::collection::hash_set("\\PC{1,6}", 12),
        factors in prop::collection::vec((0..3_usize, 0..100_usize, 0..100_usize, [finite(), finite()], any_noise(), positive()), 0..10),
    ) -> (Graph, Values) {
        let names: Vec<String> = names.into_iter().collect();
        let (mut graph, mut values) = (Graph::new(), Values::new());
        for ((x, y, fixed), name) in points.iter().zip(&names) {
            values.insert(name.as_str(), Plane { x: *x, y: *y });
            match fixed {
                1 => graph.fix(name.as_str()),
                2 => graph.fix_directions(name.as_str(), &["y"]),
                _ => {}
            }
        }
        let real: Vec<&String> = names.iter().skip(points.len()).take(numbers.len()).collect();
        for (value, name) in numbers.iter().zip(&real) {
            values.insert(name.as_str(), Real { value: *value });
        }
        for (kind, a, b, measured, noise, scale) in factors {
            let first = names[a % points.len()].as_str();
            let second = names[(a + 1 + b % (points.len() - 1)) % points.len()].as_str();
            match kind {
                0 => { graph.add([first, second], Offset { measured }).noise(noise).loss(Cauchy::new(scale).unwrap()); }
                1 => { graph.add([first, real[b % real.len()]], Height { unit: Unit::Scaled(measured[0]) }); }
                _ => { graph.add(real.iter().map(|n| n.as_str()), Balance {}).noise(Noise::sigma(scale).unwrap()); }
            }
        }
        (graph, values)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_000))]

    #[test]
    fn graphs_round_trip_to_the_last_bit((graph, values) in any_graph()) {
        prop_assert_eq!(graph.check(&values), vec![]);
        for format in Format::ALL {
            let text = write_graph(&graph, &values, format).unwrap();
            let (graph_again, values_again) = read(format, &text).map_err(|e| TestCaseError::fail(format!("{e}\n{text}")))?;
            prop_assert_eq!(format!("{values:?}"), format!("{values_again:?}"));
            prop_assert_eq!(format!("{:?}", graph.factors()), format!("{:?}", graph_again.factors()));
            prop_assert_eq!(graph.fixed(), graph_again.fixed());
            // Debug prints a float with all of its bits; writing again also proves this for the noise
            prop_assert_eq!(write_graph(&graph_again, &values_again, format).unwrap(), text);
        }
    }

    #[test]
    fn no_graph_document_panics(
        format in prop::sample::select(Format::ALL.to_vec()),
        at in 0.0..1.0_f64,
        length in 0..30_usize,
        by in prop_oneof![Just(String::new()), "[a-z0-9\\[\\]{}=:\", .-]{0,12}"],
    ) {
        let (graph, values) = read(Format::Toml, GOOD).unwrap();
        let text = write_graph(&graph, &values, format).unwrap();
        let at = (at * text.len() as f64) as usize;
        let end = (at + length).min(text.len());
        if let (Some(head), Some(tail)) = (text.get(..at), text.get(end..)) {
            let _ = read(format, &format!("{head}{by}{tail}"));
        }
    }
}
