use crate::{folder, manifactor, path};

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
fn a_pipe_gets_one_name_per_line() {
    let lines = manifactor("list solvers").ended(0).stdout;
    let json = manifactor("list solvers --json").ended(0).json();
    let names: Vec<&str> = json.as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!(lines.lines().collect::<Vec<_>>(), names);
}

#[test]
fn documents_and_their_tables_are_explained() {
    for (name, parts) in [
        ("experiment", ["a kind of document", "axes[].columns", "manifactor experiment", "Example:"]),
        ("run", ["a kind of document", "detections.loss", "manifactor run", "Example:"]),
        ("graph", ["a kind of document", "factors[].keys", "manifactor solve", "Example:"]),
        ("rules", ["a kind of document", "semantics[].classes", "semantics = \"rules.toml\"", "Example:"]),
        ("axes", ["a field of the document experiment", "axes[].rows", "axes[].options", "list of table"]),
        (
            "solver",
            [
                "document graph\n\nThe solver",
                "document run\n",
                "manifactor list solver",
                "levenberg_marquardt",
            ],
        ),
        ("summary.baseline", ["a field of the document experiment", "compared", "Type:", "Default"]),
    ] {
        let text = manifactor(&format!("explain {name}")).ended(0).stdout;
        // paragraphs are wrapped
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        for part in parts {
            assert!(words(&text).contains(&words(part)), "{name}: {part} is missing:\n{text}");
        }
    }
    let json = manifactor("explain axes --json").ended(0).json();
    assert_eq!((&json[0]["kind"], &json[0]["documents"][0]), (&"field".into(), &"experiment".into()));
    manifactor("explain axs").ended(2).complains("did you mean `axes`?");
    manifactor("explain solve").ended(2).complains("`manifactor help solve` explains the command");
    manifactor("explain factor").ended(2).complains("`manifactor list factor` prints");
    let text = manifactor("explain given").ended(0).stdout;
    assert!(text.contains("given: an association"), "{text}");
}

#[test]
fn the_examples_of_documents_are_documents() {
    let folder = folder(&[]);
    for kind in ["graph", "run", "rules", "experiment"] {
        let json = manifactor(&format!("explain {kind} --json")).ended(0).json();
        let example =
            json.as_array().unwrap().iter().find(|one| one["kind"] == "document").unwrap()["example"].clone();
        std::fs::write(path(&folder, &format!("{kind}.toml")), example.as_str().unwrap()).unwrap();
    }
    for kind in ["graph", "run", "experiment"] {
        manifactor(&format!("check {}", path(&folder, &format!("{kind}.toml")))).ended(0);
    }
    manifactor(&format!("check {} --set semantics=rules.toml", path(&folder, "run.toml"))).ended(0);
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
    for part in ["initial_lambda", "stop.max_iterations", "100", "linearizations"] {
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
fn the_generated_pages_of_the_docs_are_up_to_date() {
    for (page, command) in [
        ("docs/reference/config.md", "list --markdown"),
        ("docs/reference/command-line.md", "man --markdown"),
    ] {
        let written = std::fs::read_to_string(crate::root().join(page)).unwrap();
        let now = manifactor(command).ended(0).stdout;
        let first = now.lines().zip(written.lines()).find(|(now, written)| now != written);
        assert!(now == written, "{page} is stale, first at {first:?}: manifactor {command} > {page}");
    }
}
