use crate::harness::{Case, account, ended, text};

const RUN: &str = r#"title = "desk"
[source]
type = "simulated"
seed = 1
[source.trajectory]
frames = 30
[source.scene]
objects = 3
"#;

fn change(name: &'static str, from: &str, to: &str) -> Case {
    assert!(RUN.contains(from), "{from}");
    text(name, RUN.replacen(from, to, 1))
}
fn with(name: &'static str, more: &str) -> Case {
    text(name, format!("{RUN}{more}\n"))
}

#[test]
fn documents_of_runs() {
    let cases = vec![
        text("empty", ""),
        text("no source", "title = \"nothing\"\n"),
        change("unknown source", "simulated", "simulatd"),
        change("negative seed", "seed = 1", "seed = -1"),
        change("no frames", "frames = 30", "frames = 0"),
        change("negative frames", "frames = 30", "frames = -3"),
        change("no objects", "objects = 3", "objects = 0"),
        change("more frames than memory", "frames = 30", "frames = 99999999999999"),
        change("share above one", "objects = 3", "objects = 3\ntilted = 1.5"),
        change("share not a number", "objects = 3", "objects = 3\ntilted = nan"),
        change("more objects than can be placed", "objects = 3", "objects = 9223372036854775807"),
        with("more images than a page holds", "[report]\nimages = 4611686018427387904"),
        with("noise negative", "[detections]\nnoise = { sigma = -5.0 }"),
        with("noise of another size", "[detections]\nnoise = { sigmas = [1.0, 1.0] }"),
        with("unknown model", "[detections]\nmodel = \"round\""),
        with("unknown initialiser", "[objects]\ninitialiser = { type = \"svdd\" }"),
        with("too few views", "[objects]\nmin_views = -2"),
        with("unknown section", "[object]\nmin_views = 3"),
        with("rule without a factor", "[[semantics]]\nclasses = [\"cup\"]"),
        with("rule without classes", "[[semantics]]\nfactor = { type = \"vertical_orientation\" }"),
        with(
            "rule with a factor of poses",
            "[[semantics]]\nclasses = [\"cup\"]\nfactor = { type = \"prior_se3\", mean = { rotation = [0, 0, 0, 1], translation = [0, 0, 0] } }",
        ),
        with("gravity along nothing", "[gravity]\ntype = \"vector\"\nup = [0.0, 0.0, 0.0]"),
        with("gravity not a number", "[gravity]\ntype = \"vector\"\nup = [0.0, nan, 1.0]"),
        with("gravity from what is not there", "[gravity]\ntype = \"accelerometer\""),
        with("variant without a name", "[[variants]]\nset = { semantics = [] }"),
        with("one variant twice", "[[variants]]\nname = \"a\"\n[[variants]]\nname = \"a\""),
        with(
            "variant that sets what is not there",
            "[[variants]]\nname = \"a\"\nset = { solvr = { type = \"auto\" } }",
        ),
        change(
            "camera of no width",
            "seed = 1",
            "seed = 1\ncamera = { fx = 320.0, fy = 320.0, cx = 320.0, cy = 240.0, width = 0, height = 480 }",
        ),
        change(
            "camera of no focal length",
            "seed = 1",
            "seed = 1\ncamera = { fx = 0.0, fy = 320.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }",
        ),
        change("unknown camera", "seed = 1", "seed = 1\ncamera = \"nikon\""),
    ];
    insta::assert_snapshot!(account("run.toml", "run FILE --out out", cases));
}

/// A run of recorded files.
const RECORDED: &str = r#"[source]
type = "recorded"
folder = "recording"
camera = { fx = 320.0, fy = 320.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }
"#;

/// A rule whose factor needs the up direction.
const UPRIGHT: &str = "[[semantics]]\nclasses = [\"cup\"]\nfactor = { type = \"vertical_orientation\" }\n";

#[test]
fn up_directions_that_nothing_determines() {
    let near = "[[semantics]]\nclasses = [\"cup\"]\nnear = { classes = [\"table\"], within_m = 1.0, below = true }\n\
                factor = { type = \"shape_prior\", semi_axes = [0.1, 0.1, 0.1] }\n";
    let association = "association = { type = \"likelihood\" }\n";
    let tum = "source = { type = \"tum\", sequence = \"fr1_desk\", odometry = \"odometry.txt\" }\n";
    let cases = vec![
        text("a recording without up", format!("{RECORDED}{UPRIGHT}")),
        text("a recording without up, with association", format!("{association}{RECORDED}{UPRIGHT}")),
        text("a condition on the object below", format!("{RECORDED}{near}")),
        text("a data set without up", format!("{tum}{UPRIGHT}")),
    ];
    insta::assert_snapshot!(account("run.toml", "check FILE", cases));
}

#[test]
fn files_of_a_recording_that_do_not_exist() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    std::fs::write(place.join("run.toml"), RECORDED).unwrap();
    let absolute = RECORDED.replace("\"recording\"", "\"/nowhere\"");
    std::fs::write(place.join("absolute.toml"), absolute).unwrap();
    std::fs::create_dir(place.join("recording")).unwrap();
    let lines = "[source]\ntype = \"json_lines\"\nfile = \"frames.jsonl\"\n\
                 camera = { fx = 320.0, fy = 320.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }\n";
    std::fs::write(place.join("lines.toml"), lines).unwrap();
    let commands = [
        "check run.toml",
        "run run.toml --out out",
        "check absolute.toml",
        "run absolute.toml --out out",
        "check lines.toml",
        "check run.toml --set source.folder=recordings",
        "check run.toml --set source.folder=recordings --data .",
    ];
    let all = commands.map(|command| format!("$ {command}\n{}\n", ended(place, command, "")));
    insta::assert_snapshot!(all.concat());
}

#[test]
fn places_that_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    std::fs::write(place.join("run.toml"), RUN).unwrap();
    std::fs::write(place.join("file"), "").unwrap();
    std::fs::write(
        place.join("g.g2o"),
        "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n",
    )
    .unwrap();
    let commands = [
        "run run.toml --out file",
        "run run.toml --out file/out",
        "run run.toml --out /dev/full/out",
        "run run.toml --set nothing=1 --out out",
        "run run.toml --set seed --out out",
        "run run.toml --data nothing --out out",
        "solve g.g2o --out file/solved.json",
        "solve g.g2o --out solved.nothing",
        "solve g.g2o --out nothing/solved.json",
        "solve g.g2o --solver nothing",
        "solve g.g2o --start nothing",
        "solve g.g2o --covariances x9",
        "simulate run.toml --out file",
    ];
    let all = commands.map(|command| format!("$ {command}\n{}\n", ended(place, command, "")));
    insta::assert_snapshot!(all.concat());
}
