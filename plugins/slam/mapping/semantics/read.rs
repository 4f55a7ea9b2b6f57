//! `semantics = "resting"`, `semantics = "my_rules.toml"`, or `[[semantics]]` rule by rule.
use super::{SHIPPED_RULES, SemanticRule};
use manifactor_config::{Diagnostics, Document, Errors, Fault, Format, Node, Value, nearest, quoted_list};
use manifactor_graph::Values;
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::Path;

/// `semantics` of a run: rules that assign factors to objects.
#[derive(JsonSchema)]
#[serde(untagged)]
pub enum SemanticsDocument {
    /// Name of a shipped table, or path of a file.
    Named(String),
    /// List of rules.
    Rules(Vec<SemanticRule>),
}

/// A file of semantic rules. A run includes it with `semantics = "this_file.toml"`.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RulesDocument {
    /// Rules that assign factors to objects.
    #[schemars(with = "Vec<SemanticRule>")]
    semantics: Vec<Node>,
}

/// Reads the rules of a run's document. Paths are relative to `folder`, the folder of the document; `own` has
/// the variables that the document declares.
pub(crate) fn read_semantics(
    semantics: Option<&Node>,
    folder: &Path,
    own: &Values,
    errors: &Errors,
) -> Vec<SemanticRule> {
    match semantics {
        None => Vec::new(),
        Some(Node { place, value: Value::String(name) }) => match rules_named(name, folder, own) {
            Ok(rules) => rules,
            Err(ReadFailure::Unknown) => {
                let names = SHIPPED_RULES.map(|(name, _)| name);
                let known = names.map(str::to_owned);
                let meant = nearest(name, names).map_or(String::new(), |n| format!("did you mean `{n}`? "));
                let help =
                    format!("{meant}there is {}, or give the path of a .toml file", quoted_list(&known));
                errors.report(place.clone(), Fault::with_help(format!("unknown semantics `{name}`"), help));
                Vec::new()
            }
            Err(ReadFailure::Wrong(diagnostics)) => {
                errors.extend(diagnostics);
                Vec::new()
            }
        },
        Some(Node { value: Value::Array(items), .. }) => rules(items, own, errors),
        Some(other) => {
            let expected = "an array of rules, or the name of a file with rules";
            errors.report(other.place.clone(), Fault::wrong_type(expected, other.in_words()));
            Vec::new()
        }
    }
}

/// Reads each rule over the document's own variables. Errors are reported, and the rule is left out.
fn rules(items: &[Node], own: &Values, errors: &Errors) -> Vec<SemanticRule> {
    let read = |item: &Node| {
        let rule = item.read::<SemanticRule>(errors)?;
        rule.check(item, own, errors)?;
        Some(rule)
    };
    items.iter().filter_map(read).collect()
}

impl SemanticRule {
    /// Checks that the rule is consistent. Errors are reported at their position.
    fn check(&self, written: &Node, own: &Values, errors: &Errors) -> Option<()> {
        let place = written.field("factor").unwrap_or(written).place.clone();
        self.factor.check(self.with.iter().zip(written.items("with")), &place, own, errors)?;
        if let Some(Err(error)) = self.factor.rows.map(|rows| self.noise.whitener(rows)) {
            let place = written.field("noise").unwrap_or(written).place.clone();
            errors.report(place, Fault::invalid(error.to_string()));
        }
        if self.factor.partners() > 0 && self.near.is_none() {
            let message =
                format!("`{}` connects objects, and the rule does not say which", self.factor.factor_type());
            let help = "say where the other one is: near = { classes = [\"tv monitor\"], within_m = 0.5 }";
            errors.report(place, Fault::with_help(message, help));
            return None;
        }
        Some(())
    }
}

enum ReadFailure {
    Unknown,
    Wrong(Diagnostics),
}

fn rules_named(name: &str, folder: &Path, own: &Values) -> Result<Vec<SemanticRule>, ReadFailure> {
    match SHIPPED_RULES.iter().find(|(shipped, _)| *shipped == name) {
        Some((_, text)) => shipped_rules(name, text).map_err(ReadFailure::Wrong),
        None if Format::of_path(name).is_some() => Document::open(folder.join(name))
            .and_then(|document| rules_of(&document, own))
            .map_err(ReadFailure::Wrong),
        None => Err(ReadFailure::Unknown),
    }
}

/// Reads the rules of a shipped file.
pub(super) fn shipped_rules(name: &str, text: &str) -> Result<Vec<SemanticRule>, Diagnostics> {
    let document = Document::parse(format!("{name}.toml"), text, Format::Toml)?;
    let rules = rules_of(&document, &Values::new())?;
    Ok(rules.into_iter().map(|rule| SemanticRule { shipped: true, ..rule }).collect())
}

/// Reads the rules of a document that contains nothing else.
fn rules_of(document: &Document, own: &Values) -> Result<Vec<SemanticRule>, Diagnostics> {
    let errors = Errors::new();
    let read = document.root().read::<RulesDocument>(&errors);
    let rules = read.map(|document| rules(&document.semantics, own, &errors));
    errors.finish(rules)
}
