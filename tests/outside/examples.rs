//! The programs of `examples/*.rs` run, and print what they claim.
use std::path::Path;
use std::process::Command;

/// Runs an example, which `cargo test` builds beside this test, and returns its output.
fn run(name: &str) -> String {
    let test = std::env::current_exe().unwrap();
    let file = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    let program = test.parent().and_then(Path::parent).unwrap().join("examples").join(file);
    assert!(program.exists(), "{} is missing: `cargo build --examples` builds it", program.display());
    let output = Command::new(program).output().unwrap();
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Returns the number before the first occurrence of `unit` in a line.
fn number_before(line: &str, unit: &str) -> f64 {
    let before = line.split(unit).next().unwrap();
    before.rsplit([' ', '(']).next().unwrap().parse().unwrap()
}

#[test]
fn pose_graph() {
    let printed = run("pose_graph");
    assert!(printed.starts_with("converged"), "{printed}");
    assert!(printed.contains("x5: (2.000, 2.000), σ 0.449 m"), "{printed}");
}

#[test]
fn bundle_adjustment() {
    let printed = run("bundle_adjustment");
    assert!(printed.starts_with("converged"), "{printed}");
    let points: Vec<&str> = printed.lines().filter(|line| line.starts_with('p')).collect();
    assert_eq!(points.len(), 8);
    assert!(points.iter().all(|line| number_before(line, " m from") < 1e-6), "{printed}");
}

#[test]
fn smoother() {
    let printed = run("smoother");
    let last = printed.lines().last().unwrap();
    assert!(last.starts_with("x99") && number_before(last, " m from") < 0.1, "{printed}");
    assert!(number_before(last, " poses") <= 23.0, "{printed}");
}

#[test]
fn objects() {
    let printed = run("objects");
    let tilts: Vec<f64> = printed.lines().map(|line| number_before(line, "°")).collect();
    assert_eq!(tilts.len(), 2);
    assert!(tilts[0] > 1.0 && tilts[1] < 0.2, "{printed}");
}

#[test]
fn curve_fit() {
    let printed = run("curve_fit");
    assert!(printed.starts_with("converged"), "{printed}");
    assert!((number_before(printed.lines().last().unwrap(), " ±") - 2.0).abs() < 0.1, "{printed}");
}
