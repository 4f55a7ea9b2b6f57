//! Every type registered by this crate has docs, a schema and an example, and obeys the laws.
use manifactor_graph::catalogue::{self, Entry};
use manifactor_semantic as _;
use manifactor_testing::catalogue::{documentation_law, factor_law, manifold_law};

fn ours() -> Vec<&'static Entry> {
    catalogue::all().into_iter().filter(|e| e.module.starts_with("manifactor_semantic")).collect()
}

#[test]
fn every_entry_is_documented_and_keeps_its_laws() {
    assert_eq!(ours().len(), 17);
    for entry in ours() {
        documentation_law(entry).unwrap();
        match entry.kind {
            "factor" => assert!(factor_law(entry, 256).unwrap().defined >= 48, "{}", entry.name),
            "variable" => drop(manifold_law(entry, 256).unwrap()),
            _ => {}
        }
    }
}
