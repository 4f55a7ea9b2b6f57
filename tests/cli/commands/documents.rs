use crate::{folder, manifactor, path};

const BROKEN: &str = r#"
[[variables]]
key = "x0"
value = { type = "se2", translation = [0.0, 0.0], angle = 0.0 }

[[factors]]
keys = ["x0", "x1"]
factor = { type = "betwen_se2", relative = { translation = [1.0, 0.0], angle = 0.0 } }
noise = { sigma = -1.0 }
"#;

#[test]
fn every_mistake_is_shown_with_its_line() {
    let folder = folder(&[("graph.toml", BROKEN)]);
    let ran = manifactor(&format!("check {} --json", path(&folder, "graph.toml"))).ended(2);
    ran.complains("did you mean `between_se2`?");
    // the line itself, below the message
    ran.complains("factor = { type = \"betwen_se2\"");
    let errors = ran.json()["errors"].as_array().unwrap().clone();
    let lines: Vec<_> = errors.iter().map(|e| e["line"].as_u64().unwrap()).collect();
    assert_eq!(lines, [7, 8, 9], "{errors:?}");
}

#[test]
fn the_examples_have_no_mistakes() {
    let ran = manifactor("check examples/desk/desk.toml --load").ended(0);
    assert!(ran.stdout.contains("nothing wrong") && ran.stdout.contains("3 variants"), "{}", ran.stdout);
    let tum = crate::root().join("examples/tum");
    let files = std::fs::read_dir(&tum).unwrap().map(|file| file.unwrap().path());
    let configs: Vec<_> = files.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect();
    assert_eq!(configs.len(), 4, "{configs:?}");
    for config in configs {
        manifactor(&format!("check {}", config.display())).ended(0);
    }
}

#[test]
fn a_run_with_a_mistake_is_not_run() {
    let folder = folder(&[("run.toml", "title = \"t\"\n[source]\ntype = \"simulated\"\nsed = 1\n[sover]\n")]);
    let out = path(&folder, "out");
    let ran = manifactor(&format!("run {} --out {out}", path(&folder, "run.toml"))).ended(2);
    ran.complains("did you mean `seed`?");
    ran.complains("did you mean `solver`?");
    assert!(!std::path::Path::new(&out).exists());
}

#[test]
fn data_that_are_not_there_are_looked_for_by_name() {
    let ran = manifactor("run examples/tum/fr1_desk.toml").ended(3);
    ran.complains("MANIFACTOR_DATA");
}

#[test]
fn a_table_in_place_of_an_array_of_tables_is_shown_with_its_brackets() {
    let single = BROKEN.replace("[[factors]]", "[factors]");
    let folder = folder(&[("graph.toml", &single)]);
    manifactor(&format!("check {}", path(&folder, "graph.toml"))).ended(2).complains("write `[[factors]]`");
}

#[test]
fn an_axis_with_unknown_fields_is_shown_with_both_forms() {
    let sweep = "base = 'run.toml'\n[[axes]]\nkey = 'source.seed'\nvalues = [1, 2]\n";
    let folder = folder(&[("sweep.toml", sweep), ("run.toml", "source = { type = 'simulated' }\n")]);
    let ran = manifactor(&format!("check {}", path(&folder, "sweep.toml"))).ended(2);
    ran.complains("an axis has `columns` and `rows`, or `name` and `options`");
}

#[test]
fn only_the_first_searched_folders_are_listed() {
    let folder = folder(&[]);
    for data in ["a", "b", "c", "d", "e"] {
        std::fs::create_dir(path(&folder, data)).unwrap();
    }
    let data = folder.path().display();
    let ran = manifactor(&format!("run examples/tum/fr1_desk.toml --data {data}")).ended(3);
    ran.complains("and 4 more");
    ran.complains("correct `source.sequence`, or the folder given by --data or MANIFACTOR_DATA");
}

#[test]
fn an_override_that_fits_nothing_is_shown() {
    manifactor("check examples/desk/desk.toml --set source.scene.objets=3").ended(2).complains("objects");
}

#[test]
fn an_association_that_rejects_every_frame_is_an_error() {
    let run = "association = { type = 'likelihood' }\ngravity = { type = 'accelerometer' }\n\
               source = { type = 'simulated', scene = { objects = 4 }, trajectory = { frames = 20 } }\n";
    let folder = folder(&[("run.toml", run)]);
    let (run, out) = (path(&folder, "run.toml"), path(&folder, "out"));
    manifactor(&format!("run {run} --out {out}")).ended(2).complains("no frame can be mapped");
}
