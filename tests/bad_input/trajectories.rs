use crate::harness::{Case, ended, text};
use std::fmt::Write as _;

const TRUTH: &str = "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 2 0 1 0 0 0 1\n3 3 1 0 0 0 0 1\n";

/// Runs the cases of an estimate, with a valid truth.
fn account(cases: Vec<Case>) -> String {
    let mut account = String::new();
    for (name, bytes) in cases {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("truth.txt"), TRUTH).unwrap();
        std::fs::write(folder.path().join("estimate.txt"), bytes).unwrap();
        let _ = writeln!(
            account,
            "## {name}\n{}",
            ended(folder.path(), "evaluate truth.txt FILE", "estimate.txt")
        );
    }
    account
}

#[test]
fn tum_trajectories() {
    let line = |name, line: &str| text(name, format!("{line}\n1 1 0 0 0 0 0 1\n2 2 0 1 0 0 0 1\n"));
    let cases = vec![
        text("empty", ""),
        text("comments only", "# timestamp tx ty tz qx qy qz qw\n"),
        ("binary", vec![7; 100]),
        line("a number too few", "0 0 0 0 0 0 1"),
        line("a number too many", "0 0 0 0 0 0 0 1 9"),
        line("commas", "0,0,0,0,0,0,0,1"),
        line("a word", "0 0 zero 0 0 0 0 1"),
        line("not a number", "0 nan 0 0 0 0 0 1"),
        line("infinite time", "inf 0 0 0 0 0 0 1"),
        line("quaternion zero", "0 0 0 0 0 0 0 0"),
        line("quaternion not of length one", "0 0 0 0 0 0 0 3"),
        text("time that runs back", "2 2 0 1 0 0 0 1\n1 1 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n"),
        text("one time twice", "1 1 0 0 0 0 0 1\n1 2 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n"),
        text("one pose", "1 1 0 0 0 0 0 1\n"),
        text("another time", TRUTH.replace('\n', "\n5")),
        text(
            "positions in one place",
            "0 5 5 5 0 0 0 1\n1 5 5 5 0 0 0 1\n2 5 5 5 0 0 0 1\n3 5 5 5 0 0 0 1\n",
        ),
        text("positions far away", "0 1e200 0 0 0 0 0 1\n1 -1e200 0 0 0 0 0 1\n2 1e200 1 0 0 0 0 1\n"),
    ];
    insta::assert_snapshot!(account(cases));
}

#[test]
fn files_that_are_not_there() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    std::fs::write(place.join("truth.txt"), TRUTH).unwrap();
    std::fs::create_dir(place.join("folder")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("loop.g2o", place.join("loop.g2o")).unwrap();
    let commands = [
        "evaluate truth.txt nothing.txt",
        "evaluate truth.txt folder",
        "evaluate truth.txt truth.txt --within nan",
        "evaluate truth.txt truth.txt --within -1",
        "evaluate truth.txt truth.txt --delta 0",
        "evaluate truth.txt truth.txt --delta 100",
        "solve nothing.g2o",
        "solve folder",
        "solve loop.g2o",
        "solve truth.txt",
        "solve truth.nothing",
        "run nothing.toml",
        "check folder",
        "check truth.txt",
    ];
    let all = commands.map(|command| format!("$ {command}\n{}\n", ended(place, command, "")));
    insta::assert_snapshot!(all.concat());
}
