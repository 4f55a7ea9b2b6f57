//! `manifactor doctor`: names probable faults of a recording.
use super::vio::{images, read};
use crate::failure::Failure;
use crate::output;
use crate::output::text::count;
use crate::status::Status;
use clap::Args;
use manifactor::formats::inertial::{read_imu_in_any_unit, read_tracks};
use manifactor::inertial::diagnosis::{Diagnosis, Finding, Recording};
use serde_json::json;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Name probable faults of a recording with an IMU: units, clocks, calibration.
///
/// The data alone decides: each fault has a correction, and a fault is probable if its correction raises the
/// likelihood of the recording. Exit code 1 means that there is one.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor doctor examples/flight/vio.toml")]
pub(crate) struct Doctor {
    /// The document, as for `vio`.
    config: PathBuf,
    /// Set a value of the document, such as `settings.gravity=1.62`.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Doctor {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let document = read(&self.config, &self.set)?;
        let folder = self.config.parent().unwrap_or(Path::new("."));
        let readings = read_imu_in_any_unit(folder.join(&document.imu))?;
        let tracks = read_tracks(folder.join(&document.tracks))?;
        let images = images(&tracks, &document.camera);
        let gravity = document.settings.gravity.get();
        let recording = Recording::new(readings, images, document.camera, document.body_from_camera, gravity);
        let diagnosis = recording.diagnose().map_err(Failure::input)?;
        if self.json {
            output::print_json(&json!(diagnosis));
        } else {
            output::print(&text(&diagnosis));
        }
        let is_healthy =
            diagnosis.findings.is_empty() && diagnosis.damage.is_empty() && diagnosis.is_explained;
        Ok(if is_healthy { Status::Done } else { Status::FaultsFound })
    }
}

fn text(diagnosis: &Diagnosis) -> String {
    let Diagnosis { findings, damage, pairs, points, residual, gravity, is_explained } = diagnosis;
    let mut text = String::new();
    damage.iter().for_each(|damage| _ = writeln!(text, "{damage}"));
    for (i, Finding { fault, gain, evidence, alternatives }) in findings.iter().enumerate() {
        let _ = writeln!(text, "{}. {fault}", i + 1);
        for alternative in alternatives {
            let _ = writeln!(text, "   or: {alternative}");
        }
        let gain = gain.map(|gain| format!("; log-likelihood +{gain:.0}")).unwrap_or_default();
        let _ = writeln!(text, "   {evidence}{gain}");
    }
    let _ = match findings.len() {
        _ if !is_explained => {
            writeln!(text, "the points do not fit the IMU, and known faults do not explain this:")
        }
        0 if damage.is_empty() => writeln!(text, "no fault found"),
        0 => writeln!(text, "readings are damaged; no other fault found"),
        n => writeln!(text, "{}; with all corrections:", count(n, "probable fault")),
    };
    let _ = writeln!(
        text,
        "{} in {} of images: median distance from their epipolar lines {residual:.2} px; gravity {gravity:.2} m/s²",
        count(*points, "point"),
        count(*pairs, "pair")
    );
    text
}
