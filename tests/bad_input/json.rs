use crate::harness::{Case, account, text};

const GRAPH: &str = r#"{"variables": [{"key": "x0", "value": {"type": "se2", "translation": [0, 0], "angle": 0}, "fixed": true},
  {"key": "x1", "value": {"type": "se2", "translation": [3, 1], "angle": 0.4}}],
 "factors": [{"keys": ["x0", "x1"], "factor": {"type": "between_se2", "relative": {"translation": [1, 0], "angle": 0}}}]}"#;

fn change(name: &'static str, from: &str, to: &str) -> Case {
    assert!(GRAPH.contains(from), "{from}");
    text(name, GRAPH.replacen(from, to, 1))
}

#[test]
fn json_documents() {
    let cases = vec![
        text("empty", ""),
        text("null", "null"),
        text("a number", "12"),
        text("an array", "[]"),
        text("cut short", &GRAPH[..GRAPH.len() - 20]),
        text("two documents", format!("{GRAPH}\n{GRAPH}")),
        change("comma at the end", "\"fixed\": true}", "\"fixed\": true,}"),
        change("NaN", "0.4", "NaN"),
        change("Infinity", "0.4", "-Infinity"),
        change("too large for f64", "0.4", "1e999"),
        change("leading zero", "0.4", "00.4"),
        change("field twice", "\"angle\": 0.4", "\"angle\": 0.4, \"angle\": 0.5"),
        change("single quotes", "\"x1\"", "'x1'"),
        change("half a surrogate pair", "\"x1\"", "\"\\ud800\""),
        change("control character in a text", "\"x1\"", "\"x\u{1}1\""),
        change("bad escape", "\"x1\"", "\"\\q\""),
        text("a hundred thousand brackets", "[".repeat(100_000)),
        text("a hundred thousand braces", "{\"a\":".repeat(100_000)),
        ("byte order mark", [b"\xef\xbb\xbf", GRAPH.as_bytes()].concat()),
        ("Latin-1", [b"{\"caf\xe9\": 1}".as_slice()].concat()),
    ];
    insta::assert_snapshot!(account("graph.json", "solve FILE", cases));
}
