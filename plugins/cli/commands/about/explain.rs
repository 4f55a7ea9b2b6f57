//! `manifactor explain`: the meaning of a name in a config.
use crate::failure::Failure;
use crate::output;
use crate::output::text::{self, Table};
use crate::reference::fields::fields;
use crate::reference::notes;
use crate::status::Status;
use clap::Args;
use manifactor::config::nearest;
use manifactor::graph::catalogue::{self, Entry};
use manifactor::graph::invariance::invariances_of;
use serde_json::json;

/// Explain a name: its meaning, its fields with their defaults, and an example.
#[derive(Debug, Args)]
pub(crate) struct Explain {
    /// A name that `manifactor list` prints.
    name: String,
    /// Print JSON: the docs and the JSON Schema.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Explain {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let all = catalogue::all();
        let found: Vec<_> = all.iter().filter(|e| e.name == self.name).collect();
        if found.is_empty() {
            let meant = nearest(&self.name, all.iter().map(|e| e.name));
            let meant = meant.map(|m| format!("did you mean `{m}`? ")).unwrap_or_default();
            return Err(Failure::with_help(
                format!("nothing is called `{}`", self.name),
                format!("{meant}`manifactor list` prints all names"),
            ));
        }
        if self.json {
            let entry = |e: &&&'static Entry| {
                json!({
                    "kind": e.kind, "name": e.name, "module": e.module, "docs": e.docs(), "schema": (e.schema)(),
                    "unchanged_by": invariances_of(e).iter().map(|i| i.motion).collect::<Vec<_>>(),
                })
            };
            output::json(&found.iter().map(entry).collect::<Vec<_>>());
        } else {
            let texts: Vec<_> = found.into_iter().map(|e| explain(e)).collect();
            output::print(&texts.join("\n"));
        }
        Ok(Status::Done)
    }
}

fn explain(entry: &Entry) -> String {
    let mut out =
        format!("{}: a {}, of {}\n\n{}\n", entry.name, entry.kind, entry.module, prose(&entry.docs()));
    for note in notes(entry) {
        out += &format!("\n{note}\n");
    }
    let fields = fields((entry.schema)().as_value());
    if !fields.is_empty() {
        let mut table = Table::of_words(&["field", "type", "default", "what it is"]);
        for field in fields {
            let default =
                field.default.unwrap_or_else(|| if field.required { "required" } else { "" }.into());
            table.row([field.name, field.kind, default, field.docs]);
        }
        out += &format!("\n{}\n", table.text());
    }
    if let Some(example) = entry.example() {
        out += &format!("\nExample:\n\n{}\n", indent(&example));
    }
    out
}

/// Returns the docs without line breaks and without the example, which has its own section.
fn prose(docs: &str) -> String {
    let mut paragraphs = Vec::new();
    for (i, part) in docs.split("```").enumerate() {
        match (i % 2 == 1, part.strip_prefix("text\n")) {
            (true, Some(verbatim)) => paragraphs.push(indent(verbatim.trim_end())),
            (true, None) => {}
            (false, _) => {
                paragraphs
                    .extend(part.split("\n\n").map(str::trim).filter(|p| !p.is_empty()).map(text::wrap));
            }
        }
    }
    paragraphs.join("\n\n")
}

fn indent(text: &str) -> String {
    text.lines().map(|l| format!("    {l}")).collect::<Vec<_>>().join("\n")
}
