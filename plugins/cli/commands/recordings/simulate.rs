//! `manifactor simulate`: writes a sequence as files.
use crate::failure::Failure;
use crate::input::run_file::RunArguments;
use crate::output;
use crate::output::text::count;
use crate::status::Status;
use clap::Args;
use manifactor::config::{Diagnostic, Fault, SourceText};
use manifactor::slam::output::OutputFolder;
use manifactor::slam::recording;
use manifactor::slam::run::Run as Running;
use manifactor::slam::source::format_line;
use std::path::PathBuf;

/// Write the sequence of a run's source as files for the source `recorded`, or as lines of JSON.
///
/// The files are odometry.txt and groundtruth.txt (TUM format), detections.csv and objects.json.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor simulate examples/desk/desk.toml --out recording")]
pub(crate) struct Simulate {
    #[command(flatten)]
    run: RunArguments,
    /// The folder for the files.
    #[arg(long, short, value_name = "DIR", required_unless_present = "lines")]
    out: Option<PathBuf>,
    /// Print the frames as lines of JSON instead, for the source `json_lines`.
    #[arg(long, conflicts_with_all = ["out", "force"])]
    lines: bool,
    /// Write into a folder that holds other files, and overwrite files with the same names.
    #[arg(long)]
    force: bool,
}

impl Simulate {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let document = self.run.open()?;
        let Some(variant) = document.variants.first() else {
            let source = SourceText::new(self.run.config.display().to_string(), "");
            let problem = Fault::invalid("there is no variant to simulate");
            return Err(Failure::Documents(Diagnostic::new(source.place(0..0), problem).into()));
        };
        let sequence = || Running::new(&document, self.run.data()).sequence(variant);
        let Some(out) = &self.out else {
            sequence()?.observations().for_each(|frame| output::print(&(format_line(&frame) + "\n")));
            return Ok(Status::Done);
        };
        // the claim lasts to the end
        let _claimed = OutputFolder::claim(out, "simulate", &self.run.config, self.force)?;
        let sequence = sequence()?;
        recording::write(&sequence, out)?;
        let objects = sequence.ground_truth.as_ref().map_or(0, |truth| truth.objects.len());
        output::print(&format!(
            "{}, {}, {} written to {}\n",
            count(sequence.frames.len(), "frame"),
            count(sequence.detections.len(), "detection"),
            count(objects, "true object"),
            out.display()
        ));
        Ok(Status::Done)
    }
}
