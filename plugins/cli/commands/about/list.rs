//! `manifactor list`: the names that a config can use.
use crate::failure::Failure;
use crate::output;
use crate::output::text::Table;
use crate::reference;
use crate::status::Status;
use clap::Args;
use manifactor::config::nearest;
use manifactor::graph::catalogue;
use serde_json::json;

/// List the names that a config can use: factors, variables, losses, solvers, sources and more.
#[derive(Debug, Args)]
pub(crate) struct List {
    /// One kind only, such as `factors`.
    kind: Option<String>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print the config reference of everything that is linked, as Markdown (docs/config.md).
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
            output::json(&rows.collect::<Vec<_>>());
            return Ok(Status::Done);
        }
        let mut out = String::new();
        for of_kind in entries.chunk_by(|a, b| a.kind == b.kind) {
            let mut table = Table::of_words(&[of_kind.first().map_or("", |e| e.kind), "what it is"]);
            for entry in of_kind {
                table.row([entry.name, &entry.summary()]);
            }
            out += &format!("{}\n\n", table.text());
        }
        output::print(&(out + "`manifactor explain NAME` says more.\n"));
        Ok(Status::Done)
    }
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
        format!("there is no kind of things called `{kind}`"),
        format!("{meant}there are {}", kinds.join(", ")),
    ))
}
