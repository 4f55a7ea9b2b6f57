//! The document that describes a run.
//!
//! ```toml
//! title = "fr1/desk"
//! semantics = "table_one"
//!
//! [source]
//! type = "tum"
//! sequence = "rgbd_dataset_freiburg1_desk"
//! odometry = "trajectories/dvo_vo.txt"
//!
//! [gravity]
//! type = "ground_truth"
//!
//! [[variants]]
//! name = "without orientation"
//! set = { semantics = [] }
//!
//! [[variants]]
//! name = "with orientation"
//! ```
use crate::settings::Settings;
use manifactor_config::{Diagnostic, Diagnostics, Document, Errors, Node, Place, Section, Value, merge};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A run: one set of settings, or several to compare.
#[derive(Debug, Clone, Serialize)]
pub struct RunDocument {
    /// What it is called in reports.
    pub title: String,
    /// Where its results go. Default: `out/` and the document's name.
    pub output: PathBuf,
    /// At least one; with the settings that they have in common.
    pub variants: Vec<Variant>,
    /// The folder from which its files are named.
    #[serde(skip)]
    pub folder: PathBuf,
}

/// One way to do a run.
#[derive(Debug, Clone, Serialize)]
pub struct Variant {
    /// Its name, one of its own.
    pub name: String,
    /// What it does, in a sentence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub about: Option<String>,
    /// Its settings, complete.
    pub settings: Settings,
}

/// What a run without variants is called.
const ONLY: &str = "estimate";

impl RunDocument {
    /// Reads a run. Files are found from the folder of the document, or from the one that it names as `folder`.
    ///
    /// # Errors
    /// Everything that is wrong with it, in all variants, each at its place.
    pub fn read(document: &Document) -> Result<Self, Diagnostics> {
        let name = Path::new(document.source().name());
        let stem = name.file_stem().map_or_else(|| "run".into(), |s| s.to_string_lossy().into_owned());
        let errors = Errors::new();
        let run = document.section(&errors).and_then(|mut section| {
            let title = section.or_default::<Option<String>>("title").unwrap_or_else(|| stem.clone());
            let output = section.optional("output").unwrap_or_else(|| Path::new("out").join(&stem));
            let folder = folder(document, &errors);
            let declared = Declared::all(document, &errors);
            let base = common(document.root());
            let variants = read_variants(declared, &base, &folder, &errors);
            // what the settings have read, in each variant, is not unknown here
            section.ignore_rest();
            Some(Self { title, output, variants: variants?, folder })
        });
        errors.finish(run)
    }
}

/// A variant, as it is written.
pub(crate) struct Declared {
    pub(crate) name: String,
    /// What it does, in a sentence.
    pub(crate) about: Option<String>,
    /// Where the name is.
    pub(crate) place: Place,
    /// What it puts over the settings that all variants have in common.
    pub(crate) set: Option<Node>,
}

impl Declared {
    /// All variants of a run's document. Two of one name are reported.
    pub(crate) fn all(document: &Document, errors: &Errors) -> Vec<Self> {
        let Some(mut section) = document.section(errors) else { return vec![] };
        let declared: Vec<_> = section.items("variants").into_iter().filter_map(Self::read).collect();
        section.ignore_rest();
        twice(&declared, errors);
        declared
    }

    /// A name, and what it sets.
    pub(crate) fn read(mut section: Section<'_>) -> Option<Self> {
        let name = section.required::<String>("name");
        let place = section.place_of("name");
        let about = section.optional("about");
        let set = section.take("set");
        section.finish();
        Some(Self { name: name?, about, place, set })
    }
}

fn twice(declared: &[Declared], errors: &Errors) {
    for (i, second) in declared.iter().enumerate() {
        let earlier = declared.get(..i).unwrap_or_default();
        // their folders would be one
        if let Some(first) = earlier.iter().find(|first| slug(&first.name) == slug(&second.name)) {
            let place = first.place.clone();
            errors.push(Diagnostic::duplicate("variant", &second.name, second.place.clone(), place));
        }
    }
}

/// The folder from which a run's files are named: what it says, from where it lies.
pub(crate) fn folder(document: &Document, errors: &Errors) -> PathBuf {
    let beside = Path::new(document.source().name()).parent().unwrap_or(Path::new(""));
    let named = document.section(errors).and_then(|mut section| {
        let named = section.optional::<PathBuf>("folder");
        section.ignore_rest();
        named
    });
    named.map_or_else(|| beside.to_owned(), |named| beside.join(named))
}

/// The same folder, wherever a program is run; unchanged if the current folder is unknown.
pub(crate) fn absolute(folder: &Path) -> PathBuf {
    std::env::current_dir().map_or_else(|_| folder.to_owned(), |at| at.join(folder).components().collect())
}

/// The document without what is no setting.
pub(crate) fn common(root: &Node) -> Node {
    let mut base = root.clone();
    if let Value::Table(table) = &mut base.value {
        for field in ["title", "output", "folder", "variants"] {
            table.shift_remove(field);
        }
    }
    base
}

fn read_variants(
    declared: Vec<Declared>,
    base: &Node,
    folder: &Path,
    errors: &Errors,
) -> Option<Vec<Variant>> {
    let read = |name: String, about: Option<String>, node: Node| match Settings::read(node, folder) {
        Ok(settings) => Some(Variant { name, about, settings }),
        Err(diagnostics) => {
            errors.extend(diagnostics);
            None
        }
    };
    if declared.is_empty() {
        return Some(vec![read(ONLY.to_owned(), None, base.clone())?]);
    }
    // all of them are read, so that all errors are told at once
    let variants = declared.into_iter().map(|variant| {
        let mut node = base.clone();
        if let Some(set) = variant.set {
            merge(&mut node, set);
        }
        read(variant.name, variant.about, node)
    });
    let variants: Vec<Option<Variant>> = variants.collect();
    variants.into_iter().collect()
}

/// A name as part of a path: letters, digits and hyphens.
pub fn slug(name: &str) -> String {
    let plain: String =
        name.chars().map(|c| if c.is_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect();
    let parts: Vec<&str> = plain.split('-').filter(|part| !part.is_empty()).collect();
    if parts.is_empty() { ONLY.to_owned() } else { parts.join("-") }
}
