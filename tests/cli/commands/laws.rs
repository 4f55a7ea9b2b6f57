use crate::{folder, manifactor, path, run};

#[test]
fn a_sound_factor_is_told_what_it_leaves_free() {
    let ran = manifactor("check-factor vertical_orientation").ended(0);
    let text = &ran.stdout;
    assert!(text.contains("Free: 8 of 9 directions: "), "{text}");
    assert!(text.contains("q0.(x, y, z, log_a, log_b, log_c); 2 combinations of q0.(rx, ry, rz)"), "{text}");
    // |m · up| has a kink if the axis is horizontal, and a jump if a different axis becomes the longest
    assert!(text.contains("Kink: row 0 by q0.(r") && text.contains("Jump: row 0 by q0.(log_a"), "{text}");
    assert!(
        manifactor("check-factor supporting_plane")
            .ended(0)
            .stdout
            .contains("Unchanged by sliding along the plane")
    );
}

#[test]
fn one_seed_draws_the_same_points_and_all_is_in_the_json() {
    let json = || manifactor("check-factor bounding_box --seed 5 --points 64 --json").ended(0).json();
    let report = json();
    assert_eq!(report, json());
    let factor = &report["factors"][0];
    assert_eq!((report["holds"].as_bool(), factor["directions"].as_u64()), (Some(true), Some(15)));
    assert!(factor["worst"]["error"].as_f64().unwrap() < 1e-6 && factor["rank"] == 4, "{factor}");
}

const FORMULA: &str = r#"
[[variables]]
key = "q3"
value = { type = "dual_quadric", translation = [1.0, 0.0, 0.5], rotation = [0.1, 0.2, 0.3, 0.9], semi_axes = [0.1, 0.2, 0.3] }

[[factors]]
keys = ["q3"]
factor = { type = "expression", variables = { q = "dual_quadric" }, residual = ["RESIDUAL"] }
"#;

#[test]
fn a_formula_of_a_graph_is_checked_around_its_values() {
    let text = FORMULA
        .replace("RESIDUAL", "1 - abs(dot(major_axis(q), up))")
        .replace("[0.1, 0.2, 0.3, 0.9]", "[0.0, 0.0, 0.6, 0.8]");
    let folder = folder(&[("graph.toml", &text)]);
    let ran = manifactor(&format!("check-factor --config {}", path(&folder, "graph.toml"))).ended(0);
    assert!(ran.stdout.contains("Free: 8 of 9 directions"), "{}", ran.stdout);
}

#[test]
fn what_is_not_finite_is_broken_and_the_point_reproduces_it() {
    let text = FORMULA
        .replace("RESIDUAL", "sqrt(dot(centroid(q), up) - 0.5)")
        .replace("[0.1, 0.2, 0.3, 0.9]", "[0.0, 0.0, 0.6, 0.8]");
    let files = folder(&[("graph.toml", &text)]);
    let ran = manifactor(&format!("check-factor --config {}", path(&files, "graph.toml"))).ended(1);
    assert!(ran.stdout.contains("expression is broken: "), "{}", ran.stdout);
    let (_, graph) = ran.stdout.split_once("as a graph:\n").unwrap();
    let again = folder(&[("again.toml", graph)]);
    let arguments = format!("check-factor expression --points 1 --config {}", path(&again, "again.toml"));
    assert!(manifactor(&arguments).ended(1).stdout.contains("expression is broken: "));
}

#[test]
fn parameters_are_checked_like_those_of_a_document() {
    let check = |json| run(["check-factor", "rests", "--parameters", json], &[]);
    check("{}").ended(2).complains("unknown factor `rests`");
    let check = |json| run(["check-factor", "vertical_orientation", "--parameters", json], &[]);
    check(r#"{ "up": [0, 1, 0] }"#).ended(0);
    check(r#"{ "upp": [0, 1, 0] }"#).ended(2).complains("did you mean `up`?");
    check(r#"{ "up": [0, 0, 0] }"#).ended(2).complains("expected a direction");
}

#[test]
fn a_type_of_variables_is_checked_by_its_name() {
    let ran = manifactor("check-manifold se3 --points 64").ended(0);
    assert!(ran.stdout.contains("se3: the laws hold at 64 pairs of points (seed 0)"), "{}", ran.stdout);
    assert!(ran.stdout.contains("Tangent: 6 (rx, ry, rz, x, y, z)"), "{}", ran.stdout);
    assert!(ran.stdout.contains("Seed: right"), "{}", ran.stdout);
    let report = manifactor("check-manifold dual_quadric --points 32 --json").ended(0).json();
    assert!(report["seed_error"].as_f64().unwrap() < 1e-6, "{report}");
    manifactor("check-manifold se4").ended(2).complains("did you mean `se");
}
