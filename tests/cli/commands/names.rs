use crate::manifactor;

#[test]
fn all_kinds_are_listed_and_one_on_request() {
    let all = manifactor("list").ended(0).stdout;
    for name in ["between_se3", "dual_quadric", "cauchy", "gauss_newton", "simulated", "svd"] {
        assert!(all.contains(name), "{name}");
    }
    let losses = manifactor("list losses --json").ended(0).json();
    let losses = losses.as_array().unwrap();
    assert!(losses.len() >= 9 && losses.iter().all(|l| l["kind"] == "loss"), "{losses:?}");
    manifactor("list facters").ended(2).complains("did you mean `factor`?");
}

#[test]
fn every_name_is_explained() {
    let all = manifactor("list --json").ended(0).json();
    for entry in all.as_array().unwrap() {
        let name = entry["name"].as_str().unwrap();
        let text = manifactor(&format!("explain {name}")).ended(0).stdout;
        assert!(text.starts_with(&format!("{name}: a")) && text.contains("Example:"), "{text}");
    }
}

#[test]
fn an_explanation_has_fields_with_their_defaults() {
    let text = manifactor("explain levenberg_marquardt").ended(0).stdout;
    for part in ["initial_lambda", "stop.max_iterations", "100", "Most linearizations"] {
        assert!(text.contains(part), "{part} is missing:\n{text}");
    }
    let text = manifactor("explain vertical_orientation").ended(0).stdout;
    assert!(text.contains("Variables: dual_quadric. Rows of its residual: 1."), "{text}");
    manifactor("explain betwen_se3").ended(2).complains("did you mean `between_se3`?");
}

#[test]
fn the_schema_knows_what_is_linked() {
    let schema = manifactor("schema").ended(0).json();
    assert!(schema["$defs"]["factor.between_se3"].is_object());
}

#[test]
fn a_wrong_command_line_is_exit_code_2() {
    manifactor("solv graph.toml").ended(2).complains("solve");
    manifactor("list --threads 0").ended(2).complains("threads");
}

#[test]
fn the_config_reference_of_the_docs_is_that_of_what_is_linked() {
    let written = std::fs::read_to_string(crate::root().join("docs/config.md")).unwrap();
    let now = manifactor("list --markdown").ended(0).stdout;
    let first = now.lines().zip(written.lines()).find(|(now, written)| now != written);
    assert!(
        now == written,
        "docs/config.md is stale, first at {first:?}: manifactor list --markdown > docs/config.md"
    );
}
