//! The log: silent by default.
use crate::{folder, manifactor, path};

const GRAPH: &str = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0.5\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nFIX 0\n";

#[test]
fn a_log_is_there_for_those_who_ask() {
    let folder = folder(&[("a.g2o", GRAPH)]);
    let (graph, out) = (path(&folder, "a.g2o"), path(&folder, "b.g2o"));
    let said =
        |flags: &str| manifactor(&format!("solve {graph} --out {out} --force {flags}")).ended(0).stderr;
    assert_eq!(said(""), "");
    let one = said("-v");
    assert!(one.contains("gradient") && one.contains("converged") && one.contains("pose graph"), "{one}");
    assert!(!one.contains("compiled"), "{one}");
    let two = said("-vv");
    for event in ["read", "compiled", "step", "converged", "written"] {
        assert!(two.contains(event), "{event} is not in:\n{two}");
    }
    // the results are unchanged, and on standard output alone
    let quiet = manifactor(&format!("solve {graph}")).ended(0).stdout;
    assert_eq!(
        manifactor(&format!("-vv solve {graph}")).ended(0).stdout.lines().next(),
        quiet.lines().next()
    );
}

#[test]
fn objects_that_are_not_mapped_are_logged() {
    let folder = folder(&[]);
    let out = path(&folder, "out");
    let set = "--set source.trajectory.frames=20 --set source.scene.objects=3 --set objects.min_views=1000";
    let ran = manifactor(&format!("run examples/desk/desk.toml --out {out} {set} -v"));
    assert!(ran.stderr.contains("not mapped") && ran.stderr.contains("at least 1000"), "{}", ran.stderr);
}

#[test]
fn a_solve_compiles_its_graph_once() {
    let folder = folder(&[("a.g2o", GRAPH)]);
    let said =
        manifactor(&format!("solve {} --covariances --json -vv", path(&folder, "a.g2o"))).ended(0).stderr;
    assert_eq!(said.matches("compiled").count(), 1, "{said}");
}
