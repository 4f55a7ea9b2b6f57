//! `docs/least-squares.md`: the document has the certified parameters as its solution.
use super::block;
use crate::{folder, manifactor, path};

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
