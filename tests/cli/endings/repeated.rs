//! Repeated runs: on different numbers of threads, and from their own output.
use crate::{folder, manifactor, path};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

const RUN: &str = r#"
title = "twice"
semantics = "rules.toml"
[source]
type = "simulated"
seed = 3
trajectory = { frames = 30 }
scene = { objects = 4 }
[report]
covariances = true
[[variants]]
name = "without"
set = { semantics = [] }
[[variants]]
name = "with orientation"
"#;

const RULES: &str = r#"
[[semantics]]
classes = ["*"]
factor = { type = "vertical_orientation" }
noise = { sigma = 0.1 }
"#;

/// Returns the content of a folder by file, without durations.
pub(crate) fn timeless(folder: &Path) -> BTreeMap<String, String> {
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            files.extend(timeless(&path).into_iter().map(|(inner, text)| (format!("{name}/{inner}"), text)));
            continue;
        }
        let text = String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned();
        let text = match path.extension().unwrap_or_default().to_str().unwrap() {
            "json" => {
                let mut json = serde_json::from_str(&text).unwrap();
                forget_times(&mut json);
                format!("{json:#}")
            }
            // the last column is a duration
            "csv" => text.lines().map(|line| line.rsplit_once(',').unwrap().0.to_owned() + "\n").collect(),
            _ => text,
        };
        files.insert(name, text);
    }
    files
}

fn forget_times(json: &mut Value) {
    match json {
        Value::Object(fields) => {
            fields.retain(|name, _| {
                !["seconds", "times", "refinement_seconds", "latencies"].contains(&name.as_str())
            });
            fields.values_mut().for_each(forget_times);
        }
        Value::Array(items) => items.iter_mut().for_each(forget_times),
        _ => {}
    }
}

/// Compares two results, with the names of their folders replaced.
pub(crate) fn same(a: &BTreeMap<String, String>, b: &BTreeMap<String, String>, places: [&str; 2]) {
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, text) in a {
        let [text, other] =
            [(text, places[0]), (&b[name], places[1])].map(|(t, place)| t.replace(place, "OUT"));
        let line = text.lines().zip(other.lines()).find(|(a, b)| a != b);
        assert!(text == other, "{name} differs: {line:?}");
    }
}

#[test]
fn a_run_leaves_the_same_bytes_on_any_number_of_threads() {
    let folder = folder(&[("run.toml", RUN), ("rules.toml", RULES)]);
    let out = [1, 2, 4].map(|threads| {
        let out = path(&folder, &format!("on{threads}"));
        let ran = manifactor(&format!("run {} --out {out} --threads {threads}", path(&folder, "run.toml")));
        assert!(ran.code == 0 || ran.code == 1, "{}", ran.stderr);
        out
    });
    let one = timeless(Path::new(&out[0]));
    // three files of the run and its marker; for each variant ten files, and eight charts and four images
    // as SVG and PNG
    assert_eq!(one.len(), 4 + 2 * (10 + 2 * 12), "{:?}", one.keys());
    for other in &out[1..] {
        same(&one, &timeless(Path::new(other)), [&out[0], other]);
    }
}

#[test]
fn a_run_is_repeated_from_its_folder_alone() {
    let first = folder(&[("run.toml", RUN), ("rules.toml", RULES)]);
    let (a, b) = (path(&first, "a"), path(&first, "b"));
    let ran = manifactor(&format!("run {} --out {a}", path(&first, "run.toml")));
    assert!(ran.code == 0 || ran.code == 1, "{}", ran.stderr);
    let report: Value = serde_json::from_slice(&std::fs::read(format!("{a}/report.json")).unwrap()).unwrap();
    assert_eq!(report["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(report["complete"], true);
    let fingerprints = [0, 1].map(|i| report["variants"][i]["fingerprint"].as_str().unwrap().to_owned());
    assert!(fingerprints[0].len() == 16 && fingerprints[0] != fingerprints[1], "{fingerprints:?}");
    // the settings already contain the rules
    std::fs::remove_file(first.path().join("rules.toml")).unwrap();
    for variant in ["without", "with-orientation"] {
        let ran = manifactor(&format!("run {a}/{variant}/config.toml --out {b}/{variant}"));
        assert!(ran.code == 0 || ran.code == 1, "{}", ran.stderr);
        let repeated = format!("{b}/{variant}");
        let of = |out: &str| timeless(&Path::new(out).join(variant));
        same(&of(&a), &of(&repeated), [&a, &repeated]);
    }
}

#[test]
fn files_of_a_run_are_found_when_it_is_repeated() {
    let folder = folder(&[("run.toml", RUN), ("rules.toml", RULES)]);
    let recording = path(&folder, "recording");
    manifactor(&format!("simulate {} --out {recording}", path(&folder, "run.toml"))).ended(0);
    let camera = "camera = { fx = 320.0, fy = 320.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }";
    let recorded = format!("source = {{ type = \"recorded\", folder = \"recording\", {camera} }}\n");
    std::fs::write(folder.path().join("recorded.toml"), recorded).unwrap();
    let (a, b) = (path(&folder, "a"), path(&folder, "b"));
    let ran = manifactor(&format!("run {} --out {a}", path(&folder, "recorded.toml")));
    assert!(ran.code == 0 || ran.code == 1, "{}", ran.stderr);
    let ran = manifactor(&format!("run {a}/estimate/config.toml --out {b}"));
    assert!(ran.code == 0 || ran.code == 1, "{}", ran.stderr);
    let of = |out: &str| timeless(&Path::new(out).join("estimate"));
    same(&of(&a), &of(&b), [&a, &b]);
}
