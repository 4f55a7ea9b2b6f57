//! Pose graphs from g2o and TORO files.
//!
//! Poses get the keys `x<id>`, landmarks `l<id>`. Edges become `between_se2`, `between_se3` and landmark
//! factors with the file's information as noise. The reader completes the following and reports it:
//! - vertices without a line get initial values along a spanning tree of the edges, of the kind in
//!   [`PoseGraphOptions::tree`];
//! - an `EQUIV a b` line declares that two poses are one place, as far as the edge between them says so (TORO
//!   merges the two by that edge). The edge is already in the graph, so no factor is added. Without an edge,
//!   a relative pose of zero with [`PoseGraphOptions::equivalence_sigma`] connects the two;
//! - in each connected part without a `FIX` line, the first pose is held, unless [`PoseGraphOptions::anchor`]
//!   is false.
use crate::error::{FormatError, Mistake, ProblemList};
use crate::graph_format::{GraphFormat, GraphRead, GraphText, ReadOptions};
use crate::lines::lines;
use crate::text::read_text;
use crate::words::{count, list};
use manifactor_geometry::Tree;
use manifactor_graph::checked::Positive;
use manifactor_graph::{Graph, Key, Values};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

#[allow(clippy::indexing_slicing, reason = "by places that it has made itself")]
pub(crate) mod anchor;
mod build;
pub mod g2o;
mod information;
pub(crate) mod record;
mod toro;

pub use crate::graph_format::InformationRepair;
use record::Record;

crate::register_graph_format!(GraphFormat {
    name: "g2o",
    extensions: &["g2o", "toro", "graph"],
    folder: None,
    begins: |text| lines(text).next().is_some_and(|(_, line)| parser(tag_of(line).0).is_some()),
    parse: |text, path, reading| {
        let ReadOptions { repair, anchor, lenient } = reading;
        let options = PoseGraphOptions { repair, anchor, lenient, ..PoseGraphOptions::default() };
        let PoseGraph { graph, values, report } = parse(text, path, &options)?;
        Ok(GraphRead { graph, values, notes: report.notes() })
    },
    format: Some(|graph, values, _| {
        let (text, omitted) = g2o::format(graph, values);
        Ok(GraphText::file(text, omitted.notes()))
    }),
});

/// A graph from a file, with initial values for all its variables.
#[derive(Debug, Clone, Default)]
pub struct PoseGraph {
    /// Edges as factors, and held variables.
    pub graph: Graph,
    /// Vertices in file order, then vertices that occur only in edges, sorted by number.
    pub values: Values,
    /// Assumptions that the reader made.
    pub report: PoseGraphReport,
}

/// Options for cases that a file leaves open.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Options")]
pub struct PoseGraphOptions {
    /// Treatment of information matrices that are not positive definite.
    pub repair: InformationRepair,
    /// Hold the first pose of each connected part that is not held otherwise.
    pub anchor: bool,
    /// Skip lines with unknown tags. Otherwise they are an error, because the graph would be incomplete.
    pub lenient: bool,
    /// Kind of spanning tree for the initial values of vertices that occur only in edges.
    pub tree: Tree,
    /// Standard deviation of an `EQUIV` without an edge, in metres and radians.
    pub equivalence_sigma: Positive,
}

impl Default for PoseGraphOptions {
    fn default() -> Self {
        Self {
            repair: InformationRepair::Error,
            anchor: true,
            lenient: false,
            tree: Tree::Chain,
            equivalence_sigma: Positive::literal(1e-3),
        }
    }
}

/// Assumptions and repairs that the reader made.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct PoseGraphReport {
    /// Number of vertex lines.
    pub vertices: usize,
    /// Number of edge lines, including omitted edges.
    pub edges: usize,
    /// Variables that occur only in edges; their initial values come from a spanning tree.
    pub filled: Vec<Key>,
    /// Variables that the reader holds, as the file does not fix the gauge.
    pub anchored: Vec<Key>,
    /// Unknown tags with their number of lines. These lines are omitted.
    pub unknown: BTreeMap<String, usize>,
    /// Lines of edges omitted by [`InformationRepair`].
    pub rejected: Vec<usize>,
    /// Lines of edges whose information was changed by [`InformationRepair::Clamp`].
    pub clamped: Vec<usize>,
    /// Number of `EQUIV` lines whose two poses have an edge between them.
    pub equivalences_by_edge: usize,
    /// Number of `EQUIV` lines for which a factor was added.
    pub equivalences_added: usize,
    /// Notes about signs of different units or a different order of numbers.
    pub doubts: Vec<String>,
}

impl PoseGraphReport {
    /// Returns the assumptions and repairs as text.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        for (tag, n) in self.unknown.iter().take(SHOWN_TAGS) {
            notes.push(format!("unknown tag {}: {} left out", shorten_tag(tag), count(*n, "line")));
        }
        if self.unknown.len() > SHOWN_TAGS {
            let rest: usize = self.unknown.values().skip(SHOWN_TAGS).sum();
            let tags = count(self.unknown.len() - SHOWN_TAGS, "more unknown tag");
            notes.push(format!("{tags}: {} left out", count(rest, "line")));
        }
        if !self.filled.is_empty() {
            let filled = count(self.filled.len(), "variable");
            notes.push(format!(
                "{filled} have no vertex line; their values come from a spanning tree of the edges"
            ));
        }
        if !self.anchored.is_empty() {
            let held = list(self.anchored.iter());
            notes.push(format!("nothing fixes the gauge: held {held} (--no-anchor does not)"));
        }
        if !self.rejected.is_empty() {
            let lines = list(self.rejected.iter());
            notes.push(format!(
                "edges left out, as their information is not positive definite: lines {lines}"
            ));
        }
        if !self.clamped.is_empty() {
            notes.push(format!("information made positive definite: lines {}", list(self.clamped.iter())));
        }
        if self.equivalences_added > 0 {
            let lines = count(self.equivalences_added, "EQUIV line");
            notes.push(format!("{lines} without an edge: tied by a factor"));
        }
        notes.extend(self.doubts.iter().cloned());
        notes
    }
}

/// Maximum number of unknown tags in a message.
const SHOWN_TAGS: usize = 10;

/// Returns a tag in backquotes, shortened for messages.
fn shorten_tag(tag: &str) -> String {
    const MAX_TAG_CHARS: usize = 40;
    let start: String = tag.chars().take(MAX_TAG_CHARS).collect();
    if start.len() < tag.len() { format!("`{start}…`") } else { format!("`{tag}`") }
}

/// Splits a line into its tag and the remaining fields.
fn tag_of(line: &str) -> (&str, &str) {
    line.split_once(char::is_whitespace).unwrap_or((line, ""))
}

/// Returns the parser of lines with this tag.
fn parser(tag: &str) -> Option<record::Parse> {
    g2o::parser(tag).or_else(|| toro::parser(tag))
}

/// Reads a g2o or TORO file.
///
/// # Errors
/// If a line is malformed, or if a vertex is defined twice, used with a different type or fixed without a
/// definition. If an edge connects a vertex with itself, or if an information matrix is not positive definite
/// and not repaired. If there is no vertex or edge, or if there are unknown tags without
/// [`PoseGraphOptions::lenient`]. The error lists all mistakes.
pub fn read(path: impl AsRef<Path>, options: &PoseGraphOptions) -> Result<PoseGraph, FormatError> {
    let path = path.as_ref();
    parse(&read_text(path)?, path, options)
}

/// Works like [`read`], for a given text; `path` is used only in errors.
///
/// # Errors
/// As [`read`].
pub fn parse(
    text: &str,
    path: impl AsRef<Path>,
    options: &PoseGraphOptions,
) -> Result<PoseGraph, FormatError> {
    let mut problems = ProblemList::of(path.as_ref(), text);
    let mut unknown = BTreeMap::<String, usize>::new();
    let (mut records, mut first_unknown): (Vec<(usize, Record)>, Option<usize>) = (vec![], None);
    for (line, text) in lines(text) {
        let (tag, fields) = tag_of(text);
        match parser(tag) {
            Some(parse) => {
                let record = problems.ok(line, parse(fields.trim_start()));
                records.extend(record.map(|record| (line, record)));
            }
            None => {
                first_unknown.get_or_insert(line);
                *unknown.entry(tag.to_owned()).or_default() += 1;
            }
        }
    }
    if records.is_empty() && problems.is_empty() {
        let unknown = unknown.keys().take(SHOWN_TAGS).map(|tag| shorten_tag(tag)).collect();
        problems.push(0, Mistake::Empty { expected: "vertices or edges of a g2o or TORO file", unknown });
    }
    if !options.lenient && !records.is_empty() && !unknown.is_empty() {
        let tags = unknown.keys().take(SHOWN_TAGS).map(|tag| shorten_tag(tag)).collect();
        problems.push(
            first_unknown.unwrap_or_default(),
            Mistake::UnknownTags { lines: unknown.values().sum(), tags },
        );
    }
    let built = build::build(&records, options, &mut problems);
    problems.finish()?;
    let mut built = built.unwrap_or_default();
    built.report.unknown = unknown;
    let PoseGraphReport { vertices, edges, filled, rejected, clamped, .. } = &built.report;
    let (filled, rejected, clamped) = (filled.len(), rejected.len(), clamped.len());
    tracing::info!(vertices, edges, filled, rejected, clamped, "pose graph");
    Ok(built)
}
