//! `manifactor run`: a run from its document to its files.
use crate::failure::Failure;
use crate::input::run_file::RunArguments;
use crate::interrupt;
use crate::output::watch::Watch;
use crate::output::{self, table};
use crate::status::Status;
use clap::Args;
use manifactor::slam::output::{OutputFolder, variant_folder, write_report, write_variant, write_whole};
use manifactor::slam::run::Run as Running;
use manifactor::solve::All;
use manifactor::viz::{RunPage, run_pictures};
use std::path::PathBuf;
use std::sync::atomic::Ordering;

/// Build, solve, evaluate and write what a document describes.
///
/// Each variant of the run gets a folder with its settings, trajectory, objects, graph, iterations, metrics and
/// pictures, as SVG and PNG (the map from above and from the side, errors over time, residuals, images); report.html shows all of it, and needs no network.
#[derive(Debug, Args)]
pub(crate) struct Run {
    #[command(flatten)]
    run: RunArguments,
    /// The folder for the results. Default: the one that the document names.
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into a folder that holds files of something else, over those of the same names.
    #[arg(long)]
    force: bool,
    /// Print JSON: the report that is also written.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Run {
    pub(crate) fn run(&self, verbose: u8) -> Result<Status, Failure> {
        let mut document = self.run.open()?;
        if let Some(out) = &self.out {
            document.output.clone_from(out);
        }
        // held to the end
        let _claimed = OutputFolder::claim(&document.output, "run", &self.run.config, self.force)?;
        let mut interrupt = interrupt::on_ctrl_c();
        let mut page = RunPage::default();
        let mut run = Running::new(&document, self.run.data());
        for variant in &document.variants {
            tracing::info!("variant {}", variant.name);
            let mut watch = Watch::new(verbose, &variant.name);
            let mut observer = All(vec![&mut watch, &mut interrupt]);
            let (estimate, report) = run.variant(variant, &mut observer)?;
            drop(watch);
            let folder = write_variant(&document, variant, &estimate, &report)?;
            let title = format!("{}: {}", document.title, variant.name);
            let pictures = run_pictures(&title, &estimate, &variant.settings);
            super::pictures::write(&folder, &pictures)?;
            let config = std::fs::read_to_string(folder.join("config.toml")).map_err(Failure::at(&folder))?;
            page.variant(&estimate, &report, &pictures, &config);
            if interrupt.0.load(Ordering::Relaxed) {
                break;
            }
        }
        let report = run.finish();
        write_report(&document.output, &report)?;
        write_whole(&document.output.join("report.html"), page.html(&report))?;
        if self.json {
            output::json(&report);
        } else {
            output::print(&table::of_run(&report));
            let folder = document.variants.first().map(|v| variant_folder(&document.output, &v.name));
            let picture = folder.map(|f| f.join("map_top.svg").display().to_string()).unwrap_or_default();
            output::print(&format!("\nWritten to {}; a picture is {picture}.\n", document.output.display()));
        }
        Ok(Status::from(&report))
    }
}
