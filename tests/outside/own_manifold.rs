//! `docs/own-manifold.md`: its types are the ones here, and a graph of them is solved.
#[allow(unreachable_pub, reason = "as the page has it")]
mod hinge;
#[allow(unreachable_pub, reason = "as the page has it")]
mod wall;

use crate::solve_document;
use manifactor::geometry::So2;
use std::path::Path;
use wall::Wall;

#[test]
fn the_page_has_these_types() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/own-manifold.md");
    let page = std::fs::read_to_string(page).unwrap();
    for code in [include_str!("own_manifold/wall.rs"), include_str!("own_manifold/hinge.rs")] {
        assert!(page.contains(code.trim()), "the page has other code than\n{code}");
    }
}

#[test]
fn a_wall_is_found_by_a_formula() {
    let solution = solve_document(
        r#"
        variables = [{ key = "w", value = { type = "wall", angle = 1.2, distance = 1.0 } }]
        [[factors]]
        keys = ["w"]
        name = "two points that are on it"
        factor = { type = "expression", variables = { w = "wall" }, residual = ["dot([-1, 2, -1], w)", "dot([3, 2, -1], w)"] }
        "#,
    );
    let wall: &Wall = solution.values.get("w").unwrap();
    assert!(
        (wall.angle - std::f64::consts::FRAC_PI_2).abs() < 1e-6 && (wall.distance - 2.0).abs() < 1e-6,
        "{wall:?}"
    );
}

#[test]
fn a_door_is_open_by_what_its_poses_say() {
    let solution = solve_document(
        r#"
        [[variables]]
        key = "frame"
        value = { type = "se3", translation = [1.0, 2.0, 0.0], rotation = [0.0, 0.0, 0.0, 1.0] }
        fixed = true
        [[variables]]
        key = "opening"
        value = { type = "so2", angle = 0.0 }
        [[variables]]
        key = "door"
        value = { type = "se3", translation = [1.4, 2.0, 0.0], rotation = [0.0, 0.0, 0.5, 0.8660254037844386] }
        fixed = true
        [[factors]]
        keys = ["frame", "opening", "door"]
        factor = { type = "hinge", axis = { translation = [0.4, 0.0, 0.0], rotation = [0.0, 0.0, 0.0, 1.0] } }
        "#,
    );
    let opening: &So2 = solution.values.get("opening").unwrap();
    assert!((opening.angle().to_degrees() - 60.0).abs() < 1e-6, "{opening}");
}
