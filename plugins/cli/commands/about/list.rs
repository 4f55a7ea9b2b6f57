//! `manifactor list`: the names that a config can use.
use crate::failure::Failure;
use crate::output;
use crate::output::text::Table;
use crate::reference;
use crate::status::Status;
use clap::Args;
use manifactor::config::nearest;
use manifactor::graph::catalogue::{self, Entry};
use serde_json::json;
use std::collections::HashSet;
use std::io::IsTerminal;

/// List the names that a config can use: factors, variables, losses, solvers, sources and more.
///
/// On a terminal, each name has a summary. Into a file or a pipe, one name is printed per line.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor list factors")]
pub(crate) struct List {
    /// One kind only, such as `factors`.
    kind: Option<String>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print the config reference of everything that is linked, as Markdown (docs/reference/config.md).
    #[arg(long, conflicts_with_all = ["json", "kind"])]
    markdown: bool,
}

impl List {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        if self.markdown {
            output::print(&reference::markdown());
            return Ok(Status::Done);
        }
        let entries = match &self.kind {
            None => catalogue::all(),
            Some(kind) => catalogue::entries(known(kind)?),
        };
        if self.json {
            let rows =
                entries.iter().map(|e| json!({ "kind": e.kind, "name": e.name, "summary": e.summary() }));
            output::print_json(&rows.collect::<Vec<_>>());
            return Ok(Status::Done);
        }
        let text = if std::io::stdout().is_terminal() { tables(&entries) } else { names(&entries) };
        output::print(&text);
        Ok(Status::Done)
    }
}

/// A table for each kind, for readers.
fn tables(entries: &[&'static Entry]) -> String {
    let mut out = String::new();
    for of_kind in entries.chunk_by(|a, b| a.kind == b.kind) {
        let mut table = Table::of_words(&[of_kind.first().map_or("", |e| e.kind), "summary"]);
        for entry in of_kind {
            table.row([entry.name, &entry.summary()]);
        }
        out += &format!("{}\n\n", table.text());
    }
    out + "`manifactor explain NAME` has the details.\n"
}

/// One name per line, for other programs. A name of several kinds has one line.
fn names(entries: &[&'static Entry]) -> String {
    let mut printed = HashSet::new();
    let new = entries.iter().filter(|entry| printed.insert(entry.name));
    new.map(|entry| format!("{}\n", entry.name)).collect()
}

/// Returns the kind for its singular or plural, such as `factor` or `factors`.
fn known(kind: &str) -> Result<&'static str, Failure> {
    let mut kinds: Vec<&'static str> = catalogue::all().iter().map(|e| e.kind).collect();
    kinds.dedup();
    let singular = [kind.strip_suffix("es"), kind.strip_suffix('s'), Some(kind)];
    if let Some(found) = kinds.iter().find(|k| singular.contains(&Some(**k))) {
        return Ok(found);
    }
    let meant =
        nearest(kind, kinds.iter().copied()).map(|k| format!("did you mean `{k}`? ")).unwrap_or_default();
    Err(Failure::with_help(
        format!("there is no kind `{kind}`"),
        format!("{meant}the kinds are {}", kinds.join(", ")),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_have_summaries_and_names_have_one_line_each() {
        let entries = catalogue::all();
        assert!(tables(&entries).contains("summary"));
        let names = names(&entries);
        assert!(entries.iter().all(|entry| names.lines().any(|line| line == entry.name)));
        let mut lines: Vec<&str> = names.lines().collect();
        lines.sort_unstable();
        assert!(lines.windows(2).all(|pair| pair[0] != pair[1]), "{lines:?}");
    }
}
