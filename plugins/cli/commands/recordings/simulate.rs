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
use manifactor::slam::sequence::Sequence;
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
        if document.variants.len() > 1 {
            let (first, n) = (&variant.name, document.variants.len());
            output::print_note(&format!("written is the source of the first variant, {first}, of {n}"));
        }
        let sequence = || Running::new(&document, self.run.data()).sequence(variant);
        let Some(out) = &self.out else {
            sequence()?.observations().for_each(|frame| output::print(&(format_line(&frame) + "\n")));
            return Ok(Status::Done);
        };
        // the claim lasts to the end
        let _claimed = OutputFolder::claim(out, "simulate", &self.run.config, self.force)?;
        let sequence = sequence()?;
        recording::write(&sequence, out)?;
        omissions(&sequence).iter().for_each(|omission| output::print_note(omission));
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

/// Returns notes about parts of a sequence that the files do not hold.
fn omissions(sequence: &Sequence) -> Vec<String> {
    let steps = sequence.frames.iter().filter(|frame| frame.odometry_noise.is_some()).count();
    let parts = [
        (sequence.pose_factors.len(), "factor on poses", "`--lines` keeps them"),
        (sequence.accelerometer.len(), "reading of the accelerometer", "`--lines` keeps them"),
        (steps, "step of the odometry with its own noise", "`--lines` keeps them"),
        (usize::from(sequence.up.is_some()), "up direction", "write `up` in the source of the new document"),
        (
            usize::from(sequence.georeference.is_some()),
            "place on the Earth",
            "positions are those in the local frame",
        ),
    ];
    let parts = parts.into_iter().filter(|(n, ..)| *n > 0);
    parts.map(|(n, what, remedy)| format!("the files do not hold {}: {remedy}", plural(n, what))).collect()
}

/// Returns `1 factor on poses`, `2 factors on poses`.
fn plural(n: usize, what: &str) -> String {
    match what.split_once(' ') {
        Some((noun, rest)) if n != 1 => format!("{} {rest}", count(n, noun)),
        _ => format!("{n} {what}"),
    }
}
