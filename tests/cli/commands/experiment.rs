use crate::endings::killed::{Moment, ends_before, trials};
use crate::{Ran, folder, manifactor, path, run};
use std::io::Write;
use std::path::Path;

const BASE: &str = r#"
semantics = "table_one"
source = { type = "simulated", scene = { objects = 4 }, trajectory = { frames = 25 } }
[[variants]]
name = "Q"
set = { semantics = [] }
[[variants]]
name = "Q+O"
"#;

/// Twelve trials; the four without room for their objects fail.
const SWEEP: &str = r#"
title = "small sweep"
base = "base.toml"
[[axes]]
columns = { area = "source.scene.area" }
rows = [[2.4, 1.6], [2.0, 2.0], [0.1, 0.1]]
[[axes]]
columns = { seed = "source.seed" }
rows = [1, 2]
[summary]
baseline = { variant = "Q" }
metrics = ["position", "shape"]
resamples = 200
"#;

pub(crate) fn tables(out: &str) -> Vec<Vec<u8>> {
    let files = ["trials.csv", "trials.parquet", "summary.csv", "summary.md", "summary.json"];
    files.map(|file| std::fs::read(Path::new(out).join(file)).unwrap()).into()
}

fn sweep(folder: &tempfile::TempDir, out: &str, threads: usize) -> Ran {
    manifactor(&format!("experiment {} --out {out} --threads {threads}", path(folder, "sweep.toml")))
}

#[test]
fn a_killed_sweep_goes_on_and_ends_with_the_same_tables() {
    let folder = folder(&[("base.toml", BASE), ("sweep.toml", SWEEP)]);
    let (whole, killed) = (path(&folder, "whole"), path(&folder, "killed"));
    let ran = sweep(&folder, &whole, 2).ended(0);
    assert!(ran.stdout.contains("minus the baseline") && ran.stdout.contains("position"), "{}", ran.stdout);

    // or it ends earlier, on a fast machine
    ends_before(&path(&folder, "sweep.toml"), Path::new(&killed), &Moment::Trials(3));
    let (log, done) = (format!("{killed}/trials.jsonl"), trials(Path::new(&killed)));
    assert!(done >= 3);
    // the line that a kill would have torn
    let mut file = std::fs::OpenOptions::new().append(true).open(&log).unwrap();
    file.write_all(b"{\"checksum\":\"0123456789abcdef\",\"labels\":[\"[2.0, 2.0]\",\"2\"").unwrap();
    drop(file);

    let ran = sweep(&folder, &killed, 1).ended(0);
    assert!(
        ran.stderr.contains(&format!("{done} of 12 trials done, {done} of them by earlier commands")),
        "{}",
        ran.stderr
    );
    assert_eq!(trials(Path::new(&killed)), 12);
    assert!(tables(&killed) == tables(&whole));
    // the third call has nothing to do
    let ran = sweep(&folder, &killed, 2).ended(0);
    assert!(ran.stderr.contains("12 of 12 trials done, 12 of them by earlier commands"), "{}", ran.stderr);
    assert_eq!(trials(Path::new(&killed)), 12);
}

#[test]
fn a_sweep_is_repeated_from_its_folder_alone() {
    let folder = folder(&[("base.toml", BASE), ("sweep.toml", SWEEP)]);
    let (first, again) = (path(&folder, "first"), path(&folder, "again"));
    let set = "--set set.source.scene.objects=2 --set summary.resamples=100";
    manifactor(&format!("experiment {} --out {first} {set}", path(&folder, "sweep.toml"))).ended(0);
    std::fs::remove_file(folder.path().join("base.toml")).unwrap();
    manifactor(&format!("experiment {first}/repeat/experiment.toml --out {again}")).ended(0);
    assert!(tables(&first) == tables(&again));
    let text = |out: &str| std::fs::read_to_string(format!("{out}/repeat/experiment.toml")).unwrap();
    assert_eq!(text(&first), text(&again));
}

#[test]
fn results_from_other_input_files_are_not_taken_over() {
    let base = "source = { type = 'recorded', folder = 'recording', camera = 'freiburg1' }\n";
    let sweep = "base = 'base.toml'\nsummary = { metrics = ['ate_se3'], resamples = 10 }\n\
                 axes = [{ columns = { sigma = 'odometry.noise.sigma' }, rows = [0.01, 0.02] }]\n";
    let files = folder(&[("desk.toml", BASE), ("base.toml", base), ("sweep.toml", sweep)]);
    let (recording, out) = (path(&files, "recording"), path(&files, "out"));
    manifactor(&format!("simulate {} --out {recording}", path(&files, "desk.toml"))).ended(0);
    let run = || {
        manifactor(&format!("experiment {} --out {out}", path(&files, "sweep.toml"))).ended(0);
        (lines_of_log(&out), tables(&out))
    };
    let first = run();
    assert_eq!(run(), first);
    // one pose is moved
    let odometry = format!("{recording}/odometry.txt");
    let text = std::fs::read_to_string(&odometry).unwrap();
    let line = text.lines().nth(12).unwrap();
    let mut numbers: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
    numbers[1] = (numbers[1].parse::<f64>().unwrap() + 0.05).to_string();
    std::fs::write(&odometry, text.replace(line, &numbers.join(" "))).unwrap();
    let second = run();
    assert_eq!(second.0, first.0 + 2, "both trials are run again");
    assert_ne!(second.1, first.1);
}

/// Returns the number of lines in the log of an experiment.
fn lines_of_log(out: &str) -> usize {
    std::fs::read_to_string(format!("{out}/trials.jsonl")).unwrap().lines().count()
}

#[test]
fn a_failed_trial_is_a_row_with_its_reason() {
    let folder = folder(&[("base.toml", BASE), ("sweep.toml", SWEEP)]);
    let out = path(&folder, "out");
    sweep(&folder, &out, 2).ended(0);
    let table = std::fs::read_to_string(format!("{out}/trials.csv")).unwrap();
    let rows: Vec<&str> = table.lines().collect();
    assert_eq!(rows.len(), 13);
    assert!(rows[0].starts_with("area,seed,variant,status,reason,ate_se3"), "{}", rows[0]);
    let failed: Vec<_> = rows.iter().filter(|row| row.contains(",failed,")).collect();
    assert_eq!(failed.len(), 4);
    assert!(failed.iter().all(|row| row.contains("there is no room for object")), "{failed:?}");
    let summary = std::fs::read_to_string(format!("{out}/summary.md")).unwrap();
    assert!(summary.contains("| Q+O | 6 | 2 |"), "{summary}");
}

#[test]
fn mistakes_of_an_experiment_are_told_at_their_line() {
    let wrong = SWEEP.replace("variant = \"Q\"", "variant = \"R\"").replace("source.seed", "source.sed");
    let folder = folder(&[("base.toml", BASE), ("sweep.toml", &wrong)]);
    let config = path(&folder, "sweep.toml");
    let ran = run(["experiment", &config], &[]).ended(2);
    ran.complains("unknown variant `R`");
    let fixed = wrong.replace("variant = \"R\"", "variant = \"Q\"");
    std::fs::write(&config, fixed).unwrap();
    run(["experiment", &config], &[]).ended(2).complains("unknown field `sed`");
    let metric = |name: &str| SWEEP.replace("\"shape\"", &format!("\"{name}\""));
    std::fs::write(&config, metric("ate_se33")).unwrap();
    run(["experiment", &config], &[]).ended(2).complains("unknown metric `ate_se33`");
    std::fs::write(&config, metric("ate_sim3")).unwrap();
    run(["experiment", &config], &[]).ended(2).complains("no trial has the metric `ate_sim3`");
    std::fs::write(&config, SWEEP.replace("rows = [1, 2]", "rows = [1, 0x1]")).unwrap();
    run(["experiment", &config], &[]).ended(2).complains("`0x1` sets the same as `1`");
    let many = run(["experiment", &config, "--set", "summary.resamples=4611686018427387904"], &[]).ended(2);
    many.complains("expected a number of at most 1000000, got 4611686018427387904");
    std::fs::write(&config, SWEEP.replace("base.toml", "bass.toml")).unwrap();
    run(["experiment", &config], &[]).ended(3).complains("bass.toml");
}

#[test]
fn parts_of_a_sweep_end_with_the_same_tables_when_they_are_put_together() {
    let folder = folder(&[("base.toml", BASE), ("sweep.toml", SWEEP)]);
    let (whole, parts) = (path(&folder, "whole"), path(&folder, "parts"));
    sweep(&folder, &whole, 2).ended(0);
    let part = |text: &str| {
        manifactor(&format!("experiment {} --out {parts} --shard {text}", path(&folder, "sweep.toml")))
    };
    // one part is left for the end, and one was torn
    for text in ["1/3", "3/3"] {
        let ran = part(text).ended(0);
        assert!(
            ran.stderr.contains("The 4 trials of this part are in") && ran.stdout.is_empty(),
            "{}",
            ran.stderr
        );
    }
    assert!(!Path::new(&parts).exists());
    let log = format!("{parts}.shards/3-of-3/trials.jsonl");
    let text = std::fs::read_to_string(&log).unwrap();
    std::fs::write(&log, &text[..text.len() - 20]).unwrap();
    let ran = sweep(&folder, &parts, 1).ended(0);
    assert!(ran.stderr.contains("7 of 12 trials done, 7 of them by earlier commands"), "{}", ran.stderr);
    assert_eq!(tables(&parts), tables(&whole));
    let ran = part("4/3").ended(2);
    assert!(
        ran.stderr.contains("expected K/N, the K-th of N parts, such as 2/8; got `4/3`"),
        "{}",
        ran.stderr
    );
}
