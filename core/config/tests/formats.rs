//! One document in three formats, and the errors of invalid texts.

use manifactor_config::{Document, Format, MAX_DEPTH, Node, Value};

fn parse(format: Format, text: &str) -> Node {
    match Document::parse("file", text, format) {
        Ok(document) => document.root().clone(),
        Err(errors) => panic!("{errors}"),
    }
}

fn errors(format: Format, text: &str) -> String {
    match Document::parse("file", text, format) {
        Ok(document) => panic!("read: {:?}", document.root()),
        Err(errors) => errors.to_string(),
    }
}

/// Collects every value with the text at its position.
fn places(node: &Node, found: &mut Vec<String>) {
    match &node.value {
        Value::Array(items) => items.iter().for_each(|item| places(item, found)),
        Value::Table(table) => table.iter().for_each(|(name, field)| {
            assert_eq!(field.key.text().trim_matches('"'), name);
            found.push(format!("{}: {}", field.key.text().trim_matches('"'), field.key.line()));
            places(&field.node, found);
        }),
        _ => found.push(node.place.text().to_owned()),
    }
}

const TOML: &str = "
# größe
keys = ['x0', 'ö']
[[factors]]
noise = { sigma = 0.25, on = true }
name = \"x\"
[[factors]]
name = 7
";

const JSON: &str = r#"{
  "keys": ["x0",
    "ö"], "factors": [
    {"noise": {"sigma": 0.25, "on": true}, "name": "x"},
    {"name": 7}
  ]}"#;

const YAML: &str = "
# größe
keys: [x0, ö]   # é
factors:
- noise:
    sigma: 0.25
    on: true
  name: x
- name: 7
";

#[test]
fn three_formats_say_the_same() {
    let json = parse(Format::Json, JSON).to_json().unwrap();
    assert_eq!(parse(Format::Toml, TOML).to_json().unwrap(), json);
    assert_eq!(parse(Format::Yaml, YAML).to_json().unwrap(), json);
    assert_eq!(json, serde_json::from_str::<serde_json::Value>(JSON).unwrap());
}

#[test]
fn every_value_knows_its_place() {
    for (format, text, quote, lines) in [
        (Format::Toml, TOML, "'", [3, 4, 5, 5, 5, 6, 8]),
        (Format::Json, JSON, "\"", [2, 3, 4, 4, 4, 4, 5]),
        (Format::Yaml, YAML, "", [3, 4, 5, 6, 7, 8, 9]),
    ] {
        let mut found = Vec::new();
        places(&parse(format, text), &mut found);
        let [keys, factors, noise, sigma, on, name, last] = lines;
        let x = if format == Format::Yaml { "x".to_owned() } else { "\"x\"".to_owned() };
        let expected = [
            format!("keys: {keys}"),
            format!("{quote}x0{quote}"),
            format!("{quote}ö{quote}"),
            format!("factors: {factors}"),
            format!("noise: {noise}"),
            format!("sigma: {sigma}"),
            "0.25".into(),
            format!("on: {on}"),
            "true".into(),
            format!("name: {name}"),
            x,
            format!("name: {last}"),
            "7".into(),
        ];
        assert_eq!(found, expected, "{format}");
    }
}

#[test]
fn numbers_are_read_to_the_last_bit() {
    for text in ["0.1", "1e-320", "5e-324", "1.7976931348623157e308", "2.2250738585072011e-308", "-0.0"] {
        let exact: f64 = text.parse().unwrap();
        for (format, document) in [
            (Format::Toml, format!("x = {text}")),
            (Format::Json, format!("{{\"x\": {text}}}")),
            (Format::Yaml, format!("x: {text}")),
        ] {
            let json = parse(format, &document).to_json().unwrap();
            assert_eq!(json["x"].as_f64().unwrap().to_bits(), exact.to_bits(), "{format} {text}");
        }
    }
}

#[test]
fn keys_given_twice_point_to_both() {
    let help = "(remove or rename one of them)";
    assert_eq!(
        errors(Format::Toml, "a = 1\n[b]\nc = 1\nd = { c = 2 }\nc = 3\n"),
        format!("file:5:1: key `c` is given twice; first given here: file:3:1 {help}")
    );
    assert_eq!(
        errors(Format::Json, "{\"a\": 1,\n \"a\": 2}"),
        format!("file:2:2: key `a` is given twice; first given here: file:1:2 {help}")
    );
    assert_eq!(
        errors(Format::Yaml, "a: 1\nb:\n  a: 1\n  a: 2\n"),
        format!("file:4:3: key `a` is given twice; first given here: file:3:3 {help}")
    );
}

#[test]
fn all_syntax_errors_of_toml_are_told_at_once() {
    let text = errors(Format::Toml, "a = \nb = 1\nc = [1, 2\n");
    assert!(text.starts_with("file:1:"), "{text}");
    assert!(text.contains("\nfile:3:") || text.contains("\nfile:4:"), "{text}");
    assert!(
        errors(Format::Toml, "n = 99999999999999999999")
            .starts_with("file:1:5: not valid TOML: the whole number")
    );
}

#[test]
fn json_is_strict() {
    for (text, message) in [
        ("", "file:1:1: not valid JSON: the document is empty"),
        ("{\"a\": 1,}", "file:1:8: not valid JSON: trailing commas are not allowed"),
        ("{\n// no\n}", "file:2:1: not valid JSON: comments are not allowed"),
        ("{a: 1}", "file:1:2: not valid JSON: expected string for object property"),
        ("{\"a\": NaN}", "file:1:7: not valid JSON: unexpected token"),
        ("{\"a\": \"x\ny\"}", "file:1:8: not valid JSON: control character"),
        ("{\"a\": 01}", "file:1:"),
        ("[1] [2]", "file:1:5: not valid JSON: text cannot contain more than one JSON value"),
    ] {
        let said = errors(Format::Json, text);
        assert!(said.starts_with(message), "{text}: {said}");
    }
}

#[test]
fn yaml_follows_the_core_schema() {
    let json =
        parse(Format::Yaml, "{a: no, b: 0x10, c: 1e3, d: ~, e: '1', f: inf, 1: 0o17, g: -0, h: !!str 2}");
    assert_eq!(
        json.to_json().unwrap(),
        serde_json::json!({"a": "no", "b": 16, "c": 1000.0, "d": null, "e": "1", "f": "inf", "1": 15, "g": -0.0, "h": "2"})
    );
    assert_eq!(parse(Format::Yaml, "# nothing\n").value, Value::Null);
}

#[test]
fn yaml_refuses_what_documents_do_not_need() {
    for (text, message) in [
        ("a: 1\n---\nb: 2\n", "file:2:1: not valid YAML: a second document in one file"),
        ("a: !factor {}\n", "file:1:4: not valid YAML: the tag !factor has no meaning here"),
        ("[a]: 1\n", "file:1:1: not valid YAML: a key has to be a scalar"),
        ("a: &x [*x]\n", "file:1:8: not valid YAML: "),
        ("a: *y\n", "file:1:4: not valid YAML: "),
        ("a: \u{0}b", "file:1:4: not valid YAML: a NUL character"),
        ("é: [1, 2\nb: 1\n", "file:"),
    ] {
        let said = errors(Format::Yaml, text);
        assert!(said.starts_with(message), "{text}: {said}");
    }
}

#[test]
fn aliases_are_copied_up_to_a_limit() {
    let node = parse(Format::Yaml, "base: &b {sigma: 1}\nuse: [*b, *b]\n");
    assert_eq!(node.to_json().unwrap()["use"][1]["sigma"], 1);
    let mut laughs = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n".to_owned();
    for i in 1..12 {
        let of = vec![format!("*a{}", i - 1); 10].join(", ");
        laughs += &format!("a{i}: &a{i} [{of}]\n");
    }
    assert!(errors(Format::Yaml, &laughs).contains("the aliases stand for more than"));
}

#[test]
fn depth_is_limited() {
    let deep = |n: usize| ("[".repeat(n) + &"]".repeat(n)).replace("[]", "[1]");
    for depth in [MAX_DEPTH + 1, 500, 5_000, 200_000] {
        for (format, text) in [
            (Format::Toml, format!("a = {}", deep(depth))),
            (Format::Json, deep(depth)),
            (Format::Json, "{\"a\":".repeat(depth)),
            (Format::Yaml, deep(depth)),
            (Format::Yaml, (0..depth.min(2_000)).map(|i| " ".repeat(i) + "a:\n").collect()),
            (Format::Yaml, "- ".repeat(depth)),
        ] {
            let said = errors(format, &text);
            assert!(said.len() < 20_000, "{format}");
        }
    }
    for (format, text) in [
        (Format::Toml, format!("a = {}", deep(MAX_DEPTH - 1))),
        (Format::Json, deep(MAX_DEPTH)),
        (Format::Yaml, deep(MAX_DEPTH)),
    ] {
        parse(format, &text);
    }
    assert!(errors(Format::Json, &deep(MAX_DEPTH + 1)).ends_with("nested more than 64 levels deep"));
}

#[test]
fn dotted_keys_do_not_overflow_the_stack() {
    let dots = vec!["a"; 79].join(".");
    let text = format!("{dots} = {{ ").repeat(75) + "b = 1" + &" }".repeat(75);
    assert!(errors(Format::Toml, &text).contains("nested more than 64 levels deep"));
}
