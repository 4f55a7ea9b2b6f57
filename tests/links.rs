//! Links of all Markdown files: their relative targets exist, and their anchors are headings.
use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Collects the Markdown files below a folder, except hidden folders and folders of builds.
fn collect_pages(folder: &Path, found: &mut Vec<PathBuf>) {
    for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        let name = path.file_name().unwrap().to_string_lossy();
        // corpora and templates have pages that are no documentation
        let is_skipped = name.starts_with('.')
            || ["target", "out", "corpus", "plugin_template", "node_modules"].contains(&&*name);
        if path.is_dir() && !path.is_symlink() && !is_skipped {
            collect_pages(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "md") {
            found.push(path);
        }
    }
}

/// Replaces code, in blocks and in lines, by spaces, so that lines keep their numbers.
fn without_code(page: &str) -> Vec<String> {
    let mut is_code = false;
    let blank = |line: &str| {
        let parts = line.split('`').enumerate();
        parts.map(|(i, part)| if i % 2 == 0 { part } else { " " }).collect::<String>()
    };
    let lines = page.lines().map(|line| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        if is_code || is_fence { String::new() } else { blank(line) }
    });
    lines.collect()
}

/// Returns the targets of links and pictures, each with its line number. A text or target may be wrapped.
fn links(page: &str) -> Vec<(usize, String)> {
    let text = without_code(page).join("\n");
    let mut links = vec![];
    for (at, _) in text.match_indices("](") {
        let target = text[at + 2..].split(')').next().unwrap_or_default().trim();
        let line = text[..at].matches('\n').count() + 1;
        links.push((line, target.split_whitespace().next().unwrap_or_default().to_owned()));
    }
    links
}

/// Returns the anchors of the headings of a page, by the rules of GitHub.
fn anchors(page: &str) -> BTreeSet<String> {
    let mut counts: HashMap<String, usize> = HashMap::new();
    let mut anchors = BTreeSet::new();
    let mut is_code = false;
    for line in page.lines() {
        is_code ^= line.trim_start().starts_with("```");
        let title = line.trim_start_matches('#');
        if is_code || title.len() == line.len() || !title.starts_with(' ') {
            continue;
        }
        // the text of a link counts, its target does not
        let mut text = String::new();
        let mut rest = title.trim();
        while let Some((before, after)) = rest.split_once("](") {
            text += before;
            rest = after.split_once(')').map_or("", |(_, after)| after);
        }
        text += rest;
        let name: String = text
            .to_lowercase()
            .chars()
            .map(|c| if c == ' ' { '-' } else { c })
            .filter(|c| c.is_alphanumeric() || "_-".contains(*c))
            .collect();
        let count = counts.entry(name.clone()).or_default();
        anchors.insert(if *count == 0 { name } else { format!("{name}-{count}") });
        *count += 1;
    }
    anchors
}

#[test]
fn each_relative_link_has_its_target() {
    let mut pages = vec![];
    collect_pages(root(), &mut pages);
    pages.sort();
    assert!(pages.iter().any(|page| page.ends_with("README.md")), "{pages:?}");
    let (mut wrong, mut count) = (vec![], 0);
    for page in &pages {
        let text = std::fs::read_to_string(page).unwrap();
        for (line, link) in links(&text) {
            if link.contains("://") || link.starts_with("mailto:") {
                continue;
            }
            count += 1;
            let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let target = if file.is_empty() { page.clone() } else { page.parent().unwrap().join(file) };
            let place = format!("{}:{line}: {link}", page.strip_prefix(root()).unwrap().display());
            if !target.exists() {
                wrong.push(format!("{place}: no such file"));
            } else if !anchor.is_empty()
                && !std::fs::read_to_string(&target).is_ok_and(|text| anchors(&text).contains(anchor))
            {
                wrong.push(format!("{place}: no such heading"));
            }
        }
    }
    assert!(count > 150, "{count} links");
    assert!(wrong.is_empty(), "broken links:\n{}", wrong.join("\n"));
}

#[test]
fn anchors_are_those_of_github() {
    let page =
        "# A `b`: c, d_e!\n```sh\n# no heading\n```\n## [Two](x.md) words\n## Two words\n#no heading\n";
    let expected = ["a-b-c-d_e", "two-words", "two-words-1"].map(String::from);
    assert_eq!(anchors(page), BTreeSet::from(expected));
}

#[test]
fn links_in_code_do_not_count() {
    let page = "see [a](b.md#c)\n`[x](y)`\n```\n[x](y)\n```\n[long\ntext](d.md)\n";
    assert_eq!(links(page), [(1, "b.md#c".to_owned()), (7, "d.md".to_owned())]);
}
