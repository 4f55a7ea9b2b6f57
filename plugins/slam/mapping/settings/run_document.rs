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
use manifactor_config::{Diagnostic, Diagnostics, Document, Errors, Fault, Node, Placed, Section, merge};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Map;
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
        let stem = stem(document, "run");
        let errors = Errors::new();
        let run = split(document.root(), &errors).and_then(|(header, settings)| {
            let folder = header.folder(document);
            let variants = read_variants(header.variants, &settings, &folder, &errors)?;
            let title = header.title.unwrap_or_else(|| stem.clone());
            let output = header.output.unwrap_or_else(|| Path::new("out").join(&stem));
            Some(Self { title, output, variants, folder })
        });
        errors.finish(run)
    }
}

/// What a document is called, without its extension.
pub fn stem(document: &Document, otherwise: &str) -> String {
    let stem = Path::new(document.source().name()).file_stem();
    stem.map_or_else(|| otherwise.to_owned(), |stem| stem.to_string_lossy().into_owned())
}

/// What the document of a run says beside the settings.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Header {
    /// What it is called in reports. Default: the document's name.
    title: Option<String>,
    /// Where its results go. Default: `out/` and the document's name.
    output: Option<PathBuf>,
    /// The folder that its paths are relative to. Default: its own.
    folder: Option<PathBuf>,
    /// Ways to do the run, to compare.
    pub variants: Vec<Declared>,
}

impl Header {
    const FIELDS: [&str; 4] = ["title", "output", "folder", "variants"];

    /// The folder from which a run's files are named: what it says, from where it lies.
    pub fn folder(&self, document: &Document) -> PathBuf {
        let beside = Path::new(document.source().name()).parent().unwrap_or(Path::new(""));
        self.folder.as_ref().map_or_else(|| beside.to_owned(), |named| beside.join(named))
    }
}

/// A variant, as it is written.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Declared {
    /// Its name, one of its own.
    #[schemars(with = "String")]
    pub name: Placed<String>,
    /// What it does, in a sentence that reports repeat.
    pub about: Option<String>,
    /// Settings of the document that are others here.
    #[schemars(with = "Option<Map<String, serde_json::Value>>")]
    pub set: Option<Node>,
}

/// The header of a run's document, and its settings as they are written. What is wrong with the header is reported, and it
/// is as if nothing had been said.
pub fn split(root: &Node, errors: &Errors) -> Option<(Header, Node)> {
    Section::new(root, errors)?.ignore_rest();
    let (mut header, mut settings) = (root.clone(), root.clone());
    header.retain(|field| Header::FIELDS.contains(&field));
    settings.retain(|field| !Header::FIELDS.contains(&field));
    let header = header.read::<Header>(errors).unwrap_or_default();
    for (i, second) in header.variants.iter().enumerate() {
        if slug(&second.name).len() > LONGEST {
            let long = format!("names a folder, and is longer than {LONGEST} letters");
            errors.report(second.name.place.clone(), Fault::invalid(long));
        }
        let mut earlier = header.variants.iter().take(i);
        // their folders would be one
        if let Some(first) = earlier.find(|first| slug(&first.name) == slug(&second.name)) {
            let (first, second) = (&first.name, &second.name);
            errors.push(Diagnostic::duplicate("variant", second, second.place.clone(), first.place.clone()));
        }
    }
    Some((header, settings))
}

/// The same folder, wherever a program is run; unchanged if the current folder is unknown.
pub fn absolute(folder: &Path) -> PathBuf {
    std::env::current_dir().map_or_else(|_| folder.to_owned(), |at| at.join(folder).components().collect())
}

fn read_variants(
    declared: Vec<Declared>,
    base: &Node,
    folder: &Path,
    errors: &Errors,
) -> Option<Vec<Variant>> {
    let read = |name: String, about: Option<String>, node: &Node| match Settings::read(node, folder) {
        Ok(settings) => Some(Variant { name, about, settings }),
        Err(diagnostics) => {
            errors.extend(diagnostics);
            None
        }
    };
    if declared.is_empty() {
        return Some(vec![read(ONLY.to_owned(), None, base)?]);
    }
    // all of them are read, so that all errors are told at once
    let variants = declared.into_iter().map(|variant| {
        let mut node = base.clone();
        if let Some(set) = variant.set {
            merge(&mut node, set);
        }
        read(variant.name.value, variant.about, &node)
    });
    let variants: Vec<Option<Variant>> = variants.collect();
    variants.into_iter().collect()
}

/// Bytes of the name of a folder that all file systems take, with room for what is written beside it.
const LONGEST: usize = 200;

/// A name as part of a path: letters, digits and hyphens.
pub fn slug(name: &str) -> String {
    let plain: String =
        name.chars().map(|c| if c.is_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect();
    let parts: Vec<&str> = plain.split('-').filter(|part| !part.is_empty()).collect();
    if parts.is_empty() { ONLY.to_owned() } else { parts.join("-") }
}
