use crate::harness::{Case, account, text};

const GRAPH: &str = "variables:
  - key: x0
    value: { type: se2, translation: [0, 0], angle: 0 }
    fixed: true
  - key: x1
    value: { type: se2, translation: [3, 1], angle: 0.4 }
factors:
  - keys: [x0, x1]
    factor: { type: between_se2, relative: { translation: [1, 0], angle: 0 } }
";

fn change(name: &'static str, from: &str, to: &str) -> Case {
    assert!(GRAPH.contains(from), "{from}");
    text(name, GRAPH.replacen(from, to, 1))
}

/// Ten names, each nine times the previous one: a billion copies of the first.
fn laughs() -> String {
    let line = |i: usize| format!("a{i}: &a{i} [{}]\n", vec![format!("*a{}", i - 1); 9].join(", "));
    "a0: &a0 [lol]\n".to_owned() + &(1..10).map(line).collect::<String>()
}

#[test]
fn yaml_documents() {
    let cases = vec![
        text("empty", ""),
        text("a word", "graph"),
        text("cut short", &GRAPH[..GRAPH.len() - 10]),
        text("a billion laughs", laughs()),
        text("a name within itself", "variables: &a [*a]\n"),
        text("unknown name", "variables: *nothing\n"),
        text("two documents", format!("{GRAPH}---\n{GRAPH}")),
        text("foreign tag", "variables: !!python/object:os.system [ls]\n"),
        text("merge", format!("base: &b {{ a: 1 }}\nother: {{ <<: *b }}\n{GRAPH}")),
        change("tab for spaces", "  - key: x1", "\t- key: x1"),
        change("field twice", "angle: 0.4", "angle: 0.4, angle: 0.5"),
        change("not a number", "angle: 0.4", "angle: .nan"),
        change("infinite", "angle: 0.4", "angle: .inf"),
        change("yes for a number", "angle: 0.4", "angle: yes"),
        change("number for a key", "key: x1", "key: 1"),
        change("key of another type", "{ type: se2, translation: [3", "{ ? [a] : 1, translation: [3"),
        text("ten thousand brackets", "[".repeat(10_000)),
        ("byte order mark", [b"\xef\xbb\xbf", GRAPH.as_bytes()].concat()),
        ("binary", vec![0, 1, 2, 255]),
    ];
    insta::assert_snapshot!(account("graph.yaml", "solve FILE", cases));
}
