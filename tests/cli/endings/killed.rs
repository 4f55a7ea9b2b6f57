//! Sweeps that are killed at random moments of their work, and continued.
use crate::commands::experiment::tables;
use crate::{folder, manifactor, path, root};
use rand::{RngExt, SeedableRng, rngs::StdRng};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Number of kills; `MANIFACTOR_KILLS` sets a different one.
const KILLS: usize = 20;
/// Largest number of trials between two kills.
const APART: usize = 60;

const BASE: &str = r#"
semantics = "table_one"
source = { type = "simulated", scene = { objects = 1 }, trajectory = { frames = 6 } }
objects = { refinements = 1 }
[[variants]]
name = "Q"
set = { semantics = [] }
[[variants]]
name = "Q+O"
"#;

/// 250 trials: 125 seeds, two variants.
fn sweep() -> String {
    let seeds: Vec<String> = (0..125).map(|seed| seed.to_string()).collect();
    format!(
        "base = \"base.toml\"\n[[axes]]\ncolumns = {{ seed = \"source.seed\" }}\nrows = [{}]\n\
         [summary]\nbaseline = {{ variant = \"Q\" }}\nmetrics = [\"position\"]\nresamples = 50\n",
        seeds.join(", ")
    )
}

/// The moment of a kill, defined by visible progress and not by a time, which depends on the machine.
pub(crate) enum Moment {
    /// The journal has this number of trials.
    Trials(usize),
    /// This file exists.
    File(&'static str),
}

impl Moment {
    /// Returns a random moment. The tables are written quickly, but one moment in eight is among them.
    fn any(rng: &mut StdRng, done: usize) -> Self {
        const FILES: [&str; 6] = [
            "repeat/base.toml",
            "trials.csv",
            "trials.parquet",
            "summary.json",
            "position.svg",
            "report.html",
        ];
        match rng.random_range(0..8) {
            0 => Self::File(FILES[rng.random_range(0..FILES.len())]),
            _ => Self::Trials(done + rng.random_range(0..APART)),
        }
    }

    fn has_come(&self, out: &Path) -> bool {
        match self {
            Self::Trials(n) => trials(out) >= *n,
            Self::File(name) => out.join(name).exists(),
        }
    }
}

/// Returns the number of complete lines in the journal.
pub(crate) fn trials(out: &Path) -> usize {
    let journal = std::fs::read(out.join("trials.jsonl")).unwrap_or_default();
    journal.iter().filter(|byte| **byte == b'\n').count()
}

/// Runs a sweep until it ends or is killed at the moment; returns whether it ended.
pub(crate) fn ends_before(config: &str, out: &Path, moment: &Moment) -> bool {
    let mut child = Command::new(env!("CARGO_BIN_EXE_manifactor"))
        .current_dir(root())
        .args(["experiment", config, "--threads", "2", "--out"])
        .arg(out)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while !moment.has_come(out) {
        if let Some(status) = child.try_wait().unwrap() {
            assert!(status.success(), "{status}");
            return true;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap().success()
}

#[test]
fn sweeps_that_are_killed_at_any_moment_end_with_the_same_tables() {
    let folder = folder(&[("base.toml", BASE), ("sweep.toml", &sweep())]);
    let (config, whole) = (path(&folder, "sweep.toml"), path(&folder, "whole"));
    manifactor(&format!("experiment {config} --out {whole} --threads 2")).ended(0);
    let expected = tables(&whole);
    assert_eq!(String::from_utf8_lossy(&expected[0]).lines().count(), 251);

    let asked = std::env::var("MANIFACTOR_KILLS").map(|n| n.parse().unwrap());
    let mut rng = StdRng::seed_from_u64(9);
    let (mut left, mut sweeps) = (asked.unwrap_or(KILLS), 0);
    while left > 0 {
        let out = path(&folder, &format!("killed{sweeps}"));
        let mut ended = false;
        while left > 0 && !ended {
            let place = Path::new(&out);
            ended = ends_before(&config, place, &Moment::any(&mut rng, trials(place)));
            left -= 1;
        }
        manifactor(&format!("experiment {config} --out {out} --threads 2")).ended(0);
        assert!(tables(&out) == expected, "after {sweeps} sweeps");
        for place in [Path::new(&out), &Path::new(&out).join("repeat")] {
            let names = std::fs::read_dir(place).unwrap().map(|f| f.unwrap().file_name());
            let unfinished: Vec<_> =
                names.filter(|name| name.to_string_lossy().ends_with(".unfinished")).collect();
            assert!(unfinished.is_empty(), "half-written files are left: {unfinished:?}");
        }
        sweeps += 1;
    }
}
