use crate::{fed, folder, manifactor, path};
use std::path::Path;

const GRAPH: &str = r#"
[[variables]]
key = "x0"
value = { type = "se2", translation = [0.0, 0.0], angle = 0.0 }
fixed = true

[[variables]]
key = "x1"
value = { type = "se2", translation = [0.8, 0.2], angle = 0.1 }

[[factors]]
keys = ["x0", "x1"]
factor = { type = "between_se2", relative = { translation = [1.0, 0.0], angle = 0.0 } }
noise = { sigma = 0.1 }

[[factors]]
keys = ["x1"]
factor = { type = "prior_se2", value = { translation = [1.4, 0.0], angle = 0.0 } }
noise = { sigma = 0.1 }
"#;

#[test]
fn factors_are_shown_before_and_after_a_solve() {
    let files = folder(&[("graph.toml", GRAPH)]);
    let graph = path(&files, "graph.toml");
    let json = manifactor(&format!("graph {graph} --solve --json")).ended(0).json();
    assert_eq!(json["factors_by_key"]["x1"], serde_json::json!([0, 1]));
    assert!((json["factors"][0]["after"]["cost"].as_f64().unwrap() - 2.0).abs() < 1e-6, "{json}");
    assert!(json["cost"]["before"].as_f64() > json["cost"]["after"].as_f64());
    let text = manifactor(&format!("graph {graph}")).ended(0).stdout;
    assert!(text.contains("1 prior_se2") && text.contains("cost before"), "{text}");
}

#[test]
fn what_if_a_variable_is_held_or_a_factor_left_out() {
    let files = folder(&[("graph.toml", GRAPH)]);
    let graph = path(&files, "graph.toml");
    let cost = |arguments: &str| {
        let json = manifactor(&format!("solve {graph} {arguments} --json")).ended(0).json();
        json["final_cost"].as_f64().unwrap()
    };
    assert!((cost("") - 4.0).abs() < 1e-6);
    assert!(cost("--drop 1") < 1e-9 && cost("--drop prior_se2") < 1e-9);
    assert!(cost("--freeze x1.x") > 4.0);
    manifactor(&format!("solve {graph} --freeze x1")).ended(2).complains("all are held fixed");
    manifactor(&format!("solve {graph} --drop prior_se3")).ended(2).complains("did you mean `prior_se2`?");
    manifactor(&format!("solve {graph} --drop 7")).ended(2).complains("the graph has 2 factors");
    manifactor(&format!("solve {graph} --freeze x1.z")).ended(2).complains("its directions are x, y, theta");
    manifactor(&format!("solve {graph} --freeze y1")).ended(2).complains("the graph has no such variable");
}

#[test]
fn graphs_are_drawn() {
    let files = folder(&[("graph.toml", GRAPH)]);
    let graph = path(&files, "graph.toml");
    let dot = manifactor(&format!("graph {graph} --dot")).ended(0).stdout;
    assert!(dot.starts_with("graph factors {") && dot.contains("\"factor 0\" -- \"x1\""), "{dot}");
    manifactor(&format!("plot {graph}")).ended(2).complains("the pictures of a graph need --out");
    let out = path(&files, "pictures");
    assert!(
        manifactor(&format!("plot {graph} --out {out}")).ended(0).stdout.contains("2 pictures written to")
    );
    let svg = std::fs::read_to_string(format!("{out}/graph.svg")).unwrap();
    // a small graph has the names of its variables, in a plane there is no view from the side
    assert!(svg.starts_with("<svg") && svg.contains(">x1</text>"), "{svg}");
    assert_eq!(std::fs::read(format!("{out}/graph.png")).unwrap().get(1..4), Some(&b"PNG"[..]));
    assert!(!Path::new(&out).join("graph_side.svg").exists());
    manifactor("plot nowhere.g2o --out pictures").ended(3).complains("nowhere.g2o");
    // without names and with both views: 120 poses on a helix
    let (helix, out) = ("examples/python/helix.g2o", path(&files, "helix"));
    manifactor(&format!("plot {helix} --out {out} --theme dark")).ended(0);
    let svg = std::fs::read_to_string(format!("{out}/graph_side.svg")).unwrap();
    assert!(svg.contains("estimate") && !svg.contains(">x1</text>"), "{svg}");
}

#[test]
fn the_most_expensive_factors_are_listed_first() {
    let files = folder(&[("graph.toml", GRAPH)]);
    let graph = path(&files, "graph.toml");
    let numbers = |options: &str| -> Vec<u64> {
        let json = manifactor(&format!("graph {graph} --json {options}")).ended(0).json();
        json["factors"].as_array().unwrap().iter().map(|row| row["number"].as_u64().unwrap()).collect()
    };
    assert_eq!(numbers(""), [0, 1]);
    assert_eq!(numbers("--sort cost"), [1, 0]);
    assert_eq!(numbers("--sort cost --top 1"), [1]);
    manifactor(&format!("graph {graph} --top 1 --dot")).ended(2);
}

#[test]
fn a_graph_or_a_run_comes_from_standard_input() {
    let cost = |ran: crate::Ran| ran.ended(0).json()["final_cost"].as_f64().unwrap();
    let files = folder(&[("graph.toml", GRAPH)]);
    let graph = path(&files, "graph.toml");
    let expected = cost(manifactor(&format!("solve {graph} --json")));
    assert_eq!(cost(fed("solve - --json", GRAPH)), expected);
    // as JSON, and as a pose graph, which is recognized by its first line
    let as_json = path(&files, "graph.json");
    manifactor(&format!("solve {graph} --out {as_json}")).ended(0);
    fed("solve - --json", &std::fs::read_to_string(&as_json).unwrap()).ended(0);
    assert_eq!(cost(fed("solve - --json", "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n")), 0.0);
    assert!(fed("check -", "source = { type = 'simulated' }").ended(0).stdout.contains("A run of 1 variant"));
    fed("check -", "source = { type = 'simulatd' }").ended(2).complains("standard input:1");
    fed("solve -", "nothing of the kind").ended(2);
}
