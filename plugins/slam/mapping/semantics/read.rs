//! `semantics = "resting"`, `semantics = "my_rules.toml"`, or `[[semantics]]` rule by rule; `sizes` likewise.
use super::{ClassSize, SHIPPED_RULES, SHIPPED_SIZES, SemanticRule};
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

/// `sizes` of a run: typical sizes of classes.
#[derive(JsonSchema)]
#[serde(untagged)]
pub enum SizesDocument {
    /// Name of a shipped table, or path of a file.
    Named(String),
    /// List of sizes.
    Rows(Vec<ClassSize>),
}

/// A file of semantic rules. A run includes it with `semantics = "this_file.toml"`.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RulesDocument {
    /// Rules that assign factors to objects.
    #[schemars(with = "Vec<SemanticRule>")]
    semantics: Vec<Node>,
}

/// A file of typical sizes. A run includes it with `sizes = "this_file.toml"`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SizesFile {
    sizes: Vec<Node>,
}

/// A setting that gives rules: as a list, by the name of a shipped file, or by the path of a file.
struct RuleList {
    /// Name of the setting.
    setting: &'static str,
    /// Names and texts of the shipped files.
    shipped: &'static [(&'static str, &'static str)],
    /// Description of a valid value.
    expected: &'static str,
    /// Reads the entries of a list.
    entries: fn(&[Node], &Values, &Errors) -> Vec<SemanticRule>,
    /// Returns the list of a file that contains nothing else.
    file: fn(&Node, &Errors) -> Option<Vec<Node>>,
}

const SEMANTICS: RuleList = RuleList {
    setting: "semantics",
    shipped: &SHIPPED_RULES,
    expected: "an array of rules, or the name of a file with rules",
    entries: rules,
    file: |root, errors| Some(root.read::<RulesDocument>(errors)?.semantics),
};

const SIZES: RuleList = RuleList {
    setting: "sizes",
    shipped: &SHIPPED_SIZES,
    expected: "an array of sizes, or the name of a file with sizes",
    entries: |items, _, errors| sizes(items, errors),
    file: |root, errors| Some(root.read::<SizesFile>(errors)?.sizes),
};

/// Reads the rules of a run's document. Paths are relative to `folder`, the folder of the document; `own` has
/// the variables that the document declares.
pub(crate) fn read_semantics(
    semantics: Option<&Node>,
    folder: &Path,
    own: &Values,
    errors: &Errors,
) -> Vec<SemanticRule> {
    SEMANTICS.read(semantics, folder, own, errors)
}

/// Reads the sizes of a run's document as rules. Paths are relative to `folder`, the folder of the document.
pub(crate) fn read_sizes(sizes: Option<&Node>, folder: &Path, errors: &Errors) -> Vec<SemanticRule> {
    SIZES.read(sizes, folder, &Values::new(), errors)
}

/// Returns the rules of a shipped file of rules.
pub(super) fn shipped_rules(name: &str) -> Result<Vec<SemanticRule>, Diagnostics> {
    SEMANTICS.read_named(name, Path::new(""), &Values::new()).unwrap_or_else(|| Ok(Vec::new()))
}

/// Returns a shipped table of sizes.
pub(super) fn shipped_sizes(name: &str) -> Result<Vec<ClassSize>, Diagnostics> {
    let text = SHIPPED_SIZES.iter().find(|(shipped, _)| *shipped == name).map_or("", |(_, text)| *text);
    let document = Document::parse(format!("{name}.toml"), text, Format::Toml)?;
    let errors = Errors::new();
    let rows = (SIZES.file)(document.root(), &errors);
    let rows = rows.map(|rows| rows.iter().filter_map(|row| row.read(&errors)).collect());
    errors.finish(rows)
}

impl RuleList {
    fn read(
        &self,
        written: Option<&Node>,
        folder: &Path,
        own: &Values,
        errors: &Errors,
    ) -> Vec<SemanticRule> {
        match written {
            None => Vec::new(),
            Some(Node { place, value: Value::String(name) }) => match self.read_named(name, folder, own) {
                Some(Ok(rules)) => rules,
                Some(Err(diagnostics)) => {
                    errors.extend(diagnostics);
                    Vec::new()
                }
                None => {
                    let names = || self.shipped.iter().map(|(name, _)| *name);
                    let known: Vec<String> = names().map(str::to_owned).collect();
                    let meant =
                        nearest(name, names()).map_or(String::new(), |n| format!("did you mean `{n}`? "));
                    let help =
                        format!("{meant}there is {}, or give the path of a .toml file", quoted_list(&known));
                    let unknown = format!("unknown {} `{name}`", self.setting);
                    errors.report(place.clone(), Fault::with_help(unknown, help));
                    Vec::new()
                }
            },
            Some(Node { value: Value::Array(items), .. }) => (self.entries)(items, own, errors),
            Some(other) => {
                errors.report(other.place.clone(), Fault::wrong_type(self.expected, other.in_words()));
                Vec::new()
            }
        }
    }

    /// Reads a shipped file or a file of the user; `None` if the name is neither.
    fn read_named(
        &self,
        name: &str,
        folder: &Path,
        own: &Values,
    ) -> Option<Result<Vec<SemanticRule>, Diagnostics>> {
        if let Some((_, text)) = self.shipped.iter().find(|(shipped, _)| *shipped == name) {
            let document = Document::parse(format!("{name}.toml"), *text, Format::Toml);
            let rules = document.and_then(|document| self.read_file(&document, &Values::new()));
            let optional = |rule| SemanticRule { optional: true, ..rule };
            return Some(rules.map(|rules| rules.into_iter().map(optional).collect()));
        }
        Format::of_path(name)?;
        Some(Document::open(folder.join(name)).and_then(|document| self.read_file(&document, own)))
    }

    /// Reads the rules of a document that contains nothing else.
    fn read_file(&self, document: &Document, own: &Values) -> Result<Vec<SemanticRule>, Diagnostics> {
        let errors = Errors::new();
        let list = (self.file)(document.root(), &errors);
        let rules = list.map(|list| (self.entries)(&list, own, &errors));
        errors.finish(rules)
    }
}

/// Reads each size as a rule. Errors are reported, and the size is left out.
fn sizes(items: &[Node], errors: &Errors) -> Vec<SemanticRule> {
    items.iter().filter_map(|item| item.read::<ClassSize>(errors)?.rule()).collect()
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
