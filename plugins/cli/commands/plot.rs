//! `manifactor plot`: draws the pictures of a graph, or those of a run again.
use crate::failure::Failure;
use crate::input::graph_file::{self, Reading};
use crate::input::kind;
use crate::input::pictures::PictureStyle;
use crate::input::solver::SolverArguments;
use crate::interrupt;
use crate::output::text::count;
use crate::output::watch::Watch;
use crate::output::{self, report};
use crate::status::Status;
use clap::Args;
use manifactor::slam::output::{OutputFolder, write_whole};
use manifactor::slam::record::{RecordError, RunRecord};
use manifactor::solve::{AllObservers, solve};
use manifactor::viz::{GraphScene, ply};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Draw a graph before and after its solve, or the pictures of a run again with another size or theme.
///
/// A graph is solved and drawn from above, and from the side unless it is planar: variables as points, factors as lines,
/// names if there are at most 50 variables. The pictures of a run are drawn from the record.json in its folder, without
/// a solve; they replace those of the run, or go to --out.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  manifactor plot examples/python/helix.g2o --out out/helix\n  manifactor run examples/desk/desk.toml --out out/desk\n  manifactor plot out/desk --theme dark"
)]
pub(crate) struct Plot {
    /// A graph, or the folder of a run, which holds record.json.
    #[arg(value_name = "GRAPH|FOLDER")]
    input: PathBuf,
    #[command(flatten)]
    style: PictureStyle,
    /// The folder for the pictures. Default for a run: its own folder.
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into --out even if it holds other files.
    #[arg(long, requires = "out")]
    force: bool,
    #[command(flatten)]
    solver: SolverArguments,
    #[command(flatten)]
    reading: Reading,
}

impl Plot {
    pub(crate) fn run(&self, verbose: u8) -> Result<Status, Failure> {
        // a name with an extension is that of a file, also of a missing one
        let is_graph = !self.input.is_dir() && self.input.extension().is_some();
        if is_graph { self.draw_graph(verbose) } else { self.draw_run(verbose) }
    }

    fn claim(&self, out: &Path) -> Result<OutputFolder, Failure> {
        Ok(OutputFolder::claim(out, "plot", &self.input, self.force)?)
    }

    fn draw_graph(&self, verbose: u8) -> Result<Status, Failure> {
        let input = self.reading.open(&self.input, &self.solver)?;
        let Some(out) = &self.out else {
            let help = format!("name a folder: manifactor plot {} --out out/graph", self.input.display());
            return Err(Failure::with_help("the pictures of a graph need --out", help));
        };
        for note in &input.notes {
            output::print_note(note);
        }
        let _claimed = self.claim(out)?;
        let mut watch = Watch::new(verbose, "solving");
        let mut interrupt = interrupt::on_ctrl_c();
        let start = input.start.initial_values(&input.graph, &input.values).map_err(Failure::input)?;
        let mut observer = AllObservers(vec![&mut watch, &mut interrupt]);
        let solution =
            solve(&input.graph, &start, &*input.optimizer, &mut observer).map_err(Failure::input)?;
        let scene = GraphScene::new(graph_file::title(&self.input), &input.graph, &start, &solution);
        let pictures = scene.pictures(self.style.width());
        self.style.write(out, &pictures, |file| {
            watch.show(&format!("drawing {file}"));
            ControlFlow::Continue(())
        })?;
        drop(watch);
        output::print(&report::outcome(&solution.outcome, false));
        output::print(&format!("{} written to {}.\n", count(2 * pictures.len(), "picture"), out.display()));
        Ok(Status::from(&solution.outcome.termination))
    }

    fn draw_run(&self, verbose: u8) -> Result<Status, Failure> {
        let mut interrupt = interrupt::on_ctrl_c();
        kind::RUN_FOLDER.check_folder(&self.input)?;
        let record = RunRecord::read(&self.input)?;
        let out = self.out.as_ref().unwrap_or(&self.input);
        // the pictures of the run may be replaced; another folder has to be claimed
        let _claimed = self.out.as_deref().map(|out| self.claim(out)).transpose()?;
        for variant in &record.variants {
            write_whole(&out.join(&variant.folder).join("map.ply"), ply(&record, variant))?;
        }
        let mut watch = Watch::new(verbose, &record.title);
        let drawn = self.style.draw_run(out, &record, &mut watch, &mut interrupt)?;
        drop(watch);
        if let Some(missing) = drawn.message(&self.input) {
            output::print_message(&missing);
            return Ok(Status::Interrupted);
        }
        output::print(&format!("{} written to {}.\n", count(drawn.pictures, "picture"), out.display()));
        Ok(Status::Done)
    }
}

impl From<RecordError> for Failure {
    fn from(error: RecordError) -> Self {
        let help = "`manifactor run` writes this file; run it again";
        match error {
            RecordError::Io { path, source } => Self::File { path, source },
            other => Self::with_help(other, help),
        }
    }
}
