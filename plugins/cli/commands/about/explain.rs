//! `manifactor explain`: the meaning of a name in a config.
use crate::failure::Failure;
use crate::output;
use crate::output::text::{self, Table};
use crate::reference::documents::{DOCUMENTS, DocumentKind};
use crate::reference::fields::{Field, fields};
use crate::reference::notes;
use crate::status::Status;
use clap::{Args, Command};
use manifactor::config::nearest;
use manifactor::graph::catalogue::{self, Entry};
use manifactor::graph::invariance::invariances_of;
use serde_json::{Value, json};

/// Explain a name: its meaning, its fields with their defaults, and an example.
///
/// The name is one that `manifactor list` prints, a kind of document (graph, run, rules, experiment), or a
/// field of a document, such as `axes` or `summary.baseline`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Explain {
    /// A registered name, a kind of document, or a field of a document.
    name: String,
    /// Print JSON: the docs and the JSON Schema.
    #[arg(long)]
    pub(crate) json: bool,
}

const EXAMPLES: &str = "\
Examples:
  manifactor explain bounding_box
  manifactor explain experiment
  manifactor explain axes";

impl Explain {
    /// `program` has the names of the commands, for the error if the name is one of them.
    pub(crate) fn run(&self, program: &Command) -> Result<Status, Failure> {
        let entries: Vec<_> = catalogue::all().into_iter().filter(|entry| entry.name == self.name).collect();
        let documents: Vec<_> = DOCUMENTS.iter().filter(|kind| kind.name == self.name).collect();
        let fields = document_fields(&self.name);
        if entries.is_empty() && documents.is_empty() && fields.is_empty() {
            return Err(self.unknown(program));
        }
        if self.json {
            let mut all: Vec<Value> = entries.iter().map(|entry| entry_as_json(entry)).collect();
            all.extend(documents.iter().map(|kind| {
                json!({
                    "kind": "document", "name": kind.name, "docs": kind.about, "example": kind.example,
                    "schema": kind.schema(),
                })
            }));
            all.extend(fields.iter().map(DocumentField::as_json));
            output::print_json(&all);
        } else {
            let mut texts: Vec<String> = entries.into_iter().map(explain_entry).collect();
            texts.extend(documents.into_iter().map(explain_document));
            texts.extend(fields.iter().map(DocumentField::explain));
            output::print(&texts.join("\n"));
        }
        Ok(Status::Done)
    }

    fn unknown(&self, program: &Command) -> Failure {
        let name = &self.name;
        if program.get_subcommands().any(|command| command.get_name() == name) {
            let help = format!("`manifactor help {name}` explains the command");
            return Failure::with_help(format!("`{name}` is a command, and not a name in a document"), help);
        }
        if catalogue::all().iter().any(|entry| entry.kind == name) {
            let help = format!("`manifactor list {name}` prints the names of this kind");
            return Failure::with_help(format!("`{name}` is a kind of names"), help);
        }
        let known = catalogue::all().into_iter().map(|entry| entry.name);
        let known = known.chain(DOCUMENTS.iter().map(|kind| kind.name)).map(str::to_owned);
        let of_documents = DOCUMENTS.iter().flat_map(DocumentKind::fields).map(|field| field.name);
        let known: Vec<String> = known.chain(of_documents).collect();
        let meant = nearest(name, known.iter().map(String::as_str));
        let meant = meant.map(|m| format!("did you mean `{m}`? ")).unwrap_or_default();
        Failure::with_help(
            format!("there is no name `{name}`"),
            format!(
                "{meant}`manifactor list` prints the registered names; graph, run, rules and experiment are documents"
            ),
        )
    }
}

fn entry_as_json(entry: &Entry) -> Value {
    json!({
        "kind": entry.kind, "name": entry.name, "module": entry.module, "docs": entry.docs(),
        "schema": (entry.schema)(),
        "unchanged_by": invariances_of(entry).iter().map(|i| i.motion).collect::<Vec<_>>(),
    })
}

fn explain_entry(entry: &'static Entry) -> String {
    let article = article(entry.kind);
    let mut out = format!(
        "{}: {article} {}, of {}\n\n{}\n",
        entry.name,
        entry.kind,
        entry.module,
        prose(&entry.docs())
    );
    for note in notes(entry) {
        out += &format!("\n{note}\n");
    }
    out += &table(fields((entry.schema)().as_value()));
    if let Some(example) = entry.example() {
        out += &format!("\nExample:\n\n{}\n", indent(&example));
    }
    out
}

fn explain_document(kind: &'static DocumentKind) -> String {
    format!(
        "{}: a kind of document\n\n{}\n{}\nExample:\n\n{}\n",
        kind.name,
        text::wrap(kind.about),
        table(kind.fields()),
        indent(kind.example)
    )
}

/// A field that one or several kinds of documents have with the same meaning.
struct DocumentField {
    field: Field,
    /// The fields of the table, or of each table in the list.
    inner: Vec<Field>,
    documents: Vec<&'static str>,
}

/// Returns the fields with this name in all kinds of documents.
fn document_fields(name: &str) -> Vec<DocumentField> {
    let mut found: Vec<DocumentField> = vec![];
    for kind in &DOCUMENTS {
        let all = kind.fields();
        let Some(field) = all.iter().find(|field| field.name == name).cloned() else { continue };
        let begins = [format!("{name}."), format!("{name}[].")];
        let is_inner = |field: &&Field| begins.iter().any(|begin| field.name.starts_with(begin));
        let inner: Vec<Field> = all.iter().filter(is_inner).cloned().collect();
        match found.iter_mut().find(|known| known.field == field && known.inner == inner) {
            Some(known) => known.documents.push(kind.name),
            None => found.push(DocumentField { field, inner, documents: vec![kind.name] }),
        }
    }
    found
}

impl DocumentField {
    fn explain(&self) -> String {
        let Field { name, kind, default, required, docs } = &self.field;
        let mut out = format!(
            "{name}: a field of the document {}\n\n{}\n",
            self.documents.join(", "),
            text::wrap(docs)
        );
        let mut facts = vec![format!("Type: {kind}.")];
        facts.extend(default.iter().map(|default| format!("Default: {default}.")));
        facts.extend(required.then(|| "Required.".to_owned()));
        if catalogue::all().iter().any(|entry| entry.kind == kind) {
            facts.push(format!("`manifactor list {kind}` prints the names of this type."));
        }
        out += &format!("\n{}\n", text::wrap(&facts.join(" ")));
        out + &table(self.inner.clone())
    }

    fn as_json(&self) -> Value {
        let field = |field: &Field| {
            json!({
                "name": field.name, "type": field.kind, "default": field.default, "required": field.required,
                "docs": field.docs,
            })
        };
        let mut json = field(&self.field);
        json["kind"] = json!("field");
        json["documents"] = json!(self.documents);
        json["fields"] = self.inner.iter().map(field).collect();
        json
    }
}

/// A table of fields; nothing if there are none.
fn table(fields: Vec<Field>) -> String {
    if fields.is_empty() {
        return String::new();
    }
    let mut table = Table::of_words(&["field", "type", "default", "meaning"]);
    for field in fields {
        let default = field.default.unwrap_or_else(|| if field.required { "required" } else { "" }.into());
        table.row([field.name, field.kind, default, field.docs]);
    }
    format!("\n{}\n", table.text())
}

/// The indefinite article before a word.
fn article(word: &str) -> &'static str {
    if word.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" }
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
