//! Dependencies between packages: the layers of the design, checked with `cargo metadata`.
use cargo_metadata::{MetadataCommand, Package};
use std::collections::BTreeMap;
use std::path::Path;

/// From the bottom up: a plugin may depend on the plugins before it.
const PLUGINS: [&str; 17] = [
    "geometry",
    "inertial",
    "quadric",
    "semantic",
    "formats",
    "ros",
    "metrics",
    "recording",
    "simulator",
    "association",
    "mapping",
    "online",
    "run",
    "experiment",
    "slam",
    "viz",
    "expression",
];
/// Packages of the core that a plugin may depend on.
const FOR_PLUGINS: [&str; 6] = ["document", "graph", "solve", "smoother", "config", "testing"];

fn packages() -> Vec<Package> {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
    MetadataCommand::new().manifest_path(manifest).no_deps().exec().unwrap().packages
}

/// `solve` for `manifactor-solve`, `manifactor` for the facade; `None` for foreign packages.
fn short(name: &str) -> Option<&str> {
    name.strip_prefix("manifactor-").or((name == "manifactor").then_some(name))
}

/// Dependencies within the workspace by package, including those for tests.
fn arrows() -> BTreeMap<String, Vec<String>> {
    let ours = |p: &Package| {
        let deps = p.dependencies.iter().filter_map(|d| short(&d.name)).map(str::to_owned);
        // the tests of a package may enable a feature of the package itself
        deps.filter(|d| Some(d.as_str()) != short(&p.name)).collect()
    };
    packages().iter().filter_map(|p| Some((short(&p.name)?.to_owned(), ours(p)))).collect()
}

/// Fails at the first dependency that is not allowed.
fn only(from: &str, allowed: &[&str]) {
    for to in &arrows()[from] {
        assert!(allowed.contains(&to.as_str()), "{from} must not depend on {to}, only on {allowed:?}");
    }
}

fn users_of(package: &str) -> Vec<String> {
    let uses = |p: &&Package| p.dependencies.iter().any(|d| d.name == package);
    packages().iter().filter(uses).map(|p| p.name.to_string()).collect()
}

#[test]
fn documents_know_nothing_of_ours_and_the_graph_knows_documents() {
    only("document", &[]);
    only("graph", &["document"]);
}

#[test]
fn solve_config_and_testing_know_documents_and_graph_and_not_each_other() {
    for part in ["solve", "config", "testing"] {
        only(part, &["document", "graph"]);
    }
}

#[test]
fn the_smoother_builds_on_solve() {
    only("smoother", &["document", "graph", "solve"]);
}

#[test]
fn plugins_build_on_core_and_on_the_plugins_below() {
    for (i, plugin) in PLUGINS.iter().enumerate() {
        let allowed: Vec<_> = FOR_PLUGINS.iter().chain(&PLUGINS[..i]).copied().collect();
        only(plugin, &allowed);
    }
}

#[test]
fn the_command_line_knows_the_facade_alone() {
    only("cli", &["manifactor"]);
    // an example builds a separate binary
    let allowed: Vec<_> = FOR_PLUGINS.iter().chain(&PLUGINS).chain(&["cli"]).copied().collect();
    only("manifactor", &allowed);
    // with a version, each of the two could only be published after the other
    let packages = packages();
    let facade = packages.iter().find(|package| package.name.as_str() == "manifactor").unwrap();
    let cli = facade.dependencies.iter().find(|dependency| dependency.name == "manifactor-cli").unwrap();
    assert_eq!(cli.req.to_string(), "*");
}

#[test]
fn the_python_package_knows_the_facade_and_the_command_line_and_is_known_to_nothing() {
    only("python", &["manifactor", "cli"]);
    assert!(users_of("manifactor-python").is_empty());
    assert_eq!(users_of("pyo3"), ["manifactor-python"]);
}

#[test]
fn the_programs_that_measure_are_known_to_nothing() {
    assert!(users_of("manifactor-bench").is_empty());
}

#[test]
fn every_package_has_its_place() {
    let tops = ["cli", "manifactor", "python", "bench"];
    let known: Vec<_> = FOR_PLUGINS.iter().chain(&PLUGINS).chain(&tops).copied().collect();
    for (package, _) in arrows() {
        assert!(known.contains(&package.as_str()), "{package} is new: say in this test where it stands");
    }
}

#[test]
fn published_packages_describe_themselves() {
    for package in packages().iter().filter(|package| package.publish.is_none()) {
        let texts = [&package.description, &package.license, &package.repository];
        let words = [&package.keywords, &package.categories];
        let is_described = texts.iter().all(|text| text.is_some())
            && words.iter().all(|words| !words.is_empty())
            && package.readme.is_some()
            && package.rust_version.is_some();
        assert!(is_described, "the manifest of {} lacks a field that crates.io shows", package.name);
    }
}

#[test]
fn faer_stays_in_solve_and_num_dual_in_graph() {
    assert_eq!(users_of("faer"), ["manifactor-solve"]);
    assert_eq!(users_of("num-dual"), ["manifactor-graph"]);
}

#[test]
fn the_command_line_alone_serves() {
    for library in ["hyper", "hyper-util", "http-body-util", "futures-util", "tokio", "tokio-io-timeout"] {
        assert_eq!(users_of(library), ["manifactor-cli"], "{library}");
    }
}

#[test]
fn every_dependency_is_in_the_one_table() {
    for package in packages() {
        let manifest = std::fs::read_to_string(&package.manifest_path).unwrap();
        let tables = manifest.split("\n[").filter(|t| {
            let header = t.split(']').next().unwrap_or_default();
            header.ends_with("dependencies") && !header.starts_with("workspace")
        });
        // the table has a version, which the facade must not have
        let by_path = r#"manifactor-cli = { path = "plugins/cli" }"#;
        for line in tables.flat_map(str::lines).filter(|l| l.contains('=') && !l.starts_with('#')) {
            assert!(line.contains("workspace = true") || line == by_path, "{}: {line}", package.name);
        }
    }
}

#[test]
fn no_file_of_source_is_longer_than_500_lines() {
    fn walk(folder: &Path, check: &mut dyn FnMut(&Path)) {
        for entry in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
            if entry.is_dir() {
                walk(&entry, check);
            } else if entry.extension().is_some_and(|e| e == "rs") {
                check(&entry);
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for folder in ["core", "plugins", "tests", "examples"] {
        walk(&root.join(folder), &mut |file| {
            let lines = std::fs::read_to_string(file).unwrap().lines().count();
            assert!(lines <= 500, "{} has {lines} lines", file.display());
        });
    }
}
