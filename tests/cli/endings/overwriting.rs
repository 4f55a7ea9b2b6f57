//! Existing files, and concurrent processes that write to the same folder.
use crate::{Ran, folder, manifactor, path};
use std::fs;
use std::path::Path;

const GRAPH: &str =
    "# measured by hand\nVERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0.5\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n";

const RUN: &str = "source = { type = 'simulated', scene = { objects = 1 }, trajectory = { frames = 8 } }\n";

const SWEEP: &str = "base = 'run.toml'\naxes = [{ columns = { seed = 'source.seed' }, rows = [1, 2] }]\n\
                     summary = { metrics = ['position'], resamples = 20 }\n";

/// The commands that write folders, each with its document.
const COMMANDS: [(&str, &str); 3] =
    [("run", "run.toml"), ("simulate", "run.toml"), ("experiment", "sweep.toml")];

fn documents() -> tempfile::TempDir {
    folder(&[("run.toml", RUN), ("sweep.toml", SWEEP)])
}

fn into(folder: &tempfile::TempDir, (command, document): (&str, &str), out: &Path, more: &str) -> Ran {
    manifactor(&format!("{command} {} --out {} {more}", path(folder, document), out.display()))
}

/// A solve this small may end without a minimum.
#[track_caller]
fn done(ran: &Ran) {
    assert!(ran.code == 0 || ran.code == 1, "{}", ran.stderr);
}

fn names(folder: &Path) -> Vec<String> {
    let files = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = files.map(|f| f.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_file_is_not_written_over_unless_forced() {
    let folder = folder(&[("a.g2o", GRAPH), ("b.json", "precious")]);
    let (graph, other) = (path(&folder, "a.g2o"), path(&folder, "b.json"));
    let text = |path: &str| fs::read_to_string(path).unwrap();
    for out in [&graph, &path(&folder, "./a.g2o")] {
        manifactor(&format!("solve {graph} --out {out}")).ended(2).complains("is the input graph");
    }
    manifactor(&format!("solve {graph} --out {other}")).ended(2).complains("exists already");
    assert_eq!((text(&graph), text(&other)), (GRAPH.to_owned(), "precious".to_owned()));
    manifactor(&format!("solve {graph} --out {other} --force")).ended(0);
    assert!(text(&other).contains("between_se2"));
    manifactor(&format!("solve {graph} --out {graph} --force")).ended(0);
    assert!(!text(&graph).contains("by hand"));
    assert_eq!(names(folder.path()), ["a.g2o", "b.json"]);
}

#[test]
#[cfg(unix)]
fn a_file_that_is_written_over_keeps_its_permissions_and_a_link_its_target() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = folder(&[("a.g2o", GRAPH), ("b.json", "secret"), ("precious", "precious")]);
    let at = |name: &str| folder.path().join(name);
    fs::set_permissions(at("b.json"), fs::Permissions::from_mode(0o600)).unwrap();
    symlink(at("precious"), at("c.json")).unwrap();
    symlink(at("nothing"), at("d.json")).unwrap();
    for out in ["c.json", "d.json"] {
        let solve = format!("solve {} --out {}", path(&folder, "a.g2o"), path(&folder, out));
        manifactor(&solve).ended(2).complains("exists already");
    }
    for out in ["b.json", "c.json", "d.json"] {
        let solve = format!("solve {} --out {} --force", path(&folder, "a.g2o"), path(&folder, out));
        manifactor(&solve).ended(0);
    }
    assert_eq!(fs::metadata(at("b.json")).unwrap().permissions().mode() & 0o777, 0o600);
    assert_eq!(fs::read_to_string(at("precious")).unwrap(), "precious");
    assert!(!at("nothing").exists());
}

#[test]
fn a_folder_of_other_files_is_refused_before_any_work() {
    let folder = documents();
    for command in COMMANDS {
        let out = folder.path().join(format!("other_{}", command.0));
        fs::create_dir(&out).unwrap();
        fs::write(out.join("odometry.txt"), "a recording of years").unwrap();
        let ran = into(&folder, command, &out, "-vv").ended(2);
        ran.complains("has not written, such as odometry.txt");
        ran.complains("write into this one with --force");
        assert!(!ran.stderr.contains("compiled"), "{}", ran.stderr);
        assert_eq!(names(&out), ["odometry.txt"]);
        assert_eq!(fs::read_to_string(out.join("odometry.txt")).unwrap(), "a recording of years");
        done(&into(&folder, command, &out, "--force"));
        done(&into(&folder, command, &out, ""));
    }
}

#[test]
fn a_command_writes_again_into_its_own_folder_and_not_into_that_of_others() {
    let folder = documents();
    let out = COMMANDS.map(|command| {
        let out = folder.path().join(format!("of_{}", command.0));
        done(&into(&folder, command, &out, ""));
        fs::write(out.join("notes.txt"), "mine").unwrap();
        done(&into(&folder, command, &out, ""));
        assert_eq!(fs::read_to_string(out.join("notes.txt")).unwrap(), "mine");
        out
    });
    let ran = into(&folder, COMMANDS[1], &out[0], "").ended(2);
    ran.complains("holds the results of `manifactor run");
    fs::copy(path(&folder, "run.toml"), path(&folder, "other.toml")).unwrap();
    let ran = into(&folder, ("run", "other.toml"), &out[0], "").ended(2);
    ran.complains("would mix with them");
    done(&into(&folder, ("run", "other.toml"), &out[0], "--force"));
    // a run from the written config writes next to it
    done(&manifactor(&format!("run {}/estimate/config.toml", out[0].display())));
}

#[test]
fn a_folder_in_use_is_refused_and_the_process_named() {
    let folder = documents();
    for command in COMMANDS {
        let out = folder.path().join(command.0);
        fs::create_dir(&out).unwrap();
        let marker = out.join(".manifactor");
        fs::write(&marker, format!("manifactor {} \"before\"\nprocess 4242\n", command.0)).unwrap();
        let held = fs::File::open(&marker).unwrap();
        held.lock().unwrap();
        for force in ["", "--force"] {
            into(&folder, command, &out, force).ended(2).complains("in use: process 4242 writes into it");
        }
        assert_eq!(names(&out), [".manifactor"]);
        drop(held);
        done(&into(&folder, command, &out, ""));
    }
}

#[test]
fn a_sweep_touches_only_a_log_of_its_own() {
    let folder = documents();
    let out = folder.path().join("out");
    fs::create_dir_all(out.join("repeat")).unwrap();
    for (name, text) in
        [("trials.jsonl", "notes"), ("thesis.unfinished", "mine"), ("repeat/.b.unfinished", "mine")]
    {
        fs::write(out.join(name), text).unwrap();
    }
    into(&folder, COMMANDS[2], &out, "").ended(2).complains("has not written");
    let refused = into(&folder, COMMANDS[2], &out, "--force").ended(2);
    refused.complains("trials.jsonl:1 is no record of a trial");
    assert_eq!(fs::read_to_string(out.join("trials.jsonl")).unwrap(), "notes");
    fs::remove_file(out.join("trials.jsonl")).unwrap();
    into(&folder, COMMANDS[2], &out, "").ended(0);
    for name in ["thesis.unfinished", "repeat/.b.unfinished"] {
        assert_eq!(fs::read_to_string(out.join(name)).unwrap(), "mine");
    }
}

/// Creates a pipe that gives a text to its first reader; any later reader waits forever.
#[cfg(unix)]
fn pipe(folder: &tempfile::TempDir, name: &str, text: &'static str) -> String {
    let place = path(folder, name);
    assert!(std::process::Command::new("mkfifo").arg(&place).status().unwrap().success());
    let there = place.clone();
    std::thread::spawn(move || fs::write(there, text));
    place
}

#[test]
#[cfg(unix)]
fn a_pipe_is_read_once() {
    const LITERAL: &str = "variables = [{ key = 'x', value = { type = 'point1', position = [1.0] } }]\n\
        factors = [{ keys = ['x'], factor = { type = 'prior_point1', value = { position = [2.0] } } }]\n";
    let folder = folder(&[]);
    let run = |arguments: &str| {
        // a guard against endless waiting, not a measure of speed
        let mut command = std::process::Command::new("timeout");
        command.arg("120").arg(env!("CARGO_BIN_EXE_manifactor")).args(arguments.split_whitespace());
        let output = command.env("NO_COLOR", "1").output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        Ran { code: output.status.code().unwrap(), stdout: text(output.stdout), stderr: text(output.stderr) }
    };
    run(&format!("solve {}", pipe(&folder, "a.txt", GRAPH))).ended(0);
    run(&format!("check {}", pipe(&folder, "b.toml", LITERAL))).ended(0);
    let wrong = run(&format!("solve {}", pipe(&folder, "c.txt", "VERTEX_SE2 0 0 zero 0\n"))).ended(2);
    wrong.complains("expected a finite number, got `zero`");
    // the line itself, below the message
    wrong.complains("VERTEX_SE2 0 0 zero 0");
}
