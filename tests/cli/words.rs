//! Printed text: examples of the book, messages, logs, on any terminal.
use crate::root;

mod book;
mod bundles;
mod help;
mod kinds;
mod least_squares;
mod log;
mod mistakes;
mod slam_systems;
mod terminal;
mod tutorial;

/// Returns the first block of `language` in a page of the book that contains `text`.
fn block(page: &str, language: &str, text: &str) -> String {
    let book = std::fs::read_to_string(root().join("docs").join(page)).unwrap();
    let opening = format!("```{language}\n");
    let mut blocks = book.split(&opening).skip(1).filter_map(|rest| rest.split("```").next());
    blocks
        .find(|block| block.contains(text))
        .unwrap_or_else(|| panic!("{page}: no {language} with `{text}`"))
        .to_owned()
}
