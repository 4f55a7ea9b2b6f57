//! `manifactor run`: a run from its document to its files.
use crate::failure::Failure;
use crate::input::pictures::Look;
use crate::input::run_file::RunArguments;
use crate::interrupt;
use crate::output::watch::Watch;
use crate::output::{self, table};
use crate::status::Status;
use clap::Args;
use manifactor::slam::output::{OutputFolder, write_report, write_variant, write_whole};
use manifactor::slam::record::{RunRecord, VariantRecord};
use manifactor::slam::run::Run as Running;
use manifactor::solve::All;
use manifactor::viz::{ply, run_page, run_pictures};
use std::path::PathBuf;
use std::sync::atomic::Ordering;

/// Build, solve, evaluate and write what a document describes.
///
/// Each variant of the run gets a folder with its settings, trajectory, objects, frames, graph, iterations, metrics, the
/// map as PLY, and pictures as SVG and PNG (the map from above and from the side, errors and poses over time, residuals,
/// cost, images). report.html shows all of it, with the map in 3D, and needs no network. `manifactor plot` makes the
/// pictures again.
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
        let (mut records, mut configs) = (vec![], vec![]);
        let mut run = Running::new(&document, self.run.data());
        for variant in &document.variants {
            tracing::info!("variant {}", variant.name);
            let mut watch = Watch::new(verbose, &variant.name);
            let mut observer = All(vec![&mut watch, &mut interrupt]);
            let (estimate, report) = run.variant(variant, &mut observer)?;
            drop(watch);
            let record = VariantRecord::new(variant, &estimate);
            let folder = write_variant(&document, variant, &estimate, &report, &record)?;
            configs.push(std::fs::read_to_string(folder.join("config.toml")).map_err(Failure::at(&folder))?);
            records.push(record);
            if interrupt.0.load(Ordering::Relaxed) {
                break;
            }
        }
        let report = run.finish();
        let record = RunRecord::new(&document.title, records);
        write_report(&document.output, &report, &record)?;
        write_whole(&document.output.join("report.html"), run_page(&report, &record, &configs))?;
        let look = Look::default();
        for variant in &record.variants {
            let folder = document.output.join(&variant.folder);
            look.write(&folder, &run_pictures(&record, variant, look.width()))?;
            write_whole(&folder.join("map.ply"), ply(&record, variant))?;
        }
        if self.json {
            output::json(&report);
        } else {
            output::print(&table::of_run(&report));
            let out = document.output.display();
            output::print(&format!("\nWritten to {out}; open {out}/report.html in a browser.\n"));
        }
        Ok(Status::from(&report))
    }
}
