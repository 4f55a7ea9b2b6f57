//! The table of endings in `docs/reference/exit-codes.md`.
use crate::endings::interrupt::{AtWork, ENDLESS, RUN};
use crate::{folder, path, root, run};
use std::process::{Command, Stdio};
use tempfile::TempDir;

const SEEN: &str = "source = { type = 'simulated', scene = { objects = 2 }, trajectory = { frames = 12 } }\n";

/// A variable at 0.7 with one factor: `residual` of x.
fn graph(residual: &str, domain: &str) -> String {
    format!(
        "[[variables]]\nkey = 'x'\nvalue = {{ type = 'point1', position = [0.7] }}\n[[factors]]\nkeys = ['x']\n\
         factor = {{ type = 'expression', variables = {{ x = 'point1' }}, residual = ['{residual}'], domain = [{domain}] }}\n"
    )
}

fn files() -> TempDir {
    let sweep = "base = 'seen.toml'\nset = { objects = { min_views = 1 } }\n\
                 axes = [{ columns = { area = 'source.scene.area' }, rows = [[2.4, 1.6], [0.1, 0.1]] }]\n";
    folder(&[
        ("good.toml", &graph("x - 1", "")),
        ("root.toml", &graph("sqrt(x - 1)", "")),
        ("open.toml", &(graph("x - 1", "") + &graph("x - 1", "'-1 - x * x'").replace("'x'", "'y'"))),
        ("asleep.toml", &graph("x - 1", "'-1 - x * x'")),
        ("word.toml", &graph("x - one", "")),
        ("rising.toml", &graph("sqrt(sqrt(sqrt(x * x)))", "")),
        ("endless.toml", ENDLESS),
        ("bad.g2o", "VERTEX_SE2 0 0 zero 0\n"),
        ("run.toml", RUN),
        ("seen.toml", SEEN),
        ("sweep.toml", sweep),
        (
            "elsewhere.toml",
            "source = { type = 'recorded', folder = 'nowhere', camera = { fx = 320.0, fy = 320.0, cx = 320.0, cy = 240.0, width = 640, height = 480 } }\n",
        ),
        (
            "late.toml",
            "source = { type = 'recorded', folder = 'sim', camera = { fx = 320.0, fy = 320.0, cx = 320.0, cy = 240.0, width = 640, height = 480 } }\n",
        ),
        ("unread.toml", "base = 'nowhere.toml'\n"),
    ])
}

/// The exit codes of commands with this ending.
fn codes(ending: &str) -> Vec<i32> {
    let folder = files();
    let at = |name: &str| path(&folder, name);
    let code = |command: &str| {
        let words = command.split_whitespace().map(|word| word.strip_prefix('@').map_or(word.to_owned(), at));
        let words: Vec<String> = words.collect();
        run(words.iter().map(String::as_str), &[]).code
    };
    let codes = |commands: &[&str]| commands.iter().map(|command| code(command)).collect();
    match ending {
        "done" => codes(&[
            "solve @good.toml",
            "graph @good.toml --solve",
            "check @good.toml",
            "run @seen.toml --out @out --set objects.min_views=1",
            "--help",
            "list --help",
            "--version",
        ]),
        "interrupted, when all was done" => {
            let work = AtWork::begin(&format!("run {} --out {}", at("run.toml"), at("out")));
            vec![work.until("all pictures are drawn", 0).ended_by("-INT").code]
        }
        "a sweep is complete, though trials of it failed" => codes(&["experiment @sweep.toml --out @out"]),
        "stalled" => codes(&["solve @rising.toml --solver gauss_newton"]),
        "the allowed iterations are used up" => {
            codes(&["solve @endless.toml --set solver.stop.max_iterations=3"])
        }
        "indeterminate" => codes(&["solve @open.toml --solver gauss_newton"]),
        "no factor takes part" => codes(&["solve @good.toml --drop 0", "solve @asleep.toml"]),
        "a residual is not finite" => codes(&["solve @root.toml"]),
        "objects were detected, and none is mapped" => {
            codes(&["run @seen.toml --out @out --set objects.min_views=1000"])
        }
        "more detections than the source expects have no pose at their time" => {
            code("simulate @seen.toml --out @sim");
            let file = folder.path().join("sim/detections.csv");
            let text = std::fs::read_to_string(&file).unwrap();
            // every second frame is 4 ms late
            let late = |line: &str| {
                let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
                if let Ok(timestamp) = cells[1].parse::<f64>() {
                    cells[1] = (timestamp
                        + if cells[0].ends_with(['0', '2', '4', '6', '8']) { 0.004 } else { 0.0 })
                    .to_string();
                }
                cells.join(",") + "\n"
            };
            std::fs::write(&file, text.lines().map(late).collect::<String>()).unwrap();
            let run = "run @late.toml --out @out --force --set objects.min_views=1";
            assert_eq!(code(&format!("{run} --set source.max_without_pose=1.0")), 0);
            codes(&[run])
        }
        "many boxes lie outside of the image" => {
            let small = "--set source.camera.width=300 --set source.camera.cx=150";
            code("simulate @seen.toml --out @sim");
            let run = "run @late.toml --out @out --force --set objects.min_views=1";
            assert_eq!(code(run), 0);
            codes(&[&format!("{run} {small}")])
        }
        "there are boxes, and none can be used" => {
            let simulated = run(["simulate", &at("seen.toml"), "--lines"], &[]).stdout;
            let in_percent = |line: &str| {
                let mut frame: serde_json::Value = serde_json::from_str(line).unwrap();
                for seen in frame["boxes"].as_array_mut().unwrap() {
                    seen["score"] = 70.0.into();
                }
                format!("{frame}\n")
            };
            let lines: String = simulated.lines().map(in_percent).collect();
            std::fs::write(at("percent.jsonl"), lines).unwrap();
            let camera =
                "camera = { fx = 320.0, fy = 320.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }";
            let source = format!("source = {{ type = 'json_lines', file = 'percent.jsonl', {camera} }}\n");
            std::fs::write(at("percent.toml"), source).unwrap();
            codes(&["run @percent.toml --out @out", "online @percent.toml --out @out2"])
        }
        "readings of an IMU are damaged, or most tracks give no landmark" => {
            let flight = root().join("examples/flight");
            let copy = |name: &str| std::fs::read_to_string(flight.join(name)).unwrap();
            let clipped = |line: &str| {
                let cells = line.split(',').enumerate().map(|(i, cell)| match (i, cell.parse::<f64>()) {
                    (1..=3, Ok(rate)) => rate.clamp(-0.5, 0.5).to_string(),
                    _ => cell.to_owned(),
                });
                cells.collect::<Vec<_>>().join(",") + "\n"
            };
            let renumbered = |(i, line): (usize, &str)| {
                let cells: Vec<&str> = line.split(',').collect();
                let number = if i == 0 { cells[1].to_owned() } else { i.to_string() };
                format!("{},{number},{},{}\n", cells[0], cells[2], cells[3])
            };
            let (imu, tracks) = (copy("imu.csv"), copy("tracks.csv"));
            let files = [
                ("truth.csv", copy("truth.csv")),
                ("vio.toml", copy("vio.toml")),
                ("clipped.csv", imu.lines().map(clipped).collect()),
                ("renumbered.csv", tracks.lines().enumerate().map(renumbered).collect()),
                ("imu.csv", imu.clone()),
                ("tracks.csv", tracks.clone()),
            ];
            files.iter().for_each(|(name, text)| std::fs::write(at(name), text).unwrap());
            let vio = "vio @vio.toml --out @out --force";
            assert_eq!([code(vio), code("doctor @vio.toml")], [0, 0]);
            codes(&[
                &format!("{vio} --set imu=clipped.csv"),
                "doctor @vio.toml --set imu=clipped.csv",
                &format!("{vio} --set tracks=renumbered.csv"),
            ])
        }
        "a journal cannot be kept" => {
            let online = "online @seen.toml --out @out --force --set objects.min_views=1 --journal";
            assert_eq!(code(&format!("{online} @frames.jsonl")), 0);
            // among the results, which would overwrite it
            assert_eq!(code(&format!("{online} @out/report.json")), 2);
            codes(&[&format!("{online} @nowhere/frames.jsonl"), &format!("{online} /proc/frames.jsonl")])
        }
        "a factor breaks a law" => codes(&["check-factor --config @root.toml"]),
        "the command line is wrong" => {
            codes(&["solve", "solv @good.toml", "solve @good.toml --set", "explain nothing"])
        }
        "a document or a file of data is wrong" => {
            codes(&["solve @word.toml", "run @good.toml", "solve @bad.g2o"])
        }
        "a file or folder is not there, or cannot be read" => codes(&[
            "solve nowhere.toml",
            "solve nowhere.g2o",
            "check nowhere.yaml",
            "run nowhere.toml",
            "run @elsewhere.toml --out @out",
            "experiment nowhere.toml",
            "experiment @unread.toml --out @out",
            "evaluate nowhere.txt nowhere.txt",
        ]),
        "a file cannot be written" => {
            codes(&["solve @good.toml --out @nowhere/a.json", "run @run.toml --out @run.toml/out"])
        }
        "standard output cannot be written, or its reader has gone" => {
            let mut command = Command::new(env!("CARGO_BIN_EXE_manifactor"));
            command.args(["list", "factors"]).stderr(Stdio::null());
            let (reader, unheard) = std::io::pipe().unwrap();
            drop(reader);
            let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
            let mut code = |out: Stdio| command.stdout(out).status().unwrap().code().unwrap();
            vec![code(unheard.into()), code(full.into())]
        }
        "interrupted before that; the best so far is written" => {
            let work = AtWork::begin(&format!("solve {} --out {}", at("endless.toml"), at("out.json")));
            vec![work.until("iteration", 5).ended_by("-TERM").code]
        }
        _ => panic!("nothing here ends so: {ending}"),
    }
}

#[test]
#[cfg(unix)]
fn every_ending_of_the_table_has_its_code() {
    let page = std::fs::read_to_string(root().join("docs/reference/exit-codes.md")).unwrap();
    let (_, table) = page.split_once("### Endings\n").unwrap();
    let table = table.split("\n\n").find(|part| part.starts_with('|')).unwrap();
    let rows: Vec<(&str, i32)> = table
        .lines()
        .skip(2)
        .map(|line| {
            let (ending, code) = line.trim_matches(['|', ' ']).rsplit_once('|').unwrap();
            (ending.trim(), code.trim().parse().unwrap())
        })
        .collect();
    assert!(rows.len() >= 15, "{rows:?}");
    for (ending, expected) in rows {
        let found = codes(ending);
        assert!(
            !found.is_empty() && found.iter().all(|code| *code == expected),
            "{ending}: {expected}, {found:?}"
        );
    }
}
