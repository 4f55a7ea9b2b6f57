//! Every type registered by the crate has docs and an example, and obeys the laws.
use manifactor_geometry as _;
use manifactor_graph::catalogue::{Entry, all};
use manifactor_testing::catalogue::{documentation_law, factor_law, manifold_law};

fn ours(kind: &str) -> Vec<&'static Entry> {
    let ours: Vec<_> =
        all().into_iter().filter(|e| e.kind == kind && e.module.starts_with("manifactor_geometry")).collect();
    assert!(ours.len() >= 7, "{kind}: {} types are registered", ours.len());
    ours
}

#[test]
fn every_type_is_documented_by_an_example_that_reads() {
    for entry in ours("factor").into_iter().chain(ours("variable")) {
        documentation_law(entry).unwrap();
    }
}

#[test]
fn every_factor_keeps_the_jacobian_law_around_its_example() {
    for entry in ours("factor") {
        let defined = factor_law(entry, 64).unwrap().defined;
        assert!(defined >= 16, "`{}` was defined at {defined} of 64 points", entry.name);
    }
}

#[test]
fn every_manifold_keeps_its_laws_around_its_example() {
    for entry in ours("variable") {
        manifold_law(entry, 64).unwrap();
    }
}
