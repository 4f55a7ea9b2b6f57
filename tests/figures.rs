//! The figures of the book: each is on a page, has its command, and is small.
use std::path::{Path, PathBuf};

fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs")
}

/// Returns the figures: name and size in bytes.
fn figures() -> Vec<(String, u64)> {
    let entries = std::fs::read_dir(docs().join("figures")).unwrap().map(|entry| entry.unwrap());
    let figures =
        entries.map(|entry| (entry.file_name().into_string().unwrap(), entry.metadata().unwrap().len()));
    let mut figures: Vec<_> = figures.filter(|(name, _)| name != "README.md").collect();
    figures.sort();
    figures
}

fn pages(folder: &Path, text: &mut String) {
    for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        match path.is_dir() {
            true => pages(&path, text),
            false if path.extension().is_some_and(|e| e == "md") => {
                text.push_str(&std::fs::read_to_string(path).unwrap());
            }
            false => {}
        }
    }
}

#[test]
fn each_figure_is_on_a_page_of_the_book() {
    let mut text = String::new();
    pages(&docs(), &mut text);
    let figures = figures();
    assert!(figures.len() >= 12, "{figures:?}");
    for (name, _) in figures {
        // an image is ![description](path)
        let is_embedded = text.split("![").skip(1).any(|rest| {
            rest.split_once("](")
                .and_then(|(_, path)| path.split(')').next())
                .is_some_and(|path| path.ends_with(&format!("figures/{name}")))
        });
        assert!(is_embedded, "{name} is on no page of docs");
    }
}

#[test]
fn each_figure_has_its_command_and_each_row_its_figure() {
    let table = std::fs::read_to_string(docs().join("figures/README.md")).unwrap();
    let rows = table.lines().filter_map(|line| line.strip_prefix("| `"));
    let rows: Vec<Vec<&str>> = rows.map(|row| row.trim_end_matches(" |").split(" | ").collect()).collect();
    let names: Vec<&str> = rows.iter().map(|row| row[0].trim_end_matches('`')).collect();
    for (name, _) in figures() {
        assert_eq!(names.iter().filter(|own| **own == name).count(), 1, "{name} in docs/figures/README.md");
    }
    let drawn = std::fs::read_to_string(docs().join("../plugins/viz/examples/figures.rs")).unwrap();
    for (row, name) in rows.iter().zip(names) {
        assert_eq!(row.len(), 3, "{name}: figure, content, command");
        assert!(docs().join("figures").join(name).is_file(), "{name} does not exist");
        if let Some((_, own)) = row[2].split_once("figures -- ") {
            let own = own.trim_end_matches('`');
            assert!(drawn.contains(&format!("(\"{own}\", {own})")), "{own} is no figure of the example");
        }
    }
}

#[test]
fn figures_are_small() {
    // kilobytes; the moving picture is for the README
    for (name, size) in figures() {
        let most = match name.as_str() {
            "growing.svg" => 2000,
            name if name.ends_with(".svg") => 150,
            _ => 300,
        };
        assert!(size <= 1000 * most, "{name} has {size} bytes, at most {most} kB are allowed");
    }
}
