//! `manifactor evaluate`: compares a trajectory with the ground truth.
use crate::failure::Failure;
use crate::input::kind::{self, Expected, InputKind};
use crate::output;
use crate::output::text::{self, Table};
use crate::status::Status;
use clap::{Args, ValueEnum};
use manifactor::config::Document;
use manifactor::formats::detections::{self, DetectionRow};
use manifactor::formats::read_text;
use manifactor::formats::tum::{self, Trajectory};
use manifactor::graph::checked::Positive;
use manifactor::slam::metrics::{
    Alignment, MetricsError, Pairing, Statistics, absolute_error, align, associate, identity, pair_boxes,
    relative_error,
};
use serde_json::json;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Compare two trajectories in the TUM format (timestamp tx ty tz qx qy qz qw): ATE and RPE.
///
/// With --boxes, compare the data association of two files of detections instead (CSV, as for the source
/// `tum`).
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  manifactor simulate examples/desk/desk.toml --out recording\n  manifactor evaluate recording/groundtruth.txt recording/odometry.txt"
)]
pub(crate) struct Evaluate {
    /// The true trajectory, or with --boxes the detections with their true objects.
    truth: PathBuf,
    /// The estimated trajectory, or with --boxes the detections with their estimated objects.
    estimate: PathBuf,
    /// Compare the `object_key` of equal boxes at equal times. Boxes with no key, or with 0, are ignored in
    /// the first file; in the second, each counts as an object by itself.
    #[arg(long, conflicts_with_all = ["align", "within", "delta", "all_pairs"])]
    boxes: bool,
    /// Alignment of the estimate to the frame of the truth.
    #[arg(long, value_enum, default_value = "se3")]
    align: Align,
    /// Largest time difference between two matched poses, in seconds.
    #[arg(long, value_name = "SECONDS", default_value = "0.02", value_parser = positive, allow_negative_numbers = true)]
    within: Positive,
    /// Number of poses between the two ends of a relative error.
    #[arg(long, value_name = "POSES", default_value = "1")]
    delta: NonZeroUsize,
    /// Compute a relative error from every pose, instead of consecutive segments.
    #[arg(long)]
    all_pairs: bool,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

fn positive(text: &str) -> Result<Positive, String> {
    let number = text.parse::<f64>().map_err(|_| "expected a number".to_owned())?;
    Positive::new(number).map_err(|e| e.to_string())
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Align {
    /// Rotation and translation that minimize the distances between the positions.
    Se3,
    /// Rotation, translation and scale.
    Sim3,
    /// The transformation that makes the first poses equal.
    First,
    /// No alignment.
    None,
}

impl From<Align> for Alignment {
    fn from(align: Align) -> Self {
        match align {
            Align::Se3 => Self::Se3,
            Align::Sim3 => Self::Sim3,
            Align::First => Self::FirstPose,
            Align::None => Self::None,
        }
    }
}

impl Evaluate {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        if self.boxes {
            return self.boxes();
        }
        let truth = read_trajectory(&self.truth)?;
        let estimate = read_trajectory(&self.estimate)?;
        let pairing = if self.all_pairs { Pairing::All } else { Pairing::Consecutive };
        let measure = || -> Result<_, MetricsError> {
            let pairs = associate(&truth.poses, &estimate.poses, self.within.get())?;
            let (similarity, pairs) = align(&pairs, self.align.into())?;
            let (ate, rpe) = (absolute_error(&pairs)?, relative_error(&pairs, self.delta.get(), pairing)?);
            Ok((similarity.scale, pairs.len(), ate, rpe))
        };
        let (scale, pairs, ate, rpe) = measure().map_err(Failure::input)?;
        let poses = [estimate.poses.len(), truth.poses.len()];
        let warning = (2 * pairs < poses[0].min(poses[1])).then(|| {
            let within = self.within.get();
            format!(
                "the errors cover {pairs} poses, less than half of the {} estimated and of the {} true poses: no other pose has a \
                 match within {within} s; --within SECONDS sets the limit",
                poses[0], poses[1]
            )
        });
        if self.json {
            output::print_json(&json!({
                "pairs": pairs, "poses": { "estimate": poses[0], "truth": poses[1] }, "warning": warning,
                "scale": scale, "ate": ate,
                "rpe": { "translation": rpe.translation, "rotation": rpe.rotation },
            }));
            return Ok(Status::Done);
        }
        let mut table = Table::of_numbers(&["error", "rmse", "mean", "median", "std", "min", "max"]);
        table.row(row("ATE, m", &ate));
        table.row(row("RPE translation, m", &rpe.translation));
        table.row(row("RPE rotation, rad", &rpe.rotation));
        let pairs = text::count(pairs, "matched pose");
        output::print(&format!(
            "{pairs} ({} in the estimate, {} in the truth), scale {scale:.6}\n{}\n",
            poses[0],
            poses[1],
            table.text()
        ));
        if let Some(warning) = warning {
            output::print_message(&format!("warning: {warning}"));
        }
        Ok(Status::Done)
    }
}

impl Evaluate {
    /// Compares the objects of the boxes.
    fn boxes(&self) -> Result<Status, Failure> {
        let truth = read_detections(&self.truth)?;
        let estimate = read_detections(&self.estimate)?;
        let named = pair_boxes(&truth, &estimate);
        let missing = named.iter().filter(|(_, estimate)| estimate.is_none()).count();
        if named.is_empty() || missing == named.len() {
            return Err(Failure::with_help(
                format!(
                    "{} has none of the {} with an object in {}",
                    self.estimate.display(),
                    text::count(named.len(), "box"),
                    self.truth.display()
                ),
                "boxes match if their timestamps and their four sides are equal",
            ));
        }
        let scores = identity(named.iter().map(|(truth, estimate)| (*truth, estimate.flatten())));
        if self.json {
            output::print_json(&json!({ "missing": missing, "scores": scores }));
            return Ok(Status::Done);
        }
        let mut table = Table::of_numbers(&["pairs of boxes", "precision", "recall", "F1"]);
        let number = |x: f64| format!("{x:.4}");
        table.row([
            "same object".to_owned(),
            number(scores.precision),
            number(scores.recall),
            number(scores.f1),
        ]);
        let mut summary = format!(
            "{}, {}, {} with 3 boxes or more\n{}\n",
            text::count(scores.boxes, "box"),
            text::count(scores.true_objects, "true object"),
            text::count(scores.objects, "estimated object"),
            table.text()
        );
        summary += &format!(
            "homogeneity {:.4}, completeness {:.4}, identity F1 {:.4}, {}\n",
            scores.homogeneity,
            scores.completeness,
            scores.identity_f1,
            text::count(scores.switches, "switch")
        );
        if missing > 0 {
            summary += &format!(
                "{} missing in {}: each counts as an object by itself\n",
                text::count(missing, "box"),
                self.estimate.display()
            );
        }
        output::print(&summary);
        Ok(Status::Done)
    }
}

/// Reads a file that has to be a trajectory.
fn read_trajectory(path: &Path) -> Result<Trajectory, Failure> {
    let trajectory = tum::parse(&read_as(path, kind::TRAJECTORY)?, path)?;
    for note in trajectory.notes() {
        output::print_note(&format!("{}: {note}", path.display()));
    }
    Ok(trajectory)
}

/// Reads a file that has to be a table of detections.
fn read_detections(path: &Path) -> Result<Vec<DetectionRow>, Failure> {
    Ok(detections::parse(&read_as(path, kind::DETECTIONS)?, path)?)
}

/// Reads a file. If it is of a different kind, the error names the command for it.
fn read_as(path: &Path, expected: Expected) -> Result<String, Failure> {
    expected.refuse_folder(path)?;
    let text = read_text(path)?;
    let of_document = || InputKind::of_document(&Document::open(path).ok()?);
    expected.check(path, InputKind::of_text(path, &text).or_else(of_document))?;
    Ok(text)
}

fn row(name: &str, s: &Statistics) -> [String; 7] {
    let [rmse, mean, median, std, min, max] =
        [s.rmse, s.mean, s.median, s.std, s.min, s.max].map(|x| format!("{x:.6}"));
    [name.to_owned(), rmse, mean, median, std, min, max]
}
