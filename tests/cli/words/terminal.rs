//! Foreign text does not control a terminal, a browser or a spreadsheet.
use crate::{folder, manifactor, path};

/// Titles, names and keys that clear the screen, by C0 and by C1, and characters that are invalid in XML.
const NASTY: &str = r#""\u001b[2J\u009b2J\u007f\ufffe""#;

fn graph() -> String {
    format!(
        "[[variables]]\nkey = {NASTY}\nvalue = {{ type = 'point2', position = [0.0, 1.0] }}\n[[factors]]\nkeys = [{NASTY}]\n\
         factor = {{ type = 'prior_point2', value = {{ position = [0.0, 0.0] }} }}\n"
    )
}

fn run_document() -> String {
    format!(
        "title = {NASTY}\nsource = {{ type = 'simulated', scene = {{ objects = 2 }}, trajectory = {{ frames = 12 }} }}\n\
         [[variants]]\nname = {NASTY}\nset = {{ objects = {{ min_views = 1000 }} }}\n[[variants]]\nname = 'b'\n"
    )
}

#[track_caller]
fn harmless(text: &str) {
    let found = text.chars().find(|c| c.is_control() && *c != '\n');
    assert!(found.is_none(), "{found:?} in {text:?}");
}

#[test]
fn no_control_character_is_printed() {
    let folder = folder(&[("graph.toml", &graph()), ("run.toml", &run_document())]);
    let (graph, run, out) = (path(&folder, "graph.toml"), path(&folder, "run.toml"), path(&folder, "out"));
    for command in [
        format!("solve {graph} -v"),
        format!("solve {graph} --json --covariances -vv"),
        format!("solve {graph} --freeze \u{9b}2J"),
        "solve nowhere\u{9b}2J.g2o".to_owned(),
        "sol\u{9b}ve".to_owned(),
        format!("graph {graph}"),
        format!("graph {graph} --json"),
        format!("graph {graph} --dot"),
        format!("check {run} --load"),
        format!("run {run} --out {out} -vv"),
        format!("run {run} --out {out} --json"),
    ] {
        let ran = manifactor(&command);
        harmless(&ran.stdout);
        harmless(&ran.stderr);
    }
}

/// Neither XML nor HTML allows these.
#[track_caller]
fn holds_what_it_may(text: &str) {
    let unfit = |c: &char| matches!(c, '\u{fffe}' | '\u{ffff}') || (c.is_control() && !"\n\t".contains(*c));
    let found = text.chars().find(unfit);
    assert!(found.is_none() && text.contains('\u{fffd}'), "{found:?}");
}

#[test]
fn pictures_and_pages_hold_what_they_may() {
    let folder = folder(&[("graph.toml", &graph()), ("run.toml", &run_document())]);
    let (graph, pictures) = (path(&folder, "graph.toml"), path(&folder, "pictures"));
    let page = path(&folder, "page.html");
    manifactor(&format!("plot {graph} --out {pictures}")).ended(0);
    manifactor(&format!("solve {graph} --report {page}")).ended(0);
    for file in [format!("{pictures}/graph.svg"), page] {
        holds_what_it_may(&std::fs::read_to_string(file).unwrap());
    }
    let out = path(&folder, "out");
    manifactor(&format!("run {} --out {out}", path(&folder, "run.toml")));
    for file in ["report.html", "b/map_top.svg"] {
        holds_what_it_may(&std::fs::read_to_string(format!("{out}/{file}")).unwrap());
    }
}

#[test]
fn a_name_in_a_table_is_no_formula() {
    let base = "source = { type = 'simulated', scene = { objects = 1 }, trajectory = { frames = 6 } }\n\
                [[variants]]\nname = '=HYPERLINK(1)'\n[[variants]]\nname = '-2.5'\nset = { objects = { refinements = 1 } }\n";
    let sweep =
        "base = 'base.toml'\nsummary = { by = ['variant'], metrics = ['position'], resamples = 10 }\n";
    let folder = folder(&[("base.toml", base), ("sweep.toml", sweep)]);
    let out = path(&folder, "out");
    manifactor(&format!("experiment {} --out {out}", path(&folder, "sweep.toml"))).ended(0);
    for file in ["trials.csv", "summary.csv", "times.csv"] {
        let text = std::fs::read_to_string(format!("{out}/{file}")).unwrap();
        assert!(text.contains("\n'=HYPERLINK(1),") && text.contains("\n-2.5,"), "{text}");
    }
}

#[test]
#[cfg(unix)]
fn names_of_files_that_are_no_text_are_shown_as_far_as_they_are() {
    use std::os::unix::ffi::OsStrExt;
    let folder = folder(&[("graph.toml", &graph())]);
    let name = std::ffi::OsStr::from_bytes(b"caf\xe9.toml");
    std::fs::copy(folder.path().join("graph.toml"), folder.path().join(name)).unwrap();
    let json = |arguments: &[&str], code: i32| -> serde_json::Value {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_manifactor"));
        let output = command.current_dir(folder.path()).args(arguments).arg(name).output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    assert_eq!(json(&["solve", "--json"], 0)["graph"], "caf\u{fffd}.toml");
    std::fs::remove_file(folder.path().join(name)).unwrap();
    let missing = json(&["solve", "--json"], 3)["errors"][0]["file"].clone();
    assert_eq!(missing, "caf\u{fffd}.toml");
}
