//! The command line accepts the commands in the book, and their files exist.
use crate::root;
use clap::Parser;
use std::path::Path;

/// Returns the lines of the shell blocks in a page, without comments.
fn commands(page: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(page).unwrap();
    let (mut found, mut open) = (vec![], false);
    for line in text.lines() {
        match line {
            "```sh" => open = true,
            "```" => open = false,
            line if open => found.push(line.split(" #").next().unwrap_or_default().trim().to_owned()),
            _ => {}
        }
    }
    found
}

#[test]
fn every_command_of_the_book_is_understood() {
    let folders = ["docs", "docs/reference"].map(|folder| root().join(folder));
    let pages = folders.iter().flat_map(|f| std::fs::read_dir(f).unwrap()).map(|entry| entry.unwrap().path());
    let pages = pages.filter(|p| p.extension().is_some_and(|e| e == "md")).chain([root().join("README.md")]);
    let mut count = 0;
    for (page, command) in pages.flat_map(|p| commands(&p).into_iter().map(move |c| (p.clone(), c))) {
        let ours = match command.split_once("cargo run") {
            Some((_, rest)) => rest.split_once(" -- ").map(|(_, words)| words),
            None => command.strip_prefix("manifactor "),
        };
        let Some(words) = ours else { continue };
        let words: Vec<&str> = words.split_whitespace().take_while(|word| *word != ">").collect();
        if let Err(error) = manifactor_cli::Cli::try_parse_from(["manifactor"].iter().chain(&words)) {
            panic!("{}: {command}\n{error}", page.display());
        }
        for file in words.iter().filter(|word| word.starts_with("examples/")) {
            assert!(root().join(file).exists(), "{}: there is no {file}", page.display());
        }
        count += 1;
    }
    assert!(count >= 8, "{count} commands");
}
