//! A file of a kind that a command does not take: the error names the kind and the command for it.
use crate::{fed, folder, manifactor, path};

const GRAPH: &str = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n";
const LITERAL: &str = "[[variables]]\nkey = 'x'\nvalue = { type = 'point1', position = [0.7] }\n[[factors]]\nkeys = ['x']\n\
                       factor = { type = 'prior_point1', value = { position = [0.0] } }\n";
const RUN: &str = "source = { type = 'simulated', scene = { objects = 2 }, trajectory = { frames = 12 } }\nobjects = { min_views = 1 }\n";
const EXPERIMENT: &str = "base = 'run.toml'\n[[axes]]\ncolumns = { seed = 'source.seed' }\nrows = [1, 2]\n";
const RULES: &str = "[[semantics]]\nclasses = ['cup']\nfactor = { type = 'vertical_orientation' }\n";
const TRAJECTORY: &str =
    "# timestamp tx ty tz qx qy qz qw\n0.0 0 0 0 0 0 0 1\n0.1 1 0 0 0 0 0 1\n0.2 2 0 0 0 0 0 1\n";
const BOXES: &str = "timestamp,class_name,score,xmin,ymin,xmax,ymax\n0.0,cup,0.9,1,2,30,40\n";
const FRAME: &str = r#"{"timestamp": 0.1, "pose": {"translation": [0.0, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0]}, "boxes": []}"#;

fn files() -> tempfile::TempDir {
    let frames = format!("{FRAME}\n{FRAME}\n");
    folder(&[
        ("a.g2o", GRAPH),
        ("graph.toml", LITERAL),
        ("run.toml", RUN),
        ("sweep.toml", EXPERIMENT),
        ("rules.toml", RULES),
        ("truth.txt", TRAJECTORY),
        ("boxes.csv", BOXES),
        ("frames.jsonl", &frames),
        ("frames.json", &frames),
    ])
}

/// Runs a command whose file does not fit. `@NAME` is a path in `folder`.
fn refused(folder: &tempfile::TempDir, command: &str, is: &str, remedy: &str) {
    let at = |text: &str| text.replace('@', &format!("{}/", folder.path().display()));
    let ran = manifactor(&at(command)).ended(2);
    // messages are wrapped, in paths too
    let joined = |text: &str| text.replace('│', " ").split_whitespace().collect::<String>();
    for text in [at(is), at(remedy)] {
        assert!(joined(&ran.stderr).contains(&joined(&text)), "{command}: no `{text}` in:\n{}", ran.stderr);
    }
    assert_eq!(ran.stderr.matches('×').count(), 1, "{command}: more than one error:\n{}", ran.stderr);
}

#[test]
fn a_document_of_a_different_kind_is_refused_with_the_command_for_it() {
    let folder = files();
    for (command, is, remedy) in [
        ("run @a.g2o", "@a.g2o is a graph; expected the document of a run", "`manifactor solve @a.g2o`"),
        ("run @graph.toml", "@graph.toml is a graph", "`manifactor solve @graph.toml`"),
        ("online @graph.toml", "@graph.toml is a graph", "`manifactor solve @graph.toml`"),
        (
            "simulate @sweep.toml --lines",
            "is the document of an experiment",
            "`manifactor experiment @sweep.toml`",
        ),
        ("run @rules.toml", "is a file of semantic rules", "semantics = \"@rules.toml\""),
        ("solve @run.toml", "is the document of a run; expected a graph", "`manifactor run @run.toml`"),
        ("graph @run.toml", "is the document of a run", "`manifactor run @run.toml`"),
        ("replay @sweep.toml", "is the document of an experiment", "`manifactor experiment @sweep.toml`"),
        ("experiment @run.toml", "is the document of a run", "`manifactor run @run.toml`"),
        ("check @rules.toml", "is a file of semantic rules", "semantics = \"@rules.toml\""),
        ("plot @run.toml", "is the document of a run", "`manifactor run @run.toml`"),
        ("evaluate @a.g2o @a.g2o", "@a.g2o is a graph; expected a trajectory", "`manifactor solve @a.g2o`"),
        ("evaluate @truth.txt @run.toml", "@run.toml is the document of a run", "`manifactor run @run.toml`"),
    ] {
        refused(&folder, command, is, remedy);
    }
    let at = path(&folder, "run.toml");
    manifactor(&format!("check-factor --config {at}"))
        .ended(2)
        .complains("is the document of a run; expected a literal");
    for file in ["a.g2o", "graph.toml", "run.toml", "sweep.toml"] {
        manifactor(&format!("check {}", path(&folder, file))).ended(0);
    }
}

#[test]
fn data_in_place_of_a_document_are_refused_with_the_command_for_them() {
    let folder = files();
    for (command, is, remedy) in [
        ("solve @truth.txt", "is a trajectory in the TUM format", "`manifactor evaluate TRUTH @truth.txt`"),
        ("run @truth.txt", "is a trajectory in the TUM format", "`recorded`"),
        ("solve @boxes.csv", "is a table of detections", "`recorded`"),
        ("evaluate @truth.txt @boxes.csv", "is a table of detections", "`recorded`"),
        ("evaluate --boxes @truth.txt @boxes.csv", "expected a table of detections", "`recorded`"),
        ("online @frames.jsonl", "is frames as lines of JSON", "json_lines"),
        ("solve @frames.json", "is frames as lines of JSON", "json_lines"),
    ] {
        refused(&folder, command, is, remedy);
    }
    let frames = format!("{FRAME}\n{FRAME}\n");
    let ran = fed("online -", &frames).ended(2);
    ran.complains("standard input is frames as lines of JSON; expected the document of a run");
    ran.complains("`manifactor online RUN.toml` reads them from standard input");
}

#[test]
fn a_folder_is_refused_with_the_command_for_it() {
    let folder = files();
    let (out, recording) = (path(&folder, "out"), path(&folder, "recording"));
    let run = path(&folder, "run.toml");
    manifactor(&format!("run {run} --out {out}")).ended(0);
    manifactor(&format!("simulate {run} --out {recording}")).ended(0);
    for (command, is, remedy) in [
        ("solve @recording", "@recording is a recording", "type = \"recorded\", folder = \"@recording\""),
        ("run @recording", "@recording is a recording", "`manifactor explain recorded`"),
        ("plot @recording", "@recording is a recording", "`manifactor explain recorded`"),
        ("solve @out", "@out is the folder of a run", "`manifactor plot @out`"),
        ("run @out", "@out is the folder of a run", "`manifactor plot @out`"),
        ("graph @out", "@out is the folder of a run", "`manifactor graph @out/VARIANT`"),
        ("solve @out/estimate", "is the folder of a variant", "`manifactor solve @out/estimate/graph.json`"),
        ("plot @out/estimate", "is the folder of a variant", "`manifactor plot` takes the folder of the run"),
    ] {
        refused(&folder, command, is, remedy);
    }
    manifactor(&format!("graph {out}/estimate")).ended(0);
    std::fs::create_dir(path(&folder, "empty")).unwrap();
    let ran = manifactor(&format!("plot {}", path(&folder, "empty"))).ended(3);
    ran.complains("the folder has no record.json");
    ran.complains("`manifactor run RUN.toml --out FOLDER`");
    manifactor(&format!("plot {}", path(&folder, "nowhere"))).ended(3).complains("there is no such folder");
    manifactor(&format!("run {}", path(&folder, "empty")))
        .ended(3)
        .complains("empty is a folder; expected the document");
}
