use crate::harness::{Case, account, text};

const GRAPH: &str = r#"
[[variables]]
key = "x0"
value = { type = "se2", translation = [0.0, 0.0], angle = 0.0 }
fixed = true

[[variables]]
key = "x1"
value = { type = "se2", translation = [3.0, 1.0], angle = 0.4 }

[[factors]]
keys = ["x0", "x1"]
factor = { type = "between_se2", relative = { translation = [1.0, 0.0], angle = 0.0 } }
noise = { sigma = 0.1 }
"#;

/// The graph with one change.
fn change(name: &'static str, from: &str, to: &str) -> Case {
    assert!(GRAPH.contains(from), "{from}");
    text(name, GRAPH.replacen(from, to, 1))
}

fn noise(name: &'static str, noise: &str) -> Case {
    change(name, "sigma = 0.1", noise)
}

/// The graph with bounds of `x1`, which is a pose or a point.
fn bounds(name: &'static str, bounds: &str, of: &str) -> Case {
    let pose = "value = { type = \"se2\", translation = [3.0, 1.0], angle = 0.4 }";
    let value = if of == "se2" { pose } else { "value = { type = \"point2\", position = [3.0, 1.0] }" };
    change(name, pose, &format!("{value}\nbounds = {bounds}"))
}

#[test]
fn documents_that_cannot_be_read() {
    let cases = vec![
        text("empty", ""),
        text("a word", "graph"),
        ("binary", vec![0, 1, 2, 255, 254]),
        ("Latin-1", [GRAPH.as_bytes(), b"# caf\xe9"].concat()),
        ("byte order mark", [b"\xef\xbb\xbf", GRAPH.as_bytes()].concat()),
        text("carriage returns", GRAPH.replace('\n', "\r\n")),
        text("cut short", &GRAPH[..GRAPH.len() / 2]),
        change("bracket left open", "[3.0, 1.0]", "[3.0, 1.0"),
        change("field twice", "angle = 0.4", "angle = 0.4, angle = 0.5"),
        change("number too large for f64", "angle = 0.4", "angle = 1e999"),
        change("number too large for i64", "angle = 0.4", "angle = 99999999999999999999"),
        change("a date", "angle = 0.4", "angle = 2020-01-01"),
        text("ten thousand brackets", format!("x = {}", "[".repeat(10_000))),
    ];
    insta::assert_snapshot!(account("graph.toml", "solve FILE", cases));
}

#[test]
fn values_that_are_wrong() {
    let quaternion = |q: &str| format!("{{ type = \"se3\", rotation = {q}, translation = [0.0, 0.0, 0.0] }}");
    let space =
        |name, q: &str| text(name, format!("[[variables]]\nkey = \"x\"\nvalue = {}\n", quaternion(q)));
    let quadric = |name, axes: &str| {
        let value = format!(
            "{{ type = \"dual_quadric\", rotation = [0.0, 0.0, 0.0, 1.0], translation = [0.0, 0.0, 0.0], semi_axes = {axes} }}"
        );
        text(name, format!("[[variables]]\nkey = \"q\"\nvalue = {value}\n"))
    };
    let cases = vec![
        change("not a number", "angle = 0.4", "angle = nan"),
        change("infinite", "[3.0, 1.0]", "[inf, 1.0]"),
        change("text for a number", "angle = 0.4", "angle = \"north\""),
        change("one entry too few", "[3.0, 1.0]", "[3.0]"),
        change("one entry too many", "[3.0, 1.0]", "[3.0, 1.0, 2.0]"),
        change("no value", "value = { type = \"se2\", translation = [3.0, 1.0], angle = 0.4 }", ""),
        change("no type", "{ type = \"se2\", translation = [3.0", "{ translation = [3.0"),
        change("unknown type", "type = \"se2\", translation = [3.0", "type = \"se5\", translation = [3.0"),
        change(
            "type of a factor",
            "type = \"se2\", translation = [3.0",
            "type = \"between_se2\", translation = [3.0",
        ),
        change("unknown field", "angle = 0.4", "angel = 0.4"),
        change("key twice", "key = \"x1\"", "key = \"x0\""),
        change("key empty", "key = \"x1\"", "key = \"\""),
        change("key a number", "key = \"x1\"", "key = 1"),
        change("no key", "key = \"x1\"", ""),
        change("unknown direction held", "fixed = true", "fixed = [\"z\"]"),
        change("held by a word", "fixed = true", "fixed = \"yes\""),
        bounds("bounds of a pose", "{ x = { min = 0.0 } }", "se2"),
        bounds("bounds of an unknown direction", "{ z = { min = 0.0 } }", "point2"),
        bounds("bounds without a limit", "{ x = {} }", "point2"),
        bounds("bounds in the wrong order", "{ x = { min = 2.0, max = 1.0 } }", "point2"),
        bounds("bounds as an array", "{ x = [0.0, 1.0] }", "point2"),
        bounds("value out of bounds", "{ x = { min = 3.5, max = 4.0 } }", "point2"),
        space("quaternion zero", "[0.0, 0.0, 0.0, 0.0]"),
        space("quaternion not of length one", "[0.0, 0.0, 0.0, 2.0]"),
        space("quaternion not a number", "[0.0, 0.0, 0.0, nan]"),
        quadric("semi-axis zero", "[0.1, 0.0, 0.2]"),
        quadric("semi-axis negative", "[0.1, -0.3, 0.2]"),
        quadric("semi-axis infinite", "[0.1, inf, 0.2]"),
    ];
    insta::assert_snapshot!(account("graph.toml", "solve FILE", cases));
}

#[test]
fn factors_that_are_wrong() {
    let factor = "factor = { type = \"between_se2\", relative = { translation = [1.0, 0.0], angle = 0.0 } }";
    let cases = vec![
        change("key that is not there", "[\"x0\", \"x1\"]", "[\"x0\", \"x2\"]"),
        change("one variable twice", "[\"x0\", \"x1\"]", "[\"x1\", \"x1\"]"),
        change("one key too few", "[\"x0\", \"x1\"]", "[\"x0\"]"),
        change("no keys", "[\"x0\", \"x1\"]", "[]"),
        change("keys as one text", "[\"x0\", \"x1\"]", "\"x0\""),
        change("unknown factor", "between_se2", "betwen_se2"),
        change(
            "factor of another space",
            factor,
            "factor = { type = \"between_se3\", relative = { rotation = [0, 0, 0, 1], translation = [1.0, 0.0, 0.0] } }",
        ),
        change("no factor", factor, ""),
        change("factor without its fields", factor, "factor = { type = \"between_se2\" }"),
        change("factor with a field too many", "angle = 0.0 } }", "angle = 0.0 }, weight = 2.0 }"),
        change("measurement not a number", "translation = [1.0, 0.0]", "translation = [nan, 0.0]"),
        noise("sigma zero", "sigma = 0.0"),
        noise("sigma negative", "sigma = -0.1"),
        noise("sigma not a number", "sigma = nan"),
        noise("sigma infinite", "sigma = inf"),
        noise("sigma of words", "sigma = \"small\""),
        noise("sigmas too few", "sigmas = [0.1, 0.1]"),
        noise("two kinds of noise", "sigma = 0.1, sigmas = [0.1, 0.1, 0.1]"),
        noise("unknown kind of noise", "stddev = 0.1"),
        noise("covariance not symmetric", "covariance = [[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]"),
        noise("covariance indefinite", "covariance = [[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]]"),
        noise("covariance not square", "covariance = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]"),
        noise("covariance of another size", "covariance = [[1.0, 0.0], [0.0, 1.0]]"),
        noise("information singular", "information = [[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]"),
        noise("nothing observed", "sigma = 0.1, observed = [false, false, false]"),
        noise("observed rows of another number", "sigma = 0.1, observed = [true]"),
        change(
            "unknown loss",
            "noise = { sigma = 0.1 }",
            "noise = { sigma = 0.1 }\nloss = { type = \"hubber\" }",
        ),
        change(
            "loss of a negative width",
            "noise = { sigma = 0.1 }",
            "noise = { sigma = 0.1 }\nloss = { type = \"huber\", scale = -1.0 }",
        ),
        change(
            "formula that is wrong",
            factor,
            "factor = { type = \"expression\", variables = { a = \"se2\", b = \"se2\" }, residual = [\"norm(position(a) - posotion(b))\"] }",
        ),
        change(
            "formula of nothing",
            factor,
            "factor = { type = \"expression\", variables = { a = \"se2\", b = \"se2\" }, residual = [] }",
        ),
        change(
            "formula a hundred thousand brackets deep",
            factor,
            &format!(
                "factor = {{ type = \"expression\", variables = {{ a = \"se2\", b = \"se2\" }}, residual = [\"{}\"] }}",
                "(".repeat(100_000)
            ),
        ),
    ];
    insta::assert_snapshot!(account("graph.toml", "solve FILE", cases));
}

#[test]
fn graphs_that_cannot_be_solved() {
    let lonely =
        "\n[[variables]]\nkey = \"x9\"\nvalue = { type = \"se2\", translation = [0.0, 0.0], angle = 0.0 }\n";
    let solver = |name, solver: &str| text(name, format!("solver = {solver}\n{GRAPH}"));
    let cases = vec![
        change("no prior", "fixed = true", ""),
        text("a variable without a factor", format!("{GRAPH}{lonely}")),
        change("everything held", "angle = 0.4 }", "angle = 0.4 }\nfixed = true"),
        text("variables only", lonely),
        text(
            "factors only",
            GRAPH.split_once("[[factors]]").map(|(_, f)| format!("[[factors]]{f}")).unwrap(),
        ),
        change("weights beyond all bounds", "sigma = 0.1", "sigma = 1e-200"),
        change("measurement beyond all bounds", "translation = [1.0, 0.0]", "translation = [1e200, 0.0]"),
        text("unknown field", format!("{GRAPH}\n[[facters]]\n")),
        solver("unknown solver", "{ type = \"newton\" }"),
        solver("solver of words", "\"fast\""),
        solver(
            "negative number of iterations",
            "{ type = \"gauss_newton\", stop = { max_iterations = -1 } }",
        ),
        solver("no iterations", "{ type = \"gauss_newton\", stop = { max_iterations = 0 } }"),
        solver("tolerance below zero", "{ type = \"auto\", stop = { relative_cost = -1e-9 } }"),
        solver("tolerance not a number", "{ type = \"auto\", stop = { gradient = nan } }"),
        solver("negative damping", "{ type = \"levenberg_marquardt\", initial_lambda = -1.0 }"),
        solver("damping that does not fall", "{ type = \"levenberg_marquardt\", decrease = 0.5 }"),
        solver("diagonal upside down", "{ type = \"levenberg_marquardt\", diagonal = [2.0, 1.0] }"),
        solver("diagonal not a number", "{ type = \"levenberg_marquardt\", diagonal = [nan, 1.0] }"),
        solver("damping not a number", "{ type = \"levenberg_marquardt\", initial_lambda = nan }"),
        solver(
            "ordering of what is not there",
            "{ type = \"gauss_newton\", linear = { ordering = { first = [\"se9\"] } } }",
        ),
        solver("no memory", "{ type = \"gauss_newton\", linear = { memory_gib = 0.0 } }"),
    ];
    insta::assert_snapshot!(account("graph.toml", "solve FILE", cases));
}
