use crate::{folder, manifactor, path};

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
    manifactor(&format!("solve {graph} --freeze y1")).ended(2).complains("no variable is called so");
}

#[test]
fn graphs_are_drawn() {
    let files = folder(&[("graph.toml", GRAPH)]);
    let graph = path(&files, "graph.toml");
    let dot = manifactor(&format!("graph {graph} --dot")).ended(0).stdout;
    assert!(dot.starts_with("graph factors {") && dot.contains("\"factor 0\" -- \"x1\""), "{dot}");
    let svg = manifactor(&format!("graph {graph} --svg")).ended(0).stdout;
    assert!(
        svg.starts_with("<svg") && svg.contains(">x1</text>") && svg.trim_end().ends_with("</svg>"),
        "{svg}"
    );
    manifactor(&format!("graph {graph} --svg --dot")).ended(2);
}
