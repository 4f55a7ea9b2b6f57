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
use crate::settings::RunSettings;
use manifactor_config::{Diagnostic, Diagnostics, Document, Errors, Fault, Node, Placed, Section, merge};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Map;
use std::path::{Path, PathBuf};

/// A run: one set of settings, or several variants to compare.
#[derive(Debug, Clone, Serialize)]
pub struct RunDocument {
    /// Title in reports.
    pub title: String,
    /// Folder of the results. Default: `out/` followed by the document's name.
    pub output: PathBuf,
    /// At least one variant. Each includes the settings that all variants share.
    pub variants: Vec<RunVariant>,
    /// Folder that the run's paths are relative to.
    #[serde(skip)]
    pub folder: PathBuf,
}

/// One variant of a run.
#[derive(Debug, Clone, Serialize)]
pub struct RunVariant {
    /// Unique name.
    pub name: String,
    /// Description in one sentence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub about: Option<String>,
    /// Complete settings.
    pub settings: RunSettings,
}

/// Name of the only variant of a document that lists none.
const ONLY_VARIANT: &str = "estimate";

impl RunDocument {
    /// Reads a run. Paths are relative to the folder of the document, or to the document's `folder`.
    ///
    /// # Errors
    /// All errors of all variants, each with its position in the document.
    pub fn read(document: &Document) -> Result<Self, Diagnostics> {
        let stem = document_stem(document, "run");
        let errors = Errors::new();
        let run = split_document(document.root(), &errors).and_then(|(header, settings)| {
            let folder = header.folder(document);
            let variants = read_variants(header.variants, &settings, &folder, &errors)?;
            let title = header.title.unwrap_or_else(|| stem.clone());
            let output = header.output.unwrap_or_else(|| Path::new("out").join(&stem));
            Some(Self { title, output, variants, folder })
        });
        errors.finish(run)
    }
}

/// Returns the name of a document without its extension.
pub fn document_stem(document: &Document, otherwise: &str) -> String {
    let stem = Path::new(document.source().name()).file_stem();
    stem.map_or_else(|| otherwise.to_owned(), |stem| stem.to_string_lossy().into_owned())
}

/// Fields of a run document besides the settings.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Header")]
pub struct RunHeader {
    /// Title in reports. Default: the document's name.
    title: Option<String>,
    /// Folder of the results. Default: `out/` followed by the document's name.
    output: Option<PathBuf>,
    /// Folder that the document's paths are relative to. Default: the folder of the document.
    folder: Option<PathBuf>,
    /// Variants of the run, which are compared.
    pub variants: Vec<DeclaredVariant>,
}

impl RunHeader {
    const FIELDS: [&str; 4] = ["title", "output", "folder", "variants"];

    /// Returns the folder that the run's paths are relative to. `folder` itself is relative to the document.
    pub fn folder(&self, document: &Document) -> PathBuf {
        let beside = Path::new(document.source().name()).parent().unwrap_or(Path::new(""));
        self.folder.as_ref().map_or_else(|| beside.to_owned(), |named| beside.join(named))
    }
}

/// A variant as the document declares it.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Declared")]
pub struct DeclaredVariant {
    /// Unique name.
    #[schemars(with = "String")]
    pub name: Placed<String>,
    /// Description in one sentence, repeated in reports.
    pub about: Option<String>,
    /// Settings that replace those of the document.
    #[schemars(with = "Option<Map<String, serde_json::Value>>")]
    pub set: Option<Node>,
}

/// Splits the document of a run into its header and the unread settings. Errors in the header are reported,
/// and the default header is used.
pub fn split_document(root: &Node, errors: &Errors) -> Option<(RunHeader, Node)> {
    Section::new(root, errors)?.ignore_rest();
    let (mut header, mut settings) = (root.clone(), root.clone());
    header.retain(|field| RunHeader::FIELDS.contains(&field));
    settings.retain(|field| !RunHeader::FIELDS.contains(&field));
    let header = header.read::<RunHeader>(errors).unwrap_or_default();
    for (i, second) in header.variants.iter().enumerate() {
        if slug(&second.name).len() > MAX_SLUG_BYTES {
            let long = format!("names a folder, and is longer than {MAX_SLUG_BYTES} letters");
            errors.report(second.name.place.clone(), Fault::invalid(long));
        }
        let mut earlier = header.variants.iter().take(i);
        // both would write to one folder
        if let Some(first) = earlier.find(|first| slug(&first.name) == slug(&second.name)) {
            let (first, second) = (&first.name, &second.name);
            errors.push(Diagnostic::duplicate("variant", second, second.place.clone(), first.place.clone()));
        }
    }
    Some((header, settings))
}

/// Returns the absolute path of a folder, or the path unchanged if the current folder is unknown.
pub fn absolute_path(folder: &Path) -> PathBuf {
    std::env::current_dir().map_or_else(|_| folder.to_owned(), |at| at.join(folder).components().collect())
}

fn read_variants(
    declared: Vec<DeclaredVariant>,
    base: &Node,
    folder: &Path,
    errors: &Errors,
) -> Option<Vec<RunVariant>> {
    let read = |name: String, about: Option<String>, node: &Node| match RunSettings::read(node, folder) {
        Ok(settings) => Some(RunVariant { name, about, settings }),
        Err(diagnostics) => {
            errors.extend(diagnostics);
            None
        }
    };
    if declared.is_empty() {
        return Some(vec![read(ONLY_VARIANT.to_owned(), None, base)?]);
    }
    // reads all variants, so that all errors are reported at once
    let variants = declared.into_iter().map(|variant| {
        let mut node = base.clone();
        if let Some(set) = variant.set {
            merge(&mut node, set);
        }
        read(variant.name.value, variant.about, &node)
    });
    let variants: Vec<Option<RunVariant>> = variants.collect();
    variants.into_iter().collect()
}

/// Longest name of a variant's folder, in bytes. File systems accept it, with room for the names of files
/// beside it.
const MAX_SLUG_BYTES: usize = 200;

/// Converts a name to a part of a path: letters, digits and hyphens.
pub fn slug(name: &str) -> String {
    let plain: String =
        name.chars().map(|c| if c.is_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect();
    let parts: Vec<&str> = plain.split('-').filter(|part| !part.is_empty()).collect();
    if parts.is_empty() { ONLY_VARIANT.to_owned() } else { parts.join("-") }
}
