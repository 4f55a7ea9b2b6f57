use crate::harness::{Case, ended, text};
use std::fmt::Write as _;

const HEADER: &str = "timestamp,class_name,score,xmin,ymin,xmax,ymax,object_key\n";
const RUN: &str = r#"
title = "recorded"
[source]
type = "recorded"
folder = "."
camera = { fx = 320.0, fy = 320.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }
"#;

/// Runs the cases of detections, with valid odometry.
fn account(cases: Vec<Case>) -> String {
    let mut account = String::new();
    for (name, bytes) in cases {
        let folder = tempfile::tempdir().unwrap();
        let odometry: String = (0..6).map(|i| format!("{i} 0.{i} 0 0 0 0 0 1\n")).collect();
        std::fs::write(folder.path().join("odometry.txt"), odometry).unwrap();
        std::fs::write(folder.path().join("run.toml"), RUN).unwrap();
        std::fs::write(folder.path().join("detections.csv"), bytes).unwrap();
        let _ = writeln!(
            account,
            "## {name}\n{}",
            ended(folder.path(), "run FILE --data . --out out", "run.toml")
        );
    }
    account
}

#[test]
fn detections_of_objects() {
    let row = |name, row: &str| text(name, format!("{HEADER}{row}\n"));
    let rows = |name, row: &str| {
        text(
            name,
            HEADER.to_owned()
                + &(0..6).map(|i| row.replacen('T', &i.to_string(), 1) + "\n").collect::<String>(),
        )
    };
    let cases = vec![
        text("empty", ""),
        text("header only", HEADER),
        text("no header", "0,cup,0.9,10,10,50,50,1\n"),
        text("a column missing", "timestamp,class_name,score,xmin,ymin,xmax\n0,cup,0.9,10,10,50\n"),
        text(
            "columns with other names",
            "time,class,confidence,xmin,ymin,xmax,ymax\n0,cup,0.9,10,10,50,50\n",
        ),
        text("nanoseconds", format!("{HEADER}1700000000000000000,cup,0.9,10,10,50,50,1\n")),
        text(
            "a column twice",
            "timestamp,timestamp,class_name,score,xmin,ymin,xmax,ymax\n0,0,cup,0.9,10,10,50,50\n",
        ),
        text(
            "unknown column",
            "timestamp,class_name,score,xmin,ymin,xmax,ymax,colour\n0,cup,0.9,10,10,50,50,red\n",
        ),
        ("binary", vec![0, 255, 0, 10, 13, 0]),
        row("a field too few", "0,cup,0.9,10,10,50"),
        row("a field too many", "0,cup,0.9,10,10,50,50,1,2"),
        row("a word", "0,cup,high,10,10,50,50,1"),
        row("not a number", "0,cup,0.9,nan,10,50,50,1"),
        row("score above one", "0,cup,1.9,10,10,50,50,1"),
        row("box inside out", "0,cup,0.9,50,10,10,50,1"),
        row("box without height", "0,cup,0.9,10,50,50,50,1"),
        row("negative object", "0,cup,0.9,10,10,50,50,-1"),
        row("quotes left open", "0,\"cup,0.9,10,10,50,50,1"),
        row("no class", "0,,0.9,10,10,50,50,1"),
        row("a time without a pose", "77.5,cup,0.9,10,10,50,50,1"),
        rows("boxes outside of the image", "T,cup,0.9,-900,10,-850,50,1"),
        rows("shares of the image instead of pixels", "T,cup,0.9,0.1,0.1,0.5,0.4,1"),
        rows("boxes that show nothing but motion", "T,cup,0.9,10,10,50,50,1"),
    ];
    insta::assert_snapshot!(account(cases));
}
