//! Sweeps that are killed at random moments, and go on.
use crate::experiment::tables;
use crate::{folder, manifactor, path, root};
use rand::{RngExt, SeedableRng, rngs::StdRng};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Kills in all; `MANIFACTOR_KILLS` asks for more.
const KILLS: usize = 20;
/// Kills for each time that a sweep takes.
const OFTEN: f64 = 8.0;

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

/// Runs a sweep until it ends or is killed; whether it ended.
fn ends_within(config: &str, out: &str, time: Duration) -> bool {
    let mut child = Command::new(env!("CARGO_BIN_EXE_manifactor"))
        .current_dir(root())
        .args(["experiment", config, "--out", out, "--threads", "2"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let clock = Instant::now();
    while clock.elapsed() < time {
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
    let clock = Instant::now();
    manifactor(&format!("experiment {config} --out {whole} --threads 2")).ended(0);
    let undisturbed = clock.elapsed();
    let expected = tables(&whole);
    assert_eq!(String::from_utf8_lossy(&expected[0]).lines().count(), 251);

    let asked = std::env::var("MANIFACTOR_KILLS").map(|n| n.parse().unwrap());
    let mut rng = StdRng::seed_from_u64(9);
    let (mut left, mut sweeps) = (asked.unwrap_or(KILLS), 0);
    while left > 0 {
        let out = path(&folder, &format!("killed{sweeps}"));
        let mut ended = false;
        while left > 0 && !ended {
            ended = ends_within(&config, &out, undisturbed.mul_f64(rng.random_range(0.0..2.0) / OFTEN));
            left -= usize::from(!ended);
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
    eprintln!("{sweeps} sweeps, {undisturbed:.1?} each undisturbed");
}
