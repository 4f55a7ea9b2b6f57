//! `semantics = "table_one"`, `semantics = "my_rules.toml"`, or `[[semantics]]` rule by rule.
use super::{Rule, SHIPPED, read_rule, shipped};
use manifactor_config::{
    Diagnostics, Document, Errors, Format, Node, Problem, Section, Value, nearest, quoted_list,
};
use manifactor_graph::Values;
use std::path::Path;

/// Takes the rules out of a run's document. Files are found from `folder`, the document's own; `own` are the variables
/// that it declares.
pub(crate) fn read_semantics(section: &mut Section<'_>, folder: &Path, own: &Values) -> Vec<Rule> {
    let errors = section.errors();
    match section.take("semantics") {
        None => Vec::new(),
        Some(Node { place, value: Value::String(name) }) => match rules_named(&name, folder, own) {
            Ok(rules) => rules,
            Err(Unread::Unknown) => {
                let known: Vec<String> = SHIPPED.iter().map(|s| (*s).to_owned()).collect();
                let meant =
                    nearest(&name, SHIPPED).map_or(String::new(), |n| format!("did you mean `{n}`? "));
                let help =
                    format!("{meant}there is {}, or give the path of a .toml file", quoted_list(&known));
                errors.report(place, Problem::with_help(format!("unknown semantics `{name}`"), help));
                Vec::new()
            }
            Err(Unread::Wrong(diagnostics)) => {
                errors.extend(diagnostics);
                Vec::new()
            }
        },
        Some(Node { value: Value::Array(items), .. }) => {
            let sections = items.into_iter().filter_map(|item| Section::new(item, errors));
            sections.filter_map(|section| read_rule(section, own)).collect()
        }
        Some(other) => {
            let expected = "an array of rules, or the name of a file with rules";
            errors.report(other.place.clone(), Problem::wrong_type(expected, other.in_words()));
            Vec::new()
        }
    }
}

enum Unread {
    Unknown,
    Wrong(Diagnostics),
}

fn rules_named(name: &str, folder: &Path, own: &Values) -> Result<Vec<Rule>, Unread> {
    match shipped(name) {
        Some(text) => shipped_rules(name, text).map_err(Unread::Wrong),
        None if Format::of_path(name).is_some() => Document::open(folder.join(name))
            .and_then(|document| rules_of(&document, own))
            .map_err(Unread::Wrong),
        None => Err(Unread::Unknown),
    }
}

/// The rules of a file that is shipped.
pub(super) fn shipped_rules(name: &str, text: &str) -> Result<Vec<Rule>, Diagnostics> {
    let document = Document::parse(format!("{name}.toml"), text, Format::Toml)?;
    let rules = rules_of(&document, &Values::new())?;
    Ok(rules.into_iter().map(|rule| Rule { shipped: true, ..rule }).collect())
}

/// The rules of a document with nothing else in it.
fn rules_of(document: &Document, own: &Values) -> Result<Vec<Rule>, Diagnostics> {
    let errors = Errors::new();
    let rules = document.section(&errors).map(|mut section| {
        let rules = section.required_items("semantics").into_iter();
        let rules = rules.filter_map(|section| read_rule(section, own)).collect();
        section.finish();
        rules
    });
    errors.finish(rules)
}
