//! Maps of earlier runs: runs that begin in them, and priors that are learned from them.
mod learn;

use crate::commands::online::{DESK, LIVE};
use crate::{fed, folder, manifactor, path};
use serde_json::Value;

/// Returns the report of a run's only variant.
fn report(out: &str) -> Value {
    let text = std::fs::read_to_string(format!("{out}/report.json")).unwrap();
    serde_json::from_str::<Value>(&text).unwrap()["variants"][0].take()
}

#[test]
fn a_second_run_begins_with_the_map_of_the_first() {
    let folder = folder(&[("desk.toml", DESK), ("live.toml", LIVE)]);
    let (desk, first, second) = (path(&folder, "desk.toml"), path(&folder, "first"), path(&folder, "second"));
    manifactor(&format!("run {desk} --out {first}")).ended(0);
    let map = format!("{first}/estimate/map.json");
    let before = std::fs::read(&map).unwrap();
    let objects = report(&first)["counts"]["objects"].as_u64().unwrap();
    // both runs use the names of the source, so the poses are unambiguous
    let again = format!("{desk} --out {second} --set prior_map.file={map}");
    let ran = manifactor(&format!("run {again} --set source.seed=9")).ended(0);
    assert!(ran.stdout.contains("detected again, none removed"), "{}", ran.stdout);
    let prior = &report(&second)["prior_map"];
    assert_eq!(prior["objects"], objects);
    assert_eq!(prior["is_located"], true);
    assert_eq!(prior["found"]["matches"].as_array().map(|matches| matches.len() >= 4), Some(true), "{prior}");
    assert_eq!(std::fs::read(&map).unwrap(), before, "a map that is read is not written");
    // a stream from lines with names; its map can be a prior map again, and the frame of the relocalization
    // is reported for any --every
    let frames = manifactor(&format!("simulate {desk} --lines")).ended(0).stdout;
    let (live, third) = (path(&folder, "live.toml"), path(&folder, "third"));
    let map = format!("{second}/estimate/map.json");
    let online =
        format!("online {live} --set association.type=given --set prior_map.file={map} --every 1000");
    let ran = fed(&format!("{online} --out {third} --json"), &frames);
    ran.complains("relocalized in the prior map by");
    let lines: Vec<Value> =
        ran.ended(0).stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 2, "the frame that shows the place, and the report");
    assert!(lines[0]["report"]["located"]["start"].is_object(), "{}", lines[0]);
    let prior = &report(&third)["prior_map"];
    assert_eq!(
        (&prior["is_located"], &prior["found"]["frame"]),
        (&true.into(), &lines[0]["report"]["frame"])
    );
    let ran = fed(&format!("{online} --out {}", path(&folder, "fourth")), &frames).ended(0);
    let frame = lines[0]["report"]["frame"].as_u64().unwrap() + 1;
    ran.complains(&format!("after {frame} frames, relocalized in the prior map by"));
    ran.complains(&format!(" {frame} frames: "));
}

#[test]
fn a_run_does_not_write_over_the_map_that_it_reads() {
    let output = |folder: &tempfile::TempDir| format!("output = {:?}\n{DESK}", path(folder, "out"));
    let folder = folder(&[("desk.toml", "")]);
    let (desk, own) = (path(&folder, "desk.toml"), path(&folder, "out/estimate/map.json"));
    std::fs::write(&desk, output(&folder)).unwrap();
    manifactor(&format!("run {desk}")).ended(0);
    let before = std::fs::read(&own).unwrap();
    // the same command with its own map; the scene is a different table, so the relocalization fails
    for command in ["run", "online"] {
        let again = format!("{command} {desk} --set source.scene.seed=99 --set prior_map.file={own}");
        let refused = manifactor(&again).ended(2);
        refused.complains("names a map that this run itself writes");
        refused.complains("--out");
        refused.complains("prior_map.file=");
        assert_eq!(std::fs::read(&own).unwrap(), before);
    }
    let elsewhere = path(&folder, "elsewhere");
    manifactor(&format!("run {desk} --set prior_map.file={own} --out {elsewhere}")).ended(0);
    assert_eq!(std::fs::read(&own).unwrap(), before);
}

#[test]
fn a_map_that_cannot_be_read_is_told_before_anything_is_done() {
    let folder = folder(&[("desk.toml", DESK), ("map.json", "{\"version\": 7, \"objects\": []}")]);
    let (desk, out) = (path(&folder, "desk.toml"), path(&folder, "out"));
    let run = |more: &str| manifactor(&format!("run {desk} --out {out} {more}")).ended(2);
    let told = run("--set prior_map.file=map.json");
    told.complains("names no map that can be read");
    told.complains("a map of version 7, and this program reads version 1");
    run("--set prior_map.file=nowhere.json").complains("nowhere.json");
    run("--set prior_map.file=map.txt").complains("map.txt");
    run("--set prior_map.start.translation=[0,0,0]").complains("file");
    assert!(!std::path::Path::new(&out).exists());
}

#[test]
fn flat_objects_have_a_warning_and_a_flag() {
    let rule = "[[semantics]]\nclasses = ['*']\nnoise = { sigma = 0.001 }\n\
                factor = { type = 'shape_prior', semi_axes = [1.0, 1.0, 0.01] }\n";
    let flat = DESK.replace("semantics = \"table_one\"", "") + rule;
    let folder = folder(&[("flat.toml", &flat), ("desk.toml", DESK)]);
    let flags = |name: &str| {
        let out = path(&folder, name);
        let ran = manifactor(&format!("run {} --out {out}", path(&folder, &format!("{name}.toml"))));
        let read = |file: &str| {
            let text = std::fs::read_to_string(format!("{out}/estimate/{file}")).unwrap();
            serde_json::from_str::<Value>(&text).unwrap()
        };
        let flat = |objects: &Value| {
            objects.as_array().unwrap().iter().filter(|object| object["flat"] == true).count()
        };
        let counts = [flat(&read("map.json")["objects"]), flat(&read("objects.json"))];
        assert_eq!(counts[0], counts[1]);
        assert_eq!(counts[0] > 0, (ran.stdout + &ran.stderr).contains("flat, seen from one side: q"));
        counts[0]
    };
    assert!(flags("flat") > 0);
    assert_eq!(flags("desk"), 0);
}
