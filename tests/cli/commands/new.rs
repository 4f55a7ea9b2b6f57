use crate::{folder, manifactor, root, run};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The folder of this test's build, so that existing crates are not built again.
fn target() -> PathBuf {
    let binary = Path::new(env!("CARGO_BIN_EXE_manifactor"));
    binary.ancestors().nth(2).unwrap().to_owned()
}

#[test]
fn a_new_plugin_compiles_and_passes_outside_of_the_workspace() {
    let folder = folder(&[]);
    let name = folder.path().join("on_the_shelf").display().to_string();
    let checkout = root().display().to_string();
    let said = run(["new", "plugin", &name, "--manifactor", &checkout], &[]).ended(0).stdout;
    assert!(said.contains("cargo test"), "{said}");
    // the versions that are already built
    std::fs::copy(root().join("Cargo.lock"), folder.path().join("on_the_shelf/Cargo.lock")).unwrap();
    let mut cargo = Command::new(env!("CARGO"));
    cargo
        .args(["test", "--offline", "--quiet", "--features", "cli"])
        .current_dir(&name)
        .env("CARGO_TARGET_DIR", target());
    // our crates are rebuilt for the external crate, so a fast build matters more than fast code
    cargo.env("CARGO_INCREMENTAL", "0");
    let lock = std::fs::read_to_string(root().join("Cargo.lock")).unwrap();
    let names = lock.lines().filter_map(|line| line.strip_prefix("name = \"")?.strip_suffix('"'));
    for own in names.filter(|name| name.starts_with("manifactor")) {
        cargo.args(["--config", &format!("profile.dev.package.{own}.opt-level=0")]);
    }
    let output = cargo.output().unwrap();
    let text =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
    assert!(text.matches("2 passed").count() == 2, "{text}");
}

#[test]
fn a_plugin_is_not_written_over_another_nor_under_a_bad_name() {
    let folder = folder(&[("there", "")]);
    let path = |name: &str| folder.path().join(name).display().to_string();
    run(["new", "plugin", &path("there")], &[]).ended(2).complains("exists already");
    run(["new", "plugin", &path("On-Shelf")], &[]).ended(2).complains("such as `on_the_shelf`");
    let nowhere = folder.path().display().to_string();
    run(["new", "plugin", &path("new_one"), "--manifactor", &nowhere], &[])
        .ended(2)
        .complains("is not a checkout");
    assert!(!folder.path().join("new_one").exists());
    manifactor("new").ended(2).complains("plugin");
    let taken = path("vertical-orientation");
    run(["new", "plugin", &taken], &[])
        .ended(2)
        .complains("the factor `vertical_orientation` exists already");
    assert!(!Path::new(&taken).exists());
}
