//! `manifactor run`: computes a run from its document and writes its files.
use crate::failure::Failure;
use crate::input::pictures::PictureStyle;
use crate::input::run_file::RunArguments;
use crate::interrupt;
use crate::output::watch::Watch;
use crate::output::{self, table};
use crate::status::Status;
use clap::Args;
use manifactor::slam::estimate::Estimate;
use manifactor::slam::output::{OutputFolder, refuse_own_maps, write_report, write_variant, write_whole};
use manifactor::slam::record::{RunRecord, VariantRecord};
use manifactor::slam::report::{RunReport, VariantReport};
use manifactor::slam::run::{Run as Running, RunError};
use manifactor::slam::run_document::RunVariant;
use manifactor::solve::{AllObservers, Interrupt, Observer};
use manifactor::viz::{SceneRecording, latencies, ply, run_page};
use std::io::ErrorKind;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// Build, solve and evaluate the run that a document describes, and write the results.
///
/// A recording of ROS 2 (MCAP or SQLite) needs no document: its settings are guessed from its topics, and printed.
///
/// Each variant of the run has a folder with its settings, trajectory, objects, frames, graph, iterations
/// and metrics, the map as PLY, and pictures as SVG and PNG (the map from above and from the side, errors
/// and poses over time, residuals, cost, images). report.html shows everything, with the map in 3D, and
/// needs no network. `manifactor plot` draws the pictures again.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  manifactor run examples/desk/desk.toml --out out/desk\n  manifactor map drive.mcap"
)]
pub(crate) struct Run {
    #[command(flatten)]
    pub(crate) options: RunOptions,
}

/// Options of the commands that write the results of a run.
#[derive(Debug, Args)]
pub(crate) struct RunOptions {
    #[command(flatten)]
    run: RunArguments,
    /// The folder for the results. Default: the one in the document.
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into a folder that holds other files, and overwrite files with the same names.
    #[arg(long)]
    force: bool,
    /// Write the map to an MCAP file for viewers such as Foxglove: objects, path and poses. `manifactor online` adds the
    /// growing map.
    #[arg(long, value_name = "FILE")]
    write_mcap: Option<PathBuf>,
    /// Print JSON: the report that is also written.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Run {
    pub(crate) fn run(&self, verbose: u8) -> Result<Status, Failure> {
        let mut interrupt = interrupt::on_ctrl_c();
        let report = self.options.run_as("run", verbose, interrupt.clone(), |run, variant, _| {
            let mut watch = Watch::new(verbose, &variant.name);
            run.run_variant(variant, &mut AllObservers(vec![&mut watch, &mut interrupt]))
        })?;
        if self.options.json {
            output::print_json(&report);
        }
        Ok(Status::from(&report))
    }
}

impl RunOptions {
    /// Creates the file of `--write-mcap`.
    fn open_scene(&self) -> Result<Option<SceneRecording>, Failure> {
        let Some(file) = &self.write_mcap else { return Ok(None) };
        SceneRecording::create(file, self.force).map(Some).map_err(|error| self.scene_failure(error))
    }

    /// Returns the failure of writing the file of `--write-mcap`.
    fn scene_failure(&self, error: std::io::Error) -> Failure {
        let file = self.write_mcap.clone().unwrap_or_default();
        if error.kind() == ErrorKind::AlreadyExists {
            let message = format!("--write-mcap: {} exists", file.display());
            return Failure::with_help(message, "name a new file, or give --force to overwrite it");
        }
        Failure::File { path: file, source: error }
    }

    /// Estimates each variant until an interrupt, writes all results, and prints the table unless JSON is
    /// requested. An interrupt after the solves ends the drawing of pictures, and the report then marks the
    /// run as incomplete.
    pub(super) fn run_as(
        &self,
        command: &str,
        verbose: u8,
        mut interrupt: Interrupt,
        mut estimate: impl FnMut(
            &mut Running<'_>,
            &RunVariant,
            &mut Option<SceneRecording>,
        ) -> Result<(Estimate, VariantReport), RunError>,
    ) -> Result<RunReport, Failure> {
        let mut document = self.run.open()?;
        if let Some(out) = &self.out {
            document.output.clone_from(out);
        }
        refuse_own_maps(&document)?;
        // the claim lasts to the end
        let _claimed = OutputFolder::claim(&document.output, command, &self.run.config, self.force)?;
        let mut scene = self.open_scene()?;
        let (mut records, mut configs) = (vec![], vec![]);
        let style = PictureStyle::default();
        let mut run = Running::new(&document, self.run.data());
        for variant in &document.variants {
            tracing::info!("variant {}", variant.name);
            let (estimate, report) = estimate(&mut run, variant, &mut scene)?;
            if let Some(scene) = &mut scene {
                scene.add_estimate(&variant.name, &estimate);
            }
            let mut watch = Watch::new(verbose, &variant.name);
            watch.show("writing the results");
            let record = VariantRecord::new(variant, &estimate);
            let folder = write_variant(&document, variant, &estimate, &report, &record)?;
            if let Some(online) = &report.online {
                let title = format!("{}: latency of each frame", variant.name);
                let picture = latencies(&title, &online.seconds, style.width());
                style.write(&folder, picture.as_slice(), |_| ControlFlow::Continue(()))?;
            }
            configs.push(std::fs::read_to_string(folder.join("config.toml")).map_err(Failure::at(&folder))?);
            records.push(record);
            if interrupt.poll().is_break() {
                break;
            }
        }
        if let Some(scene) = scene {
            scene.finish().map_err(|error| self.scene_failure(error))?;
        }
        let mut watch = Watch::new(verbose, &document.title);
        watch.show("writing the report");
        let mut report = run.finish();
        let record = RunRecord::new(&document.title, records);
        write_report(&document.output, &report, &record)?;
        write_whole(&document.output.join("report.html"), run_page(&report, &record, &configs))?;
        for variant in &record.variants {
            let folder = document.output.join(&variant.folder);
            write_whole(&folder.join("map.ply"), ply(&record, variant))?;
        }
        // a Ctrl-C that ended a stream or a solve must not end the drawing too
        if !report.complete {
            interrupt = Interrupt::default();
        }
        let drawn = style.draw_run(&document.output, &record, &mut watch, &mut interrupt)?;
        let missing = drawn.message(&document.output);
        if missing.is_some() {
            report.complete = false;
            write_report(&document.output, &report, &record)?;
        }
        drop(watch);
        if !self.json {
            output::print(&table::of_run(&report, verbose > 0));
            let out = document.output.display();
            output::print(&format!("\nWritten to {out}; open {out}/report.html in a browser.\n"));
        }
        if let Some(missing) = missing {
            output::print_message(&missing);
        }
        Ok(report)
    }
}
