//! `manifactor check`: checks a document without solving anything.
use crate::failure::Failure;
use crate::input::document::Content;
use crate::input::graph_file::{self, GraphFile, Reading};
use crate::input::kind::{self, InputKind};
use crate::input::run_file::RunArguments;
use crate::input::solver::SolverArguments;
use crate::output;
use crate::output::report;
use crate::output::text::{count, list};
use crate::status::Status;
use clap::Args;
use manifactor::config::Document;
use manifactor::graph::{Graph, Key, Values};
use manifactor::quadric::DualQuadric;
use manifactor::slam::experiment::Experiment;
use manifactor::slam::run::{MappedSequence, Run as Running};
use manifactor::slam::source::SourceError;
use manifactor::solve::{Problem, Silent};
use serde_json::json;

/// Semi-axis above which an object is probably given in millimetres. Unit: metres.
const LARGE: f64 = 30.0;

/// Check a run, an experiment or a graph without solving it, and report every error with its line.
///
/// For a graph, and with --load for a run, the initial values are checked too: undefined or non-finite
/// factors, variables without factors, unconstrained or hardly constrained directions, and values with a
/// suspicious unit.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor check examples/desk/desk.toml --load")]
pub(crate) struct Check {
    #[command(flatten)]
    run: RunArguments,
    /// Also load the data of a run and build its graphs.
    #[arg(long)]
    load: bool,
    #[command(flatten)]
    reading: Reading,
    /// Print JSON: the errors and warnings.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Contents of a document, and warnings about it.
#[derive(Default)]
struct CheckReport {
    lines: Vec<String>,
    warnings: Vec<String>,
    /// Whether a factor is not finite at the initial values.
    is_broken: bool,
}

impl Check {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let path = &self.run.config;
        let solver = SolverArguments::set_only(&self.run.set);
        let found = match Content::open(path, kind::CHECKED)? {
            Content::Graph { text, file, format } => {
                graph(&self.reading.plain(&file, &text, format, &solver)?)?
            }
            Content::Document(document) => match InputKind::of_document(&document) {
                Some(InputKind::Graph) => graph(&graph_file::literal(document, &solver)?)?,
                Some(InputKind::Experiment) => self.experiment(document)?,
                _ => self.document(document)?,
            },
        };
        let CheckReport { lines, warnings, is_broken } = &found;
        let lines = lines.join("\n");
        if self.json {
            output::print_json(&json!({ "errors": [], "warnings": warnings, "found": lines }));
        } else {
            warnings.iter().for_each(|warning| output::print_message(&format!("warning: {warning}")));
            let verdict = match warnings.len() {
                0 => "nothing wrong".to_owned(),
                n => format!("nothing wrong with the document; {}", count(n, "warning")),
            };
            output::print(&format!("{}: {verdict}.\n{lines}\n", path.display()));
        }
        Ok(if *is_broken { Status::Broken } else { Status::Done })
    }

    /// Reads the settings of every trial; --load has no effect.
    fn experiment(&self, mut document: Document) -> Result<CheckReport, Failure> {
        document.set(&self.run.set)?;
        let sweep = Experiment::read(&document)?;
        let (trials, columns) = (count(sweep.trials.len(), "trial"), sweep.columns.join(", "));
        Ok(CheckReport {
            lines: vec![format!("An experiment of {trials}, with the columns {columns}.")],
            ..CheckReport::default()
        })
    }

    fn document(&self, document: Document) -> Result<CheckReport, Failure> {
        let document = self.run.read(document)?;
        let mut found = CheckReport::default();
        found.lines.push(format!("A run of {}.", count(document.variants.len(), "variant")));
        let mut run = Running::new(&document, self.run.data());
        for variant in &document.variants {
            match run.find_files(variant) {
                Ok(_) => {}
                // a document about a public data set is correct without the data
                Err(SourceError::NoFolder { setting, name, no_data_folder: true, .. })
                    if name.is_relative() && !self.load =>
                {
                    let name = name.display();
                    let warning = format!(
                        "the files of the source are not checked: `{setting}` names `{name}`, which is not beside the document; give the folder of the data sets with --data"
                    );
                    if !found.warnings.contains(&warning) {
                        found.warnings.push(warning);
                    }
                }
                Err(error) => return Err(error.into()),
            }
        }
        for variant in document.variants.iter().filter(|_| self.load) {
            let mapped = MappedSequence::new(run.sequence(variant)?, &variant.settings, &mut Silent)?;
            let MappedSequence { sequence, mapping, .. } = mapped;
            let mut of_this = CheckReport::default();
            of_this.warnings.extend(mapping.warnings.iter().map(ToString::to_string));
            of_this.check_graph(&mapping.graph, &mapping.values)?;
            found.is_broken |= of_this.is_broken;
            let named = of_this.warnings.iter().map(|warning| format!("{}: {warning}", variant.name));
            found.warnings.extend(named);
            found.lines.push(format!(
                "{}: {}, {}, {}, {} ({} in the map), {}",
                variant.name,
                count(sequence.frames.len(), "frame"),
                count(sequence.detections.len(), "detection"),
                count(mapping.values.len(), "variable"),
                count(mapping.objects.len(), "object"),
                mapping.mapped().count(),
                count(mapping.graph.factors().len(), "factor"),
            ));
        }
        Ok(found)
    }
}

impl CheckReport {
    /// Checks a graph at the values from which a solve would begin.
    fn check_graph(&mut self, graph: &Graph, values: &Values) -> Result<(), Failure> {
        let huge = |(key, value): (&Key, &dyn manifactor::graph::Variable)| {
            let quadric = value.erased().as_any().downcast_ref::<DualQuadric>()?;
            (quadric.semi_axes.max() > LARGE).then(|| key.to_string())
        };
        let huge: Vec<String> = values.iter().filter_map(huge).collect();
        if !huge.is_empty() {
            let keys = list(huge.iter());
            self.warnings.push(format!(
                "objects longer than {} m: {keys}; the unit of semi-axes is metres; are these millimetres?",
                2.0 * LARGE
            ));
        }
        if graph.factors().is_empty() || values.is_empty() {
            return Ok(());
        }
        let mut problem = Problem::compile(graph, values).map_err(Failure::input)?;
        let at_start = problem.diagnose_start();
        self.is_broken |= at_start.not_finite.is_some();
        self.warnings.extend(report::at_start(&at_start, graph.factors().len()));
        if at_start.not_finite.is_none() {
            self.lines.push(format!("cost {:.6} at the initial values", at_start.cost));
        }
        Ok(())
    }
}

/// Returns the contents of a graph, and prints the decisions of the reader on stderr.
fn graph(input: &GraphFile) -> Result<CheckReport, Failure> {
    for note in &input.notes {
        output::print_note(note);
    }
    let mut found = CheckReport::default();
    found.lines.push(graph_file::summary(input).trim_end().to_owned());
    found.check_graph(&input.graph, &input.values)?;
    Ok(found)
}
