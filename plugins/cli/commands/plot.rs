//! `manifactor plot`: draws the pictures of a run again.
use crate::failure::Failure;
use crate::input::kind;
use crate::input::pictures::PictureStyle;
use crate::interrupt;
use crate::output;
use crate::output::text::count;
use crate::output::watch::Watch;
use crate::status::Status;
use clap::Args;
use manifactor::slam::output::{OutputFolder, write_whole};
use manifactor::slam::record::{RecordError, RunRecord};
use manifactor::viz::ply;
use std::path::PathBuf;

/// Draw the pictures of a run again from its folder, with another size or theme.
///
/// Everything is drawn from record.json; nothing is solved. The pictures replace those of the run, or go to
/// --out.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  manifactor run examples/desk/desk.toml --out out/desk\n  manifactor plot out/desk --theme dark"
)]
pub(crate) struct Plot {
    /// The folder of a run, which holds record.json.
    folder: PathBuf,
    #[command(flatten)]
    style: PictureStyle,
    /// The folder for the pictures. Default: the folder of the run.
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into --out even if it holds other files.
    #[arg(long, requires = "out")]
    force: bool,
}

impl Plot {
    pub(crate) fn run(&self, verbose: u8) -> Result<Status, Failure> {
        let mut interrupt = interrupt::on_ctrl_c();
        kind::RUN_FOLDER.check_folder(&self.folder)?;
        let record = RunRecord::read(&self.folder)?;
        let out = self.out.as_ref().unwrap_or(&self.folder);
        // the pictures of the run may be replaced; another folder has to be claimed
        let claim = |out| OutputFolder::claim(out, "plot", &self.folder, self.force);
        let _claimed = self.out.as_deref().map(claim).transpose()?;
        for variant in &record.variants {
            write_whole(&out.join(&variant.folder).join("map.ply"), ply(&record, variant))?;
        }
        let mut watch = Watch::new(verbose, &record.title);
        let drawn = self.style.draw_run(out, &record, &mut watch, &mut interrupt)?;
        drop(watch);
        if let Some(missing) = drawn.message(&self.folder) {
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
