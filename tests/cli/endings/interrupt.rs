//! Ctrl-C and SIGTERM during a solve, triggered by the program's messages and not by time.
use crate::{Ran, folder, manifactor, path, root};
use serde_json::Value;
use std::io::{BufRead, BufReader, Lines, Read, Write};
use std::process::{Child, ChildStderr, Command, Stdio};

/// Gauss-Newton on x² + 1, which has no root: x jumps forever, and no step is the last. The cost rises only
/// if |x| < 1/√3, never in two steps in a row, so the solver never detects divergence.
pub(crate) const ENDLESS: &str = r#"
[solver]
type = "gauss_newton"
stop = { max_iterations = 1000000000, relative_cost = 0.0, absolute_cost = 0.0, gradient = 0.0, step = 0.0 }
[[variables]]
key = "root"
value = { type = "point1", position = [0.7] }
[[factors]]
keys = ["root"]
factor = { type = "expression", variables = { x = "point1" }, residual = ["x * x + 1"] }
"#;

/// A run without detections: poses connected by odometry alone.
pub(crate) const RUN: &str = r#"
source = { type = "simulated", scene = { objects = 1 }, trajectory = { frames = 6 }, detector = { missed = 1.0 } }
"#;

/// The binary at work, with its messages line by line.
pub(crate) struct AtWork {
    child: Child,
    stderr: Lines<BufReader<ChildStderr>>,
    said: String,
}

impl AtWork {
    pub(crate) fn begin(arguments: &str) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_manifactor"))
            .current_dir(root())
            .args(arguments.split_whitespace())
            .args(["-v", "--threads", "1"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let stderr = BufReader::new(child.stderr.take().unwrap()).lines();
        Self { child, stderr, said: String::new() }
    }

    /// Reads until these words, and a few lines more.
    pub(crate) fn until(mut self, words: &str, more: usize) -> Self {
        let mut heard = false;
        while !heard {
            let Some(line) = self.stderr.next() else { panic!("no `{words}` in:\n{}", self.said) };
            let line = line.unwrap();
            heard = line.contains(words);
            self.said += &(line + "\n");
        }
        self.stderr.by_ref().take(more).for_each(|line| self.said += &(line.unwrap() + "\n"));
        self
    }

    /// Sends a signal, unless the process has already ended.
    fn signal(self, signal: &str) -> Self {
        let _ = Command::new("kill").args([signal, &self.child.id().to_string()]).output().unwrap();
        self
    }

    /// Sends a signal, unless the process has already ended, and waits for the end.
    pub(crate) fn ended_by(self, signal: &str) -> Ran {
        self.signal(signal).end()
    }

    fn end(mut self) -> Ran {
        self.stderr.for_each(|line| self.said += &(line.unwrap() + "\n"));
        let mut stdout = String::new();
        self.child.stdout.take().unwrap().read_to_string(&mut stdout).unwrap();
        let code = self.child.wait().unwrap().code().unwrap();
        Ran { code, stdout, stderr: self.said }
    }
}

fn read(file: &str) -> Value {
    serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap()
}

#[test]
#[cfg(unix)]
fn a_signal_ends_a_solve_with_the_best_values_written() {
    let folder = folder(&[("graph.toml", ENDLESS)]);
    for signal in ["-INT", "-TERM"] {
        let out = path(&folder, &format!("solved{signal}.json"));
        let solve = AtWork::begin(&format!("solve {} --out {out}", path(&folder, "graph.toml")));
        let ran = solve.until("iteration", 20).ended_by(signal).ended(130);
        assert!(ran.stderr.contains("interrupted: writing the results so far"), "{}", ran.stderr);
        assert!(ran.stdout.contains("interrupted"), "{}", ran.stdout);
        // complete, and no worse than the initial value
        let x = read(&out)["variables"][0]["value"]["position"][0].as_f64().unwrap();
        assert!(x.abs() < 0.7, "{x}");
        let files = std::fs::read_dir(folder.path()).unwrap();
        let left = files.filter(|f| f.as_ref().unwrap().file_name().to_string_lossy().starts_with('.'));
        assert_eq!(left.count(), 0, "a half-written file is left");
    }
}

/// Two variants: the first ends after this number of steps, the second does not end.
fn two_variants(steps: u32) -> String {
    let first = format!("name = \"first\"\nset = {{ solver = {{ stop = {{ max_iterations = {steps} }} }} }}");
    format!("{RUN}{ENDLESS}[[variants]]\n{first}\n[[variants]]\nname = \"second\"\n")
}

#[test]
#[cfg(unix)]
fn a_signal_at_any_time_leaves_a_folder_that_says_it_is_partial() {
    let (endless, short) = (two_variants(1_000_000_000), two_variants(2));
    let folder = folder(&[("endless.toml", &endless), ("short.toml", &short)]);
    let moments = [
        ("endless", "variant first", 0, "-TERM", 1),
        ("endless", "iteration", 20, "-INT", 1),
        ("short", "variant second", 0, "-INT", 2),
        ("short", "variant second", 20, "-TERM", 2),
    ];
    for (i, (document, words, more, signal, variants)) in moments.into_iter().enumerate() {
        let (config, out) = (path(&folder, &format!("{document}.toml")), path(&folder, &format!("out{i}")));
        AtWork::begin(&format!("run {config} --out {out}")).until(words, more).ended_by(signal).ended(130);
        let report = read(&format!("{out}/report.json"));
        assert_eq!(report["complete"], false);
        let done = report["variants"].as_array().unwrap();
        assert_eq!(done.len(), variants);
        assert_eq!(done[variants - 1]["solve"]["termination"]["status"], "interrupted");
        let files = std::fs::read_dir(format!("{out}/{}", ["first", "second"][variants - 1])).unwrap();
        let names: Vec<_> = files.map(|f| f.unwrap().file_name().to_string_lossy().into_owned()).collect();
        assert!(names.len() >= 8 && names.iter().all(|name| !name.starts_with('.')), "{names:?}");
    }
}

#[test]
#[cfg(unix)]
fn a_signal_after_the_last_picture_interrupts_nothing() {
    let folder = folder(&[("run.toml", RUN)]);
    let (config, out) = (path(&folder, "run.toml"), path(&folder, "out"));
    AtWork::begin(&format!("run {config} --out {out}"))
        .until("all pictures are drawn", 0)
        .ended_by("-INT")
        .ended(0);
    assert_eq!(read(&format!("{out}/report.json"))["complete"], true);
    manifactor(&format!("check {out}/estimate/config.toml")).ended(0);
}

#[test]
#[cfg(unix)]
fn a_signal_ends_the_drawing_of_pictures() {
    let folder = folder(&[("run.toml", RUN)]);
    let (config, out, plots) = (path(&folder, "run.toml"), path(&folder, "out"), path(&folder, "plots"));
    manifactor(&format!("run {config} --out {out}")).ended(0);
    // a pipe instead of the record: the command waits for it after installing its signal handler
    let record = std::fs::read(format!("{out}/record.json")).unwrap();
    let pipe = path(&folder, "run/record.json");
    std::fs::create_dir(path(&folder, "run")).unwrap();
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let plot = AtWork::begin(&format!("plot {} --out {plots}", path(&folder, "run")));
    let mut writer = std::fs::File::options().write(true).open(&pipe).unwrap();
    let plot = plot.signal("-INT").until("interrupted: writing the results so far", 0);
    writer.write_all(&record).unwrap();
    drop(writer);
    let ran = plot.end().ended(130);
    ran.complains("pictures of estimate are missing");
    let files = std::fs::read_dir(format!("{plots}/estimate")).unwrap();
    let files: Vec<_> = files.map(|file| file.unwrap().file_name()).collect();
    assert_eq!(files, ["map.ply"]);
}
