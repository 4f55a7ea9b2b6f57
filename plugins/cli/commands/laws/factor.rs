//! `manifactor check-factor`: checks whether a factor keeps its laws before a solver uses it.
use super::linked;
use crate::failure::Failure;
use crate::input::choice::named;
use crate::input::{document, kind};
use crate::output;
use crate::status::Status;
use clap::Args;
use manifactor::config::{Document, Errors, Format, read_graph};
use manifactor::graph::Factor;
use manifactor::testing::{FactorCheck, Subject};
use serde_json::json;
use std::path::PathBuf;

/// Check a factor: its Jacobian against finite differences, its free directions, its kinks and its declared
/// properties.
///
/// The points are random: around the example in the docs or around the values of a graph, from the sampling
/// strategies of the manifolds, and at and near their singular points. For a broken law, the worst entry is
/// shown with its variable and direction, at the simplest point that was found, as a graph that --config
/// accepts. With --json, the points of the worst entry and of the kinks are included for a sound factor
/// too. The exit code is 1 if a law is broken.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  manifactor check-factor bounding_box\n  manifactor check-factor --config examples/03_relations/graph.toml"
)]
pub(crate) struct CheckFactor {
    /// The factor, one of `manifactor list factors`. Default with --config: all factors of the graph.
    #[arg(required_unless_present = "config")]
    name: Option<String>,
    /// A literal graph whose factors are checked, with their parameters, around its values.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// The parameters of the factor, such as '{ "up": [0, 0, 1] }'. Default: those of the example in its
    /// docs.
    #[arg(long, value_name = "JSON", conflicts_with = "config")]
    parameters: Option<String>,
    /// Number of random points.
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    points: u32,
    /// Seed of the random numbers; the same seed gives the same points.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Print JSON: all results.
    #[arg(long)]
    pub(crate) json: bool,
}

impl CheckFactor {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let subjects = match (&self.config, &self.name) {
            (Some(path), name) => in_graph(path, name.as_deref())?,
            (None, name) => vec![self.alone(name.as_deref().unwrap_or_default())?],
        };
        let check = FactorCheck { points: self.points as usize, seed: self.seed, ..FactorCheck::default() };
        let reports: Vec<_> = subjects.iter().map(|subject| check.run(subject)).collect();
        let holds = reports.iter().all(|report| report.holds());
        if self.json {
            output::print_json(&json!({ "holds": holds, "factors": reports }));
        } else {
            let texts: Vec<_> = reports.iter().map(|r| r.to_string().trim_end().to_owned()).collect();
            output::print(&(texts.join("\n\n") + "\n"));
        }
        Ok(if holds { Status::Done } else { Status::Broken })
    }

    /// Returns the factor `name`, with the parameters of the command line or of its docs.
    fn alone(&self, name: &str) -> Result<Subject, Failure> {
        let entry = linked("factor", name, "register_factor!(…)")?;
        let Some(text) = &self.parameters else { return Subject::example(entry).map_err(Failure::input) };
        let document = Document::parse("--parameters", text.as_str(), Format::Json)?;
        let errors = Errors::new();
        let root = document.root().clone();
        let factor = named("factor", name, root, document.source()).read::<Box<dyn Factor>>(&errors);
        let factor = errors.finish(factor)?;
        Subject::around_examples(entry, factor.into()).map_err(Failure::input)
    }
}

/// Returns the distinct factors of a graph, around the graph's values.
fn in_graph(path: &std::path::Path, name: Option<&str>) -> Result<Vec<Subject>, Failure> {
    let document = document::open(path, kind::LITERAL_GRAPH)?;
    let (graph, values) = read_graph(&document)?;
    let mut subjects: Vec<Subject> = vec![];
    for entry in graph.factors() {
        let other = name.is_some_and(|name| entry.factor.typetag_name() != name);
        let as_json = |factor: &dyn Factor| serde_json::to_string(factor).unwrap_or_default();
        if other || subjects.iter().any(|s| as_json(&*s.factor) == as_json(&*entry.factor)) {
            continue;
        }
        let around = entry.keys.iter().filter_map(|key| values.find(key.as_str()));
        subjects.push(Subject {
            factor: entry.factor.clone(),
            keys: entry.keys.iter().map(ToString::to_string).collect(),
            around: around.map(|(_, x)| x.erased().clone_box()).collect(),
        });
    }
    if subjects.is_empty() {
        let what = name.map_or_else(
            || "the graph has no factors".to_owned(),
            |name| format!("the graph has no factor of type `{name}`"),
        );
        return Err(Failure::input(format!("{}: {what}", path.display())));
    }
    Ok(subjects)
}
