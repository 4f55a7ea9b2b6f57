//! What the compiler says to an author's mistakes: each message names the mistake and what to write.
#![allow(missing_docs)]

#[test]
fn mistakes_of_authors_are_named_with_what_to_write() {
    // the messages are those of one compiler: `TRYBUILD=overwrite` writes them anew for another
    trybuild::TestCases::new().compile_fail("tests/mistakes/*.rs");
}
