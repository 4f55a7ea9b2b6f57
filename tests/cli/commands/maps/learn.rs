//! `manifactor learn`, and runs with the rules that it writes.
use crate::commands::online::DESK;
use crate::{folder, manifactor, path, root};
use serde_json::Value;
use std::fs;

/// Returns a folder with a run and the path of its map.
fn mapped() -> (tempfile::TempDir, String) {
    let folder = folder(&[("desk.toml", DESK)]);
    let out = path(&folder, "first");
    manifactor(&format!("run {} --out {out}", path(&folder, "desk.toml"))).ended(0);
    (folder, format!("{out}/estimate/map.json"))
}

#[test]
fn a_run_takes_what_another_has_learned() {
    let (folder, map) = mapped();
    let (priors, out) = (path(&folder, "priors.toml"), path(&folder, "second"));
    let learned = manifactor(&format!("learn {map} {map} --out {priors}")).ended(0);
    learned.complains("count twice: give one map of each room");
    assert!(learned.stdout.contains("written to") && learned.stdout.contains("all"), "{}", learned.stdout);
    assert!(fs::read_to_string(&priors).unwrap().contains("by `manifactor learn` from"));
    let desk = path(&folder, "desk.toml");
    let ran = manifactor(&format!("run {desk} --out {out} --set semantics={priors}")).ended(0);
    assert!(!ran.stderr.contains("no object is of class"), "{}", ran.stderr);
    let objects = fs::read_to_string(format!("{out}/estimate/objects.json")).unwrap();
    let objects: Value = serde_json::from_str(&objects).unwrap();
    let factors = |object: &Value| {
        let factors = object["semantic_factors"].as_array().unwrap().iter();
        factors.map(|factor| factor["factor"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let mapped = || objects.as_array().unwrap().iter().filter(|object| !object["estimate"].is_null());
    assert!(mapped().count() > 0);
    // one size for each object: of its class, or the pooled one
    for object in mapped() {
        let sizes = factors(object).iter().filter(|factor| *factor == "size_prior").count();
        assert_eq!(sizes, 1, "{object}");
    }
    // the settings that a run writes give the same rules, and no new warnings
    let again = manifactor(&format!("check {out}/estimate/config.toml --load")).ended(0);
    assert!(!again.stderr.contains("no object is of class"), "{}", again.stderr);
}

#[test]
fn a_file_that_exists_stays() {
    let (folder, map) = mapped();
    fs::write(folder.path().join("mine.toml"), "# by hand").unwrap();
    let learn =
        |out: &str, more: &str| manifactor(&format!("learn {map} --out {} {more}", path(&folder, out)));
    learn("mine.toml", "").ended(2).complains("exists already");
    assert_eq!(fs::read_to_string(folder.path().join("mine.toml")).unwrap(), "# by hand");
    learn("mine.toml", "--force").ended(0);
    assert!(fs::read_to_string(folder.path().join("mine.toml")).unwrap().contains("size_prior"));
    learn("rules.json", "").ended(2).complains("rules are written as TOML");
    learn("nowhere.toml/rules.toml", "").ended(3);
    assert!(!folder.path().join("rules.json").exists());
}

#[test]
fn maps_that_teach_nothing_are_named() {
    let empty = "{\"version\": 1, \"objects\": []}";
    let folder = folder(&[
        ("empty.json", empty),
        ("new.json", "{\"version\": 7, \"objects\": []}"),
        ("broken.json", "{\"version\": 1,"),
        ("desk.toml", DESK),
    ]);
    let learn = |map: &str| {
        manifactor(&format!("learn {} --out {}", path(&folder, map), path(&folder, "priors.toml")))
    };
    let ran = learn("empty.json").ended(2);
    ran.complains("empty.json has no objects");
    ran.complains("the maps have no object with a class");
    learn("new.json").ended(2).complains("a map of version 7, and this program reads version 1");
    learn("broken.json").ended(2).complains("broken.json");
    learn("nowhere.json").ended(3).complains("nowhere.json");
    learn("desk.toml").ended(2).complains("is the document of a run; expected the map of a run");
    learn("").ended(3).complains("expected the map of a run");
    assert!(!folder.path().join("priors.toml").exists());
}

#[test]
fn wrong_sizes_are_refused_with_their_line() {
    let table = "[[sizes]]\nclasses = ['cup']\nsize_m = [0.1, -0.1, 0.1]\nspread = 1.5\n";
    let folder = folder(&[("run.toml", &format!("{DESK}\n{table}")), ("desk.toml", DESK)]);
    let ran = manifactor(&format!("check {}", path(&folder, "run.toml"))).ended(2);
    ran.complains("expected a length from 1e-6 to 1e6 metres, got -0.1");
    ran.complains("size_m = [0.1, -0.1, 0.1]");
    let desk = path(&folder, "desk.toml");
    manifactor(&format!("check {desk} --set sizes=houshold")).ended(2).complains("did you mean `household`");
    manifactor(&format!("check {desk} --set sizes=household --load")).ended(0);
    // a class that no object has, with the nearest name
    fs::write(&desk, format!("{DESK}\n{}", table.replace("-0.1", "0.1").replace("'cup'", "'botle'")))
        .unwrap();
    let ran = manifactor(&format!("check {desk} --load")).ended(0);
    ran.complains("no object is of class `botle`, which `size_prior` is configured for");
}

#[test]
fn the_commands_of_the_guide_work() {
    let guide = fs::read_to_string(root().join("docs/rules.md")).unwrap();
    let block = guide.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next());
    let block: Vec<&str> = block.filter(|block| block.contains("manifactor learn")).collect();
    assert_eq!(block.len(), 1);
    let folder = folder(&[]);
    let here = format!("{}/", folder.path().display());
    let into = |command: &str| {
        command
            .replace(" out/", &format!(" {here}out/"))
            .replace(" priors.toml", &format!(" {here}priors.toml"))
    };
    let commands: Vec<String> = block[0].lines().map(into).collect();
    assert_eq!(commands.len(), 2);
    for command in commands {
        manifactor(command.strip_prefix("manifactor ").unwrap()).ended(0);
    }
    assert!(fs::read_to_string(folder.path().join("priors.toml")).unwrap().contains("size_prior"));
}
