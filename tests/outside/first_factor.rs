//! `docs/first-factor.md`: its factor is the one here, and its output is the real output.
#[allow(unreachable_pub, reason = "as the page has it")]
mod in_the_middle;

use manifactor::graph::catalogue::find;
use manifactor::testing::{FactorCheck, Subject};
use std::path::Path;

#[test]
fn the_page_has_this_factor_and_what_is_found_of_it() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/first-factor.md");
    let page = std::fs::read_to_string(page).unwrap();
    assert!(page.contains(include_str!("first_factor/in_the_middle.rs").trim()), "the factor is another");
    let subject = Subject::example(find("factor", "in_the_middle").unwrap()).unwrap();
    let found = FactorCheck::default().run(&subject).to_string();
    // the last digits of the worst entry depend on rounding
    for line in found.lines().map(|line| line.split(", is ").next().unwrap_or_default()) {
        assert!(page.contains(line), "found is:\n{found}");
    }
}
