//! The config reference: every document and every linked name, as Markdown.
//!
//! It begins with an index by name, with links from a document to its types and back.
pub(crate) mod documents;
pub(crate) mod fields;

use crate::reference::documents::DOCUMENTS;
use crate::reference::fields::{Field, fields};
use manifactor::config::Definitions;
use manifactor::graph::Noise;
use manifactor::graph::catalogue::{self, Entry};
use manifactor::graph::invariance::invariances_of;
use serde_json::Value;
use std::collections::{BTreeMap, HashMap};

const HEAD: &str = "# Config reference
`manifactor list --markdown` writes this page, and a test compares the two. `manifactor explain NAME` prints one of these
entries, and `manifactor schema` prints the JSON Schema of all of them.

For completion and checks in an editor, write the schema of a kind of document to a file with
`manifactor schema run > run.schema.json` (or `graph`, `experiment`, `rules`; without a name, one schema for all). Then name
the file to the editor:
- TOML, with taplo or VS Code with Even Better TOML: `#:schema ./run.schema.json` as first line of the document;
- YAML, with the language server of Red Hat: `# yaml-language-server: $schema=./run.schema.json` as first line;
- JSON, with VS Code: an entry under `json.schemas` in its settings.

`a.b` is the field `b` of the table `a`, and `a[].b` is the field `b` of each table in the list `a`.
";

/// Returns the whole page.
pub(crate) fn markdown() -> String {
    let mut out = HEAD.to_owned() + "\n## Contents\n";
    for document in &DOCUMENTS {
        let title = document.title;
        out += &format!("- [{title}](#{})\n", title.to_lowercase().replace(' ', "-"));
    }
    out += &format!("- [Noise](#noise)\n{}", contents());
    out += "- [Settings that several types share](#settings-that-several-types-share)\n";
    for document in &DOCUMENTS {
        out += &format!("\n## {}\n{}", document.title, table(&document.fields()));
    }
    let mut noise = Definitions::new();
    let schema = noise.of::<Noise>();
    let docs = schema.get("description").and_then(Value::as_str).unwrap_or_default().to_owned();
    out += &format!("\n## Noise\n{docs}\n{}", table(&fields(&noise.document(schema))));
    let shared = shared();
    for of_kind in catalogue::all().chunk_by(|a, b| a.kind == b.kind) {
        // `Every` keeps the heading different from a type with the same name as the kind
        out += &format!("\n## Every {}\n", of_kind.first().map_or("", |e| e.kind));
        for entry in of_kind {
            out += &format!("\n### `{}`\n{}\n", entry.name, section(entry, &shared));
        }
    }
    out += "\n## Settings that several types share\n";
    for (name, fields) in &shared {
        out += &format!("\n### `{name}`, shared\n{}", table(fields));
    }
    out
}

/// Tables of settings that are equal in several types, such as `stop` and `linear` in solvers: their fields
/// by name. The reference describes them once.
fn shared() -> BTreeMap<String, Vec<Field>> {
    let mut met: BTreeMap<String, Vec<(Vec<Field>, usize)>> = BTreeMap::new();
    for entry in catalogue::all() {
        let fields = fields((entry.schema)().as_value());
        for field in fields.iter().filter(|field| !field.name.contains('.')) {
            let within = within(&fields, &field.name);
            let of_name = met.entry(field.name.clone()).or_default();
            match of_name.iter_mut().find(|(known, _)| *known == within) {
                Some((_, count)) => *count += 1,
                None => of_name.push((within, 1)),
            }
        }
    }
    let common = |(name, mut all): (String, Vec<(Vec<Field>, usize)>)| {
        all.retain(|(fields, count)| !fields.is_empty() && *count > 1);
        Some((name, all.into_iter().max_by_key(|(_, count)| *count)?.0))
    };
    met.into_iter().filter_map(common).collect()
}

/// The fields of the table `name`.
fn within(fields: &[Field], name: &str) -> Vec<Field> {
    let prefix = format!("{name}.");
    fields.iter().filter(|field| field.name.starts_with(&prefix)).cloned().collect()
}

/// A type's own fields. A shared table has only its name and a link.
fn own(fields: Vec<Field>, shared: &BTreeMap<String, Vec<Field>>) -> Vec<Field> {
    let is_shared: Vec<String> = shared
        .iter()
        .filter(|(name, of)| within(&fields, name) == **of)
        .map(|(name, _)| name.clone())
        .collect();
    let of_shared = |field: &Field| is_shared.iter().any(|name| field.name.starts_with(&format!("{name}.")));
    let mut own: Vec<Field> = fields.into_iter().filter(|field| !of_shared(field)).collect();
    for field in own.iter_mut().filter(|field| is_shared.contains(&field.name)) {
        field.docs += &format!(" [Its fields](#{}-shared).", field.name);
    }
    own
}

/// A link for each name. Names that occur in several kinds are numbered in order, as in the anchors of
/// GitHub and mdBook.
fn contents() -> String {
    let mut met: HashMap<&str, usize> = HashMap::new();
    let mut link = |name: &'static str| {
        let before = *met.entry(name).and_modify(|n| *n += 1).or_insert(0);
        if before == 0 { format!("[`{name}`](#{name})") } else { format!("[`{name}`](#{name}-{before})") }
    };
    let mut out = String::new();
    for of_kind in catalogue::all().chunk_by(|a, b| a.kind == b.kind) {
        let kind = of_kind.first().map_or("", |e| e.kind);
        let heading = linked(kind);
        let links: Vec<_> = of_kind.iter().map(|entry| link(entry.name)).collect();
        out += &format!("- {heading}: {}\n", links.join(", "));
    }
    out
}

fn section(entry: &Entry, shared: &BTreeMap<String, Vec<Field>>) -> String {
    let mut out = format!("{}\n", entry.docs().trim());
    let notes = notes(entry);
    if !notes.is_empty() {
        out += &format!("\n{}\n", notes.join(" "));
    }
    out + &table(&own(fields((entry.schema)().as_value()), shared))
}

/// Facts about a type beyond its docs: variables, rows, directions, invariances.
pub(crate) fn notes(entry: &Entry) -> Vec<String> {
    let signature = (entry.signature)();
    let mut notes = vec![];
    if let Some(rows) = signature.rows {
        let names: Vec<_> =
            signature.variables.iter().map(|id| manifactor::graph::manifold_name(*id)).collect();
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
        let kind = linked(&cell(&field.kind));
        format!("| `{}` | {kind} | {default} | {} |\n", field.name, cell(&field.docs))
    };
    let rows: String = fields.iter().map(row).collect();
    format!("\n| field | type | default | meaning |\n| --- | --- | --- | --- |\n{rows}")
}

/// A link to the section of a kind of registered types, or of noise.
fn linked(kind: &str) -> String {
    match kind == "noise" || catalogue::all().iter().any(|entry| entry.kind == kind) {
        true if kind == "noise" => "[noise](#noise)".into(),
        true => format!("[{kind}](#every-{kind})"),
        false => kind.to_owned(),
    }
}
