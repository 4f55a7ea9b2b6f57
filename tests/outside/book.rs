//! The TOML blocks of the book, as a reader would copy them.
use manifactor::config::{Document, Format, Node, Reader, Value};
use manifactor::graph::catalogue::{self, Entry};
use std::path::{Path, PathBuf};

fn pages(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
        match entry.is_dir() {
            true => pages(&entry, found),
            false if entry.extension().is_some_and(|e| e == "md") => found.push(entry),
            false => {}
        }
    }
}

/// Returns the TOML blocks of a page, each with its first line number.
fn blocks(page: &str) -> Vec<(usize, String)> {
    let (mut blocks, mut open) = (vec![], None);
    for (i, line) in page.lines().enumerate() {
        match (line, open.take()) {
            ("```toml", None) => open = Some((i + 2, String::new())),
            (_, None) => {}
            ("```", Some(block)) => blocks.push(block),
            (line, Some((at, text))) => open = Some((at, text + line + "\n")),
        }
    }
    blocks
}

/// Reads all tables that name a registered type, and returns the unknown names. A factor of an entry with `each` is
/// not complete without it.
fn read_all(node: &Node, place: &str) -> Vec<String> {
    let mut unknown = vec![];
    match &node.value {
        Value::Table(table) => {
            if let Some(Value::String(name)) = table.get("type").map(|field| &field.node.value) {
                let entries: Vec<&Entry> = catalogue::all().into_iter().filter(|e| e.name == *name).collect();
                // a factor and a gravity may have one name
                let read: Vec<_> = entries
                    .iter()
                    .map(|entry| (entry.read_boxed)(Reader::without(node, "type")).err())
                    .collect();
                match read.first() {
                    Some(Some(error)) if read.iter().all(Option::is_some) => {
                        panic!("{place}: {name}: {error}")
                    }
                    Some(_) => {}
                    None => unknown.push(name.clone()),
                }
            }
            let complete = table.iter().filter(|(name, _)| *name != "factor" || !table.contains_key("each"));
            unknown.extend(complete.flat_map(|(_, field)| read_all(&field.node, place)));
        }
        Value::Array(items) => unknown.extend(items.iter().flat_map(|item| read_all(item, place))),
        _ => {}
    }
    unknown
}

#[test]
fn every_block_of_toml_is_read() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let (mut found, mut count) = (vec![], 0);
    pages(&docs, &mut found);
    for page in found {
        // its blocks are wrong on purpose, and have a separate test
        if page.ends_with("mistakes.md") {
            continue;
        }
        for (line, text) in blocks(&std::fs::read_to_string(&page).unwrap()) {
            let place = format!("{}:{line}", page.display());
            let document = Document::parse(&place, text, Format::Toml).unwrap_or_else(|e| panic!("{e}"));
            let unknown = read_all(document.root(), &place);
            assert_eq!(unknown, [""; 0], "{place} names what is not registered");
            count += 1;
        }
    }
    assert!(count > 20, "{count} blocks");
}

#[test]
fn the_summary_has_every_page_and_no_other() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let summary = std::fs::read_to_string(docs.join("SUMMARY.md")).unwrap();
    let mut found = vec![];
    pages(&docs, &mut found);
    for page in &found {
        let name = page.strip_prefix(&docs).unwrap().display().to_string();
        assert!(
            name == "SUMMARY.md" || summary.contains(&format!("({name})")),
            "{name} is not in SUMMARY.md"
        );
    }
    for link in summary.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
        assert!(docs.join(link).is_file(), "SUMMARY.md leads to {link}, which is not there");
    }
}

#[test]
fn no_link_of_the_book_leads_out_of_it() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let (mut found, mut count) = (vec![], 0);
    pages(&docs, &mut found);
    for page in &found {
        let text = std::fs::read_to_string(page).unwrap();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if link.starts_with("http") || link.contains(' ') {
                continue;
            }
            // `tests/links.rs` checks the anchors
            let file = link.split_once('#').map_or(link, |(file, _)| file);
            let target = if file.is_empty() { page.clone() } else { page.parent().unwrap().join(file) };
            let place = format!("{}: {link}", page.display());
            let target = target.canonicalize().unwrap_or_else(|_| panic!("{place} leads nowhere"));
            assert!(target.starts_with(docs.canonicalize().unwrap()), "{place} leads out of the book");
            count += 1;
        }
    }
    assert!(count > 100, "{count} links");
}

/// Returns the ratios of our time to the best peer's, for the pose graphs in the first table of
/// `docs/benchmarks.md`.
fn pose_graph_ratios(page: &str) -> Vec<f64> {
    let table =
        page.split("## How fast is the default solver?").nth(1).unwrap().split("\n## ").next().unwrap();
    let object_maps = ["fifty_objects", "fr2_desk", "bundle"];
    let rows = table.lines().filter(|line| line.starts_with("| "));
    let cells = rows.map(|line| line.split('|').map(str::trim).collect::<Vec<_>>());
    cells.filter(|cells| !object_maps.contains(&cells[1])).filter_map(|cells| cells[8].parse().ok()).collect()
}

#[test]
fn the_readme_has_the_ratios_of_the_benchmarks() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let ratios = pose_graph_ratios(&std::fs::read_to_string(root.join("docs/benchmarks.md")).unwrap());
    assert!(ratios.len() >= 8, "{ratios:?}");
    let slowest = ratios.iter().copied().fold(0.0, f64::max);
    let fastest = ratios.iter().copied().fold(1.0, f64::min);
    let claim = format!("{:.1} to {:.1} times faster on public pose graphs", 1.0 / slowest, 1.0 / fastest);
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    assert!(readme.contains(&claim), "README.md does not have `{claim}`");
}

#[test]
fn the_front_page_lists_every_page() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let front = std::fs::read_to_string(docs.join("README.md")).unwrap();
    for page in std::fs::read_dir(&docs).unwrap().map(|entry| entry.unwrap().path()) {
        let name = page.file_name().unwrap().to_string_lossy().into_owned();
        let listed =
            ["README.md", "SUMMARY.md"].contains(&name.as_str()) || front.contains(&format!("({name})"));
        assert!(listed || page.extension().is_none_or(|e| e != "md"), "docs/README.md does not list {name}");
    }
}

/// Runs the peers' factors in the book with `python3`. A missing peer is reported, and its blocks are
/// skipped.
#[test]
fn blocks_of_python_run_where_their_packages_are() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/coming-from.md");
    let page = std::fs::read_to_string(page).unwrap();
    let blocks: Vec<&str> = page.split("```python\n").skip(1).filter_map(|b| b.split("```").next()).collect();
    assert_eq!(blocks.len(), 2);
    for block in blocks {
        let Ok(output) = std::process::Command::new("python3").args(["-c", block]).output() else {
            eprintln!("skipped: there is no python3");
            return;
        };
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        if let Some(missing) = said.lines().find(|line| line.starts_with("ModuleNotFoundError")) {
            eprintln!("skipped: {missing}");
            continue;
        }
        assert!(output.status.success(), "{block}\n{said}");
    }
}
