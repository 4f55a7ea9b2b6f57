//! Compiler messages for mistakes of factor authors: each names the mistake and its fix.
#![allow(missing_docs)]

#[test]
fn mistakes_of_authors_are_named_with_what_to_write() {
    // messages differ between compiler versions: `TRYBUILD=overwrite` rewrites them for a new one
    trybuild::TestCases::new().compile_fail("tests/mistakes/*.rs");
}
