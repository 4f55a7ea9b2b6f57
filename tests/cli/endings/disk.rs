//! Full disks, files that may not grow, read-only folders, streams without a reader, and too little memory.
use crate::commands::experiment::tables;
use crate::{folder, manifactor, path, root};
use std::io::Read;
use std::path::Path;
use std::process::{Command, Output};

const RUN: &str = r#"
source = { type = "simulated", scene = { objects = 3 }, trajectory = { frames = 40 } }
"#;

const GRAPH: &str = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0.5\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nFIX 0\n";

const SWEEP: &str = r#"
base = "run.toml"
set = { source = { trajectory = { frames = 8 } } }
[[axes]]
columns = { seed = "source.seed" }
rows = [1, 2, 3, 4, 5, 6, 7, 8]
[summary]
metrics = ["position"]
resamples = 20
"#;

/// Runs the binary after a line of shell, which may restrict its resources.
fn after(line: &str, arguments: &str) -> Output {
    let script = format!("{line}; exec \"$0\" \"$@\"");
    let mut command = Command::new("sh");
    command.args(["-c", &script, env!("CARGO_BIN_EXE_manifactor")]).args(arguments.split_whitespace());
    command.current_dir(root()).env("NO_COLOR", "1").output().unwrap()
}

/// Limits all files to this many blocks of 512 bytes; a write beyond that raises a signal.
fn small_files(blocks: usize) -> String {
    format!("ulimit -f {blocks}")
}

#[track_caller]
fn refused(output: &Output, words: &[&str]) {
    let said = String::from_utf8_lossy(&output.stderr).replace("│", "");
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(output.status.code(), Some(3), "{said}");
    for word in words {
        assert!(said.contains(word), "no `{word}` in {said}");
    }
}

fn names(folder: &Path) -> Vec<String> {
    let files = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = files.map(|f| f.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_run_that_cannot_write_a_file_leaves_whole_ones() {
    let folder = folder(&[("run.toml", RUN)]);
    let (config, out) = (path(&folder, "run.toml"), path(&folder, "out"));
    let whole = path(&folder, "whole");
    manifactor(&format!("run {config} --out {whole}"));
    let ran = after(&small_files(8), &format!("run {config} --out {out}"));
    refused(&ran, &["File too large"]);
    let (written, whole) = (Path::new(&out).join("estimate"), Path::new(&whole).join("estimate"));
    let left = names(&written);
    assert!(left.contains(&"config.toml".to_owned()) && !left.contains(&"graph.json".to_owned()), "{left:?}");
    for name in left {
        let bytes = |folder: &Path| std::fs::read(folder.join(&name)).unwrap();
        assert!(name == "config.toml" || bytes(&written) == bytes(&whole), "{name}");
    }
}

#[test]
fn a_graph_that_cannot_be_written_leaves_what_was_there() {
    let poses: String = (0..200).map(|i| format!("VERTEX_SE2 {i} {i} 0 0\n")).collect();
    let edges: String = (1..200).map(|i| format!("EDGE_SE2 {} {i} 1 0 0 1 0 0 1 0 1\n", i - 1)).collect();
    let folder = folder(&[("a.g2o", &(poses + &edges)), ("b.json", "before")]);
    let out = path(&folder, "b.json");
    let ran = after(&small_files(4), &format!("solve {} --out {out} --force", path(&folder, "a.g2o")));
    refused(&ran, &["b.json", "File too large"]);
    assert_eq!(std::fs::read_to_string(&out).unwrap(), "before");
    assert_eq!(names(folder.path()), ["a.g2o", "b.json"]);
}

#[test]
fn a_sweep_that_cannot_write_goes_on_where_there_is_room() {
    let folder = folder(&[("run.toml", RUN), ("sweep.toml", SWEEP)]);
    let (config, out) = (path(&folder, "sweep.toml"), path(&folder, "out"));
    let ran = after(&small_files(3), &format!("experiment {config} --out {out} --threads 1"));
    refused(&ran, &["trials.jsonl", "File too large"]);
    assert_eq!(names(Path::new(&out)), [".manifactor", "trials.jsonl"]);
    let ran = manifactor(&format!("experiment {config} --out {out}")).ended(0);
    assert!(!ran.stderr.contains(" 0 of them by earlier commands"), "{}", ran.stderr);
    let whole = path(&folder, "whole");
    manifactor(&format!("experiment {config} --out {whole}")).ended(0);
    assert!(tables(&out) == tables(&whole));
}

#[test]
fn a_full_standard_output_is_an_error() {
    let ran = after("exec > /dev/full", "list factors");
    refused(&ran, &["standard output", "No space left on device"]);
    let ran = after("exec > /dev/full", "list factors --json");
    refused(&ran, &["standard output", "No space left on device"]);
    let ran = after("exec > /dev/full", "solve --help");
    refused(&ran, &["standard output", "No space left on device"]);
    let ran = after("exec > /dev/full", "--version");
    refused(&ran, &["standard output", "No space left on device"]);
}

/// Runs the binary with one stream into a pipe without a reader. Returns the text of the open stream and
/// the exit code.
fn unheard(stderr: bool, arguments: &str) -> (String, Option<i32>) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_manifactor"));
    command.args(arguments.split_whitespace()).current_dir(root()).env("NO_COLOR", "1");
    let (reader, writer) = std::io::pipe().unwrap();
    let (mut heard, other) = std::io::pipe().unwrap();
    match stderr {
        true => command.stderr(writer).stdout(other),
        false => command.stdout(writer).stderr(other),
    };
    drop(reader);
    let mut child = command.spawn().unwrap();
    // closes its ends of the pipes
    drop(command);
    let mut text = String::new();
    heard.read_to_string(&mut text).unwrap();
    (text, child.wait().unwrap().code())
}

#[test]
fn a_standard_output_without_a_reader_is_an_error() {
    let folder = folder(&[("a.g2o", GRAPH)]);
    let out = path(&folder, "b.g2o");
    let (said, code) = unheard(false, &format!("solve {} --out {out} --json", path(&folder, "a.g2o")));
    assert_eq!((said.as_str(), code), ("", Some(3)));
    assert!(Path::new(&out).is_file());
}

#[test]
fn a_standard_error_that_cannot_be_written_changes_nothing() {
    let folder = folder(&[("run.toml", RUN), ("sweep.toml", SWEEP)]);
    let [run, sweep] = ["run.toml", "sweep.toml"].map(|name| path(&folder, name));
    for (i, log) in ["", "-v", "-vv"].into_iter().enumerate() {
        let out = path(&folder, &format!("run{i}"));
        let (said, code) = unheard(true, &format!("run {run} --out {out} {log}"));
        assert!(code == Some(0) && said.contains("Written to"), "{code:?} {said}");
        assert!(Path::new(&out).join("report.html").is_file());
    }
    let out = path(&folder, "sweep");
    let ran = after("exec 2> /dev/full", &format!("experiment {sweep} --out {out} -v"));
    assert_eq!(ran.status.code(), Some(0));
    assert!(Path::new(&out).join("report.html").is_file());
    // the exit code shows the error
    assert_eq!(after("exec 2> /dev/full", "solve nowhere.g2o").status.code(), Some(3));
    assert_eq!(after("exec 2> /dev/full", "solve --nothing").status.code(), Some(2));
}

/// Runs the binary with a separate file system at `place`; its final content follows the marker.
fn on_a_disk(options: &str, place: &Path, arguments: &str) -> Option<Output> {
    let place = place.display();
    let script = format!(
        "mount -t tmpfs -o {options} none {place} || exit 99; \"$0\" \"$@\"; code=$?; echo left; ls -A {place}; exit $code"
    );
    let mut command = Command::new("unshare");
    command.args(["--map-root-user", "--mount", "sh", "-c", &script, env!("CARGO_BIN_EXE_manifactor")]);
    command.args(arguments.split_whitespace()).current_dir(root()).env("NO_COLOR", "1");
    match command.output() {
        Ok(output) if output.status.code().is_some_and(|code| code == 0 || code == 3) => Some(output),
        other => {
            eprintln!("skipped: no file system can be mounted here: {other:?}");
            None
        }
    }
}

#[test]
fn a_full_disk_is_told_and_nothing_half_written_stays() {
    let folder = folder(&[("run.toml", RUN)]);
    let disk = folder.path().join("disk");
    std::fs::create_dir(&disk).unwrap();
    let arguments = format!("run {} --out {}/out", path(&folder, "run.toml"), disk.display());
    let Some(ran) = on_a_disk("size=24k", &disk, &arguments) else { return };
    refused(&ran, &["No space left on device"]);
    let listed = String::from_utf8_lossy(&ran.stdout);
    assert!(listed.contains("left\nout") && !listed.contains(".unfinished"), "{listed}");
}

#[test]
fn a_folder_for_reading_only_is_told_before_the_solve() {
    let folder = folder(&[("run.toml", RUN), ("a.g2o", "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n")]);
    let disk = folder.path().join("disk");
    std::fs::create_dir(&disk).unwrap();
    let runs = [
        format!("run {} --out {}/out -vv", path(&folder, "run.toml"), disk.display()),
        format!("solve {} --out {}/b.g2o -vv", path(&folder, "a.g2o"), disk.display()),
        format!("simulate {} --out {}/b -vv", path(&folder, "run.toml"), disk.display()),
    ];
    for arguments in runs {
        let Some(ran) = on_a_disk("ro", &disk, &arguments) else { return };
        refused(&ran, &["Read-only file system"]);
        let said = String::from_utf8_lossy(&ran.stderr);
        assert!(!said.contains("compiled") && !said.contains("step"), "{said}");
    }
}

#[test]
fn a_place_under_a_file_is_told_before_the_solve() {
    let folder = folder(&[("run.toml", RUN), ("file", "")]);
    let ran =
        after("true", &format!("run {} --out {}/out -vv", path(&folder, "run.toml"), path(&folder, "file")));
    refused(&ran, &["Not a directory"]);
    assert!(!String::from_utf8_lossy(&ran.stderr).contains("compiled"));
}

#[test]
fn a_limit_of_memory_without_room_for_the_threads_is_refused() {
    let folder = folder(&[("run.toml", RUN), ("sweep.toml", SWEEP)]);
    let (run, sweep, out) = (path(&folder, "run.toml"), path(&folder, "sweep.toml"), path(&folder, "out"));
    for command in [format!("run {run}"), format!("online {run}"), format!("experiment {sweep}")] {
        let ended = after("ulimit -v 300000", &format!("{command} --out {out} --threads 2"));
        let said = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(ended.status.code(), Some(2), "{command}: {said}");
        for words in ["the memory limit is", "--threads"] {
            assert!(said.contains(words), "{command}: {said}");
        }
    }
    assert_eq!(names(folder.path()), ["run.toml", "sweep.toml"]);
}
