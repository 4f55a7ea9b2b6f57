//! The command line, end to end: the binary, its files and its exit codes.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic, clippy::print_stderr)]
mod commands;
mod endings;
mod pages;
mod words;

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Output and exit code of the binary.
struct Ran {
    code: i32,
    stdout: String,
    stderr: String,
}

/// Runs the binary in the root of the repository. Words are split at spaces.
fn manifactor(arguments: &str) -> Ran {
    run(arguments.split_whitespace(), &[])
}

fn run<'a>(arguments: impl IntoIterator<Item = &'a str>, variables: &[(&str, &str)]) -> Ran {
    let mut command = Command::new(env!("CARGO_BIN_EXE_manifactor"));
    command.current_dir(root()).args(arguments).env("NO_COLOR", "1").env_remove("MANIFACTOR_DATA");
    ran(command.envs(variables.iter().copied()))
}

/// Runs the binary with a text on its standard input.
fn fed(arguments: &str, text: &str) -> Ran {
    let folder = folder(&[("stdin", text)]);
    let mut command = Command::new(env!("CARGO_BIN_EXE_manifactor"));
    command.current_dir(root()).args(arguments.split_whitespace()).env("NO_COLOR", "1");
    ran(command.stdin(std::fs::File::open(path(&folder, "stdin")).unwrap()))
}

fn ran(command: &mut Command) -> Ran {
    let output = command.output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    Ran { code: output.status.code().unwrap(), stdout: text(output.stdout), stderr: text(output.stderr) }
}

impl Ran {
    #[track_caller]
    fn ended(self, code: i32) -> Self {
        assert_eq!(self.code, code, "stdout:\n{}\nstderr:\n{}", self.stdout, self.stderr);
        self
    }
    #[track_caller]
    fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e}:\n{}", self.stdout))
    }
    #[track_caller]
    fn complains(&self, text: &str) {
        // lines are wrapped at the width of the terminal
        let words = |s: &str| s.split_whitespace().filter(|w| *w != "│").collect::<Vec<_>>().join(" ");
        assert!(words(&self.stderr).contains(text), "no `{text}` in:\n{}", self.stderr);
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Creates a folder with these files.
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn path(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).display().to_string()
}
