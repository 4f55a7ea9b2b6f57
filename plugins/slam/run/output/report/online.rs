//! How a stream went.
use super::trajectory::{self, TrajectoryReport};
use manifactor_formats::replay::Latencies;
use manifactor_formats::tum::StampedPose;
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::settings::EvaluationSettings;
use manifactor_online::{FrameError, FrameReport, Mapper};
use serde::Serialize;

/// A stream, from its first frame to its last.
#[derive(Debug, Clone, Default, Serialize)]
pub struct OnlineReport {
    /// How long frames took, from when they were there to the new estimate.
    pub latencies: Latencies,
    /// Seconds, frame by frame.
    #[serde(skip)]
    pub seconds: Vec<f64>,
    /// The poses as they were estimated when their frames came.
    #[serde(skip)]
    pub live: Vec<StampedPose>,
    /// Whether somebody ended it before its last frame.
    pub interrupted: bool,
    /// Objects that came into the map.
    pub born: usize,
    /// Objects that were taken out again.
    pub withdrawn: usize,
    /// Times that rules were asked about an object again, as its class had changed.
    pub revised: usize,
    /// Frames that were left out, and what else could not be taken; the first of them in words.
    pub refused: Vec<String>,
    /// How many these are.
    pub refusals: usize,
    /// Those of them that are frames, in words and all.
    #[serde(skip)]
    left_out: (Vec<String>, usize),
    /// Updates that ended in a batch solve, as shorter steps did not help.
    pub solved_batch: usize,
    /// Objects in the map after the last frame.
    pub objects: usize,
    /// ½ Σ ρ after the last frame.
    pub cost: f64,
    /// Bytes of the factorization.
    pub bytes: usize,
    /// These poses against the truth: once for each alignment.
    pub trajectory: Vec<TrajectoryReport>,
}

/// Refusals that are told in words.
const TOLD: usize = 20;

impl OnlineReport {
    /// Forgets what was counted of a map that is made anew, of the same frames: how long they took, and those that were left out, stay.
    pub(crate) fn begin_again(&mut self) {
        let Self { seconds, left_out, .. } = std::mem::take(self);
        let (refused, refusals) = left_out.clone();
        *self = Self { seconds, left_out, refused, refusals, ..Self::default() };
    }

    /// Counts a frame in.
    pub(crate) fn count(&mut self, report: Result<&FrameReport, &FrameError>, seconds: f64) {
        self.seconds.push(seconds);
        match report {
            Ok(report) => self.tell(report),
            Err(error) => {
                let (told, all) = &mut self.left_out;
                *all += 1;
                told.extend(Some(error.to_string()).filter(|_| told.len() < TOLD));
                self.refuse(&[error.to_string()]);
            }
        }
    }

    /// Counts what a frame came to.
    pub(crate) fn tell(&mut self, report: &FrameReport) {
        self.born += report.born.len();
        self.withdrawn += report.withdrawn.len();
        self.revised += report.revised.len();
        self.solved_batch += report.updates.iter().filter(|update| update.solved_batch).count();
        self.refuse(&report.refused);
    }

    fn refuse(&mut self, refused: &[String]) {
        self.refusals += refused.len();
        let room = TOLD.saturating_sub(self.refused.len());
        self.refused.extend(refused.iter().take(room).cloned());
    }

    /// What there is to tell after the last frame.
    pub(crate) fn end(&mut self, mapper: &mut Mapper) {
        self.latencies = Latencies::of(&self.seconds);
        self.objects = mapper.mapped();
        self.cost = mapper.session().cost();
        self.bytes = mapper.session().bytes();
        self.live = mapper.live().to_vec();
    }

    /// Compares the poses as they were estimated when their frames came with the truth.
    pub(crate) fn compare(&mut self, estimate: &Estimate, settings: &EvaluationSettings) {
        let poses = [estimate.odometry(), self.live.clone()];
        // the report of the estimate tells what keeps it from being compared
        self.trajectory =
            trajectory::compare(estimate.sequence.ground_truth.as_ref(), &poses, settings, &mut vec![]);
    }
}
