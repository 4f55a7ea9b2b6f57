//! `docs/least-squares.md`: the document has the certified parameters as its solution.
use super::block;
use crate::{folder, manifactor, path};

/// Solves the graph, and returns its text and its report in JSON.
fn solved(name: &str, document: &str) -> (String, serde_json::Value) {
    let folder = folder(&[(name, document)]);
    let graph = path(&folder, name);
    let text = manifactor(&format!("solve {graph}")).ended(0).stdout;
    let json = manifactor(&format!("solve {graph} --covariances --json")).ended(0).stdout;
    (text, serde_json::from_str(&json).unwrap())
}

#[test]
fn a_curve_is_fitted_in_a_document_of_ten_lines() {
    let document = block("least-squares.md", "toml", "each.factor");
    assert!(document.lines().count() <= 11, "{document}");
    let folder = folder(&[("misra1a.toml", &document)]);
    let graph = path(&folder, "misra1a.toml");
    let ran = manifactor(&format!("solve {graph} --covariances=b1 --json")).ended(0);
    let report: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(report["factors"], 14, "{report}");
    let solved = path(&folder, "solved.json");
    manifactor(&format!("solve {graph} -o {solved}")).ended(0);
    let solved: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(solved).unwrap()).unwrap();
    for (place, certified) in [238.942_129_18, 5.501_564_318_1e-4].into_iter().enumerate() {
        let found = solved["variables"][place]["value"]["position"][0].as_f64().unwrap();
        assert!((found / certified - 1.0).abs() < 1e-8, "{found} {certified}");
    }
}

#[test]
fn a_bound_holds_the_fit() {
    let (text, report) = solved("bounded.toml", &block("least-squares.md", "toml", "max = 200.0"));
    assert!(text.contains("b1.x is at its maximum, 200 (multiplier "), "{text}");
    let [bound] = &report["active_bounds"].as_array().unwrap()[..] else { panic!("{report}") };
    assert_eq!((&bound["key"], &bound["side"]), (&"b1".into(), &"max".into()));
    assert_eq!(report["covariances"][0]["covariance"][0][0], 0.0);
    assert!(report["covariances"][1]["covariance"][0][0].as_f64().unwrap() > 0.0);
}

#[test]
fn a_constraint_is_satisfied() {
    let (text, report) = solved("constrained.toml", &block("least-squares.md", "toml", "\"constraint\""));
    assert!(text.contains("constraint 13 expression (b1, b2): multiplier "), "{text}");
    assert!(report["constraints"][0]["residual"][0].as_f64().unwrap().abs() < 1e-9, "{report}");
    let [b1, b2] = ["b1", "b2"].map(|key| report["values"][key]["position"][0].as_f64().unwrap());
    assert!((b1 * (1.0 - (-b2 * 760.0).exp()) - 81.78).abs() < 1e-9);
}
