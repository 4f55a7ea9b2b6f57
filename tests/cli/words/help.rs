//! The help of every command: its width, and its examples.
use super::slam_systems::recording_of_desk;
use crate::{manifactor, root};
use clap::{Command, CommandFactory};
use unicode_width::UnicodeWidthStr;

/// Returns all commands, each with its names, such as `new plugin`.
fn commands() -> Vec<(String, Command)> {
    fn collect(before: &str, command: &Command, all: &mut Vec<(String, Command)>) {
        for inner in command.get_subcommands() {
            let name = format!("{before} {}", inner.get_name()).trim().to_owned();
            collect(&name, inner, all);
            all.push((name, inner.clone()));
        }
    }
    let mut all = vec![];
    collect("", &manifactor_cli::Cli::command(), &mut all);
    all
}

/// Returns the commands in the examples of a help text, without the name of the program.
fn examples(command: &Command) -> Vec<String> {
    let text = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    let (_, lines) = text.split_once("Example").unwrap_or_default();
    lines.lines().filter_map(|line| line.trim().strip_prefix("manifactor ")).map(str::to_owned).collect()
}

#[test]
fn help_fits_into_80_columns() {
    let names = commands().into_iter().map(|(name, _)| name).chain([String::new()]);
    for (name, flag) in names.flat_map(|name| [(name.clone(), "--help"), (name, "-h")]) {
        let help = manifactor(&format!("{name} {flag}")).ended(0).stdout;
        let wide = help.lines().find(|line| line.width() > 80);
        assert!(wide.is_none() && help.contains("Usage:"), "{name} {flag}: {wide:?}");
    }
}

#[test]
#[cfg(unix)]
fn the_examples_of_the_help_work() {
    assert!(!examples(&manifactor_cli::Cli::command()).is_empty());
    let drive = recording_of_desk();
    for (name, command) in commands() {
        let examples = examples(&command);
        assert!(examples.iter().any(|line| line.starts_with(&name)), "{name} has no example: {examples:?}");
        let folder = tempfile::tempdir().unwrap();
        for data in ["examples", "tests"] {
            std::os::unix::fs::symlink(root().join(data), folder.path().join(data)).unwrap();
        }
        if examples.iter().any(|line| line.contains("drive.mcap")) {
            std::fs::write(folder.path().join("drive.mcap"), &drive).unwrap();
        }
        for line in examples {
            let words = line.split(" > ").next().unwrap().split_whitespace();
            // the data are the same, but less of them
            let small: &[&str] = match line.split_whitespace().next() {
                Some("experiment") => &["--shard", "1/2000"],
                Some("run" | "online" | "check" | "simulate") => {
                    &["--set", "source.trajectory.frames=40", "--set", "source.scene.objects=5"]
                }
                _ => &[],
            };
            let mut binary = std::process::Command::new(env!("CARGO_BIN_EXE_manifactor"));
            let output = binary.args(words).args(small).current_dir(folder.path()).output().unwrap();
            let text = String::from_utf8_lossy(&output.stderr);
            // with fewer frames, a variant of the desk may stall
            let is_small_run = small.len() == 4 && output.status.code() == Some(1);
            assert!(output.status.success() || is_small_run, "{line}: {:?}\n{text}", output.status);
        }
    }
}
