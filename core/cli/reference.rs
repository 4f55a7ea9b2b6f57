//! The config reference: every document and every name that is linked, as Markdown.
use crate::fields::{Field, fields};
use manifactor::config::{Definitions, graph_root};
use manifactor::graph::catalogue::{self, Entry};
use manifactor::graph::invariance::invariances_of;
use manifactor::slam::schema::run_root;
use serde_json::Value;

const HEAD: &str = "# Config reference
Written by `manifactor list --markdown`; a test fails where it is not what is linked. `manifactor explain NAME` prints one of
these entries, `manifactor schema` the JSON Schema of all of it.

For completion and checks in an editor: `manifactor schema > manifactor.schema.json`, and as first line of a document
`#:schema ./manifactor.schema.json` (taplo, and VS Code with Even Better TOML).
";

/// The whole page.
pub(crate) fn markdown() -> String {
    let mut out = HEAD.to_owned();
    for (title, root) in
        [("A literal graph", graph_root as fn(&mut Definitions) -> Value), ("A run", run_root)]
    {
        let mut definitions = Definitions::new();
        let root = root(&mut definitions);
        out += &format!("\n## {title}\n");
        out += &table(&fields(&definitions.document(root)));
    }
    for of_kind in catalogue::all().chunk_by(|a, b| a.kind == b.kind) {
        out += &format!("\n## {}\n", of_kind.first().map_or("", |e| e.kind));
        for entry in of_kind {
            out += &format!("\n### `{}`\n{}\n", entry.name, section(entry));
        }
    }
    out
}

fn section(entry: &Entry) -> String {
    let mut out = format!("{}\n", entry.docs().trim());
    let notes = notes(entry);
    if !notes.is_empty() {
        out += &format!("\n{}\n", notes.join(" "));
    }
    out + &table(&fields((entry.schema)().as_value()))
}

/// What a type has beyond its docs: variables, rows, directions, invariances.
pub(crate) fn notes(entry: &Entry) -> Vec<String> {
    let signature = (entry.signature)();
    let mut notes = vec![];
    if let Some(rows) = signature.rows {
        let names: Vec<_> = signature.variables.iter().map(|id| catalogue::manifold_name(*id)).collect();
        let many = if signature.many { "any number of " } else { "" };
        notes.push(format!("Variables: {many}{}. Rows of its residual: {rows}.", names.join(", ")));
    }
    if !signature.tangent.is_empty() {
        notes.push(format!("Tangent directions: {}.", signature.tangent.join(", ")));
    }
    notes.extend(invariances_of(entry).iter().map(|i| format!("Unchanged by {}.", i.motion)));
    notes
}

fn table(fields: &[Field]) -> String {
    if fields.is_empty() {
        return String::new();
    }
    let cell = |text: &str| text.replace('|', "\\|").replace('\n', " ");
    let row = |field: &Field| {
        let default = match (&field.default, field.required) {
            (Some(default), _) => format!("`{}`", cell(default)),
            (None, true) => "required".into(),
            (None, false) => String::new(),
        };
        format!("| `{}` | {} | {default} | {} |\n", field.name, cell(&field.kind), cell(&field.docs))
    };
    let rows: String = fields.iter().map(row).collect();
    format!("\n| field | type | default | what it is |\n| --- | --- | --- | --- |\n{rows}")
}
