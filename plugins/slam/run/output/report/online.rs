//! Report of a stream.
use super::trajectory::{self, TrajectoryReport};
use manifactor_formats::replay::Latencies;
use manifactor_formats::tum::StampedPose;
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::estimate::variance::StreamNoise;
use manifactor_mapping::settings::EvaluationSettings;
use manifactor_online::{FrameError, FrameReport, Mapper};
use serde::Serialize;

/// A stream, from its first frame to its last.
#[derive(Debug, Clone, Default, Serialize)]
pub struct OnlineReport {
    /// Durations of frames, from their arrival to the new estimate.
    pub latencies: Latencies,
    /// Duration of each frame. Unit: seconds.
    #[serde(skip)]
    pub seconds: Vec<f64>,
    /// Poses as they were estimated when their frames arrived.
    #[serde(skip)]
    pub live: Vec<StampedPose>,
    /// True if the user ended the stream before its last frame.
    pub interrupted: bool,
    /// Number of objects added to the map.
    #[serde(rename = "born")]
    pub initialized: usize,
    /// Number of objects that were removed again.
    #[serde(rename = "withdrawn")]
    pub removed: usize,
    /// Number of times that rules were applied again to an object because its class had changed.
    pub revised: usize,
    /// Skipped frames and rejected input; the first of them in words.
    pub refused: Vec<String>,
    /// Number of skipped frames and rejected inputs.
    pub refusals: usize,
    /// The skipped frames among them: the first of them in words, and the number of all.
    #[serde(skip)]
    left_out: (Vec<String>, usize),
    /// Number of updates that ended in a batch solve because shorter steps did not help.
    pub solved_batch: usize,
    /// Number of objects in the map after the last frame.
    pub objects: usize,
    /// Cost ½ Σ ρ after the last frame.
    pub cost: f64,
    /// Size of the factorization. Unit: bytes.
    pub bytes: usize,
    /// The noise that was estimated after the first seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<StreamNoise>,
    /// Errors of the poses in `live`: one entry per alignment.
    pub trajectory: Vec<TrajectoryReport>,
}

/// Largest number of refusals that are reported in words.
const MAX_REPORTED_REFUSALS: usize = 20;

impl OnlineReport {
    /// Resets the counts of the map when the map is rebuilt from the frames so far. Durations and skipped
    /// frames are kept.
    pub(crate) fn reset_map_counts(&mut self) {
        let Self { seconds, left_out, .. } = std::mem::take(self);
        let (refused, refusals) = left_out.clone();
        *self = Self { seconds, left_out, refused, refusals, ..Self::default() };
    }

    /// Counts a frame.
    pub(crate) fn add_frame(&mut self, report: Result<&FrameReport, &FrameError>, seconds: f64) {
        self.seconds.push(seconds);
        match report {
            Ok(report) => self.add_frame_report(report),
            Err(error) => {
                let (told, all) = &mut self.left_out;
                *all += 1;
                told.extend(Some(error.to_string()).filter(|_| told.len() < MAX_REPORTED_REFUSALS));
                self.add_refusals(&[error.to_string()]);
            }
        }
    }

    /// Counts the results of a frame.
    pub(crate) fn add_frame_report(&mut self, report: &FrameReport) {
        self.noise = report.noise.clone().or(self.noise.take());
        self.initialized += report.initialized.len();
        self.removed += report.removed.len();
        self.revised += report.revised.len();
        self.solved_batch += report.updates.iter().filter(|update| update.solved_batch).count();
        self.add_refusals(&report.refused);
    }

    fn add_refusals(&mut self, refused: &[String]) {
        self.refusals += refused.len();
        let room = MAX_REPORTED_REFUSALS.saturating_sub(self.refused.len());
        self.refused.extend(refused.iter().take(room).cloned());
    }

    /// Completes the report after the last frame.
    pub(crate) fn add_final_counts(&mut self, mapper: &mut Mapper) {
        self.latencies = Latencies::of(&self.seconds);
        self.objects = mapper.mapped_objects();
        self.cost = mapper.smoother().cost();
        self.bytes = mapper.smoother().bytes();
        self.live = mapper.live_poses().to_vec();
    }

    /// Compares the live poses with ground truth.
    pub(crate) fn compare_live_poses(&mut self, estimate: &Estimate, settings: &EvaluationSettings) {
        let poses = [estimate.odometry(), self.live.clone()];
        // the report of the estimate has the warnings if a comparison is impossible
        self.trajectory =
            trajectory::compare(estimate.sequence.ground_truth.as_ref(), &poses, settings, &mut vec![]);
    }
}
