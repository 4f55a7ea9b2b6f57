//! Overrides by `--set`, and variants.

use manifactor_config::{Document, Errors, Format, to_toml};
use serde_json::json;

const RUN: &str = "
name = 'desk'
[solver]
type = 'gauss_newton'
max_iterations = 10
[[factors]]
noise = { sigma = 1.0 }
[[factors]]
noise = { sigma = 2.0 }
";

fn run() -> Document {
    Document::parse("run.toml", RUN, Format::Toml).unwrap()
}

fn refused(overrides: &[&str]) -> String {
    run().set(overrides).unwrap_err().to_string()
}

#[test]
fn overrides_reach_every_value() {
    let mut document = run();
    let overrides = [
        "solver.max_iterations=50",
        "factors[1].noise.sigma = 0.5",
        "name=out/run 1",
        "seed=7",
        "output.\"a.b\".on=true",
        "classes=['cup', 'vase']",
        "empty=",
    ];
    document.set(&overrides).unwrap();
    let json = document.root().to_json().unwrap();
    assert_eq!(json["solver"], json!({"type": "gauss_newton", "max_iterations": 50}));
    assert_eq!(json["factors"][1]["noise"]["sigma"], 0.5);
    assert_eq!(json["name"], "out/run 1");
    assert_eq!(json["seed"], 7);
    assert_eq!(json["output"], json!({"a.b": {"on": true}}));
    assert_eq!(json["classes"], json!(["cup", "vase"]));
    assert_eq!(json["empty"], "");
}

#[test]
fn errors_point_at_the_override() {
    let mut document = run();
    document.set(&["solver.max_iteratons=5", "solver.max_iterations=many"]).unwrap();
    let errors = Errors::new();
    let value = document.section(&errors).and_then(|mut run| {
        let mut solver = run.section("solver")?;
        let steps = solver.required::<u32>("max_iterations");
        let _ = solver.required::<String>("type");
        solver.finish();
        run.ignore_rest();
        steps
    });
    assert_eq!(
        errors.finish(value).unwrap_err().to_string(),
        "--set solver.max_iterations=many: expected a whole number, 0 or more, found the text \"many\"\n\
         --set solver.max_iteratons=5: unknown field `max_iteratons` \
         (did you mean `max_iterations`? there are `max_iterations` and `type`)"
    );
}

#[test]
fn overrides_without_a_place_are_refused_all_at_once() {
    let how = "(write it as `solver.stop.max_iterations=50` or `factors[2].noise.sigma=0.1`)";
    assert_eq!(
        refused(&[
            "solver",
            "=3",
            "factors[5].x=1",
            "name.first=1",
            "solver[0]=1",
            "a[x]=1",
            "n=99999999999999999999"
        ]),
        format!(
            "--set =3: a key is missing {how}\n\
             --set a[x]=1: `x` is not an index {how}\n\
             --set factors[5].x=1: `factors` has 2 elements, counted from 0: there is no 5\n\
             --set n=99999999999999999999: not valid TOML: the whole number 99999999999999999999 does not fit into 64 bits\n\
             --set name.first=1: `name` is not a table but the text \"desk\"\n\
             --set solver: an override needs a `=` and a value {how}\n\
             --set solver[0]=1: `solver` is not an array but a table"
        )
    );
}

#[test]
fn variants_merge_deeply() {
    let mut document = run();
    let patch = "solver: {max_iterations: 3}\nfactors: []\nextra: {a: 1}\n";
    document.merge(Document::parse("variant.yaml", patch, Format::Yaml).unwrap());
    let json = document.root().to_json().unwrap();
    assert_eq!(
        json,
        json!({
            "name": "desk", "solver": {"type": "gauss_newton", "max_iterations": 3}, "factors": [], "extra": {"a": 1}
        })
    );
}

#[test]
fn another_type_replaces_the_whole_table() {
    let mut document = run();
    let patch = "[solver]\ntype = 'dogleg'\nradius = 1.0\n";
    document.merge(Document::parse("variant.toml", patch, Format::Toml).unwrap());
    assert_eq!(document.root().to_json().unwrap()["solver"], json!({"type": "dogleg", "radius": 1.0}));
}

#[test]
fn a_document_is_written_as_it_stands_after_overrides() {
    let mut document =
        Document::parse("run.yaml", "a: ~\nsolver: {steps: 3, scale: 0.1}\n", Format::Yaml).unwrap();
    document.set(&["solver.steps=4", "name='x'"]).unwrap();
    assert_eq!(to_toml(document.root()).unwrap(), "name = \"x\"\n\n[solver]\nsteps = 4\nscale = 0.1\n");
}
