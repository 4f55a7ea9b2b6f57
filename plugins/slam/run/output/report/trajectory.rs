use manifactor_formats::tum::StampedPose;
use manifactor_mapping::mapping::Warning;
use manifactor_mapping::settings::EvaluationSettings;
use manifactor_metrics::{
    Alignment, Interval, MetricsError, Pairing, PosePair, RelativeError, Statistics, absolute_error, align,
    associate, change_of_error, relative_error,
};
use manifactor_recording::sequence::GroundTruth;
use serde::Serialize;

/// Errors of the trajectory before and after the solve.
#[derive(Debug, Clone, Serialize)]
pub struct TrajectoryReport {
    /// Alignment with the ground truth.
    pub alignment: Alignment,
    /// Number of estimated poses with a true pose, and number of all estimated poses.
    pub covered: [usize; 2],
    /// Number of true poses.
    pub truth_poses: usize,
    /// Errors of odometry alone.
    pub odometry: TrajectoryError,
    /// Errors of the estimate.
    pub estimate: TrajectoryError,
    /// Relative increase of the ATE over that of odometry, with its confidence interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub change: Option<Interval>,
}

/// Errors of a trajectory.
#[derive(Debug, Clone, Serialize)]
pub struct TrajectoryError {
    /// Absolute position errors. Unit: metres.
    pub ate: Statistics,
    /// Relative pose error over [`EvaluationSettings::relative_over`] frames; `None` for shorter
    /// trajectories.
    pub rpe: Option<RelativeError>,
}

/// Returns one report for each alignment, of odometry and of the estimate. Adds a warning if an error has
/// grown or if the ground truth cannot be used.
pub(super) fn compare(
    truth: Option<&GroundTruth>,
    [before, after]: &[Vec<StampedPose>; 2],
    settings: &EvaluationSettings,
    warnings: &mut Vec<Warning>,
) -> Vec<TrajectoryReport> {
    let Some(truth) = truth else { return vec![] };
    let aligned = |trajectory: &[StampedPose], alignment| aligned(truth, trajectory, alignment, settings);
    let error = |aligned: &[PosePair]| -> Result<TrajectoryError, MetricsError> {
        let rpe = relative_error(aligned, settings.relative_over.get(), Pairing::All).ok();
        Ok(TrajectoryError { ate: absolute_error(aligned)?, rpe })
    };
    let poses = after.len();
    let report = |alignment: Alignment| -> Result<TrajectoryReport, MetricsError> {
        let (before, after) = (aligned(before, alignment)?, aligned(after, alignment)?);
        let change = change_of_error(&before, &after);
        let covered = [after.len(), poses];
        Ok(TrajectoryReport {
            alignment,
            covered,
            truth_poses: truth.trajectory.len(),
            odometry: error(&before)?,
            estimate: error(&after)?,
            change,
        })
    };
    let mut reports = vec![];
    for alignment in &settings.alignments {
        match report(*alignment) {
            Ok(report) => reports.push(report),
            Err(error) => warnings.push(Warning::NotEvaluated { reason: error.to_string() }),
        }
    }
    warnings.extend(reports.first().and_then(|report| too_few_poses(report, settings)));
    warnings.extend(reports.first().and_then(worse_than_odometry));
    reports
}

/// Returns the estimated and true poses, aligned by the first pose.
pub(super) fn by_first_pose(
    truth: &GroundTruth,
    estimate: &[StampedPose],
    settings: &EvaluationSettings,
) -> Result<Vec<PosePair>, MetricsError> {
    aligned(truth, estimate, Alignment::FirstPose, settings)
}

fn aligned(
    truth: &GroundTruth,
    estimate: &[StampedPose],
    alignment: Alignment,
    settings: &EvaluationSettings,
) -> Result<Vec<PosePair>, MetricsError> {
    let pairs = associate(&truth.trajectory, estimate, *settings.max_time_difference)?;
    Ok(align(&pairs, alignment)?.1)
}

/// Returns a warning if less than half of the poses are compared, because the result hardly applies to the
/// rest.
fn too_few_poses(report: &TrajectoryReport, settings: &EvaluationSettings) -> Option<Warning> {
    let [covered, poses] = report.covered;
    let truth = report.truth_poses;
    let within = *settings.max_time_difference;
    (2 * covered < poses.min(truth)).then_some(Warning::FewPoses { covered, poses, truth, within })
}

fn worse_than_odometry(report: &TrajectoryReport) -> Option<Warning> {
    let (odometry, estimate) = (report.odometry.ate.rmse, report.estimate.ate.rmse);
    // tolerates rounding: a graph without objects leaves the odometry unchanged
    let grew = estimate > odometry * (1.0 + 1e-6);
    grew.then(|| Warning::WorseThanOdometry {
        alignment: alignment_name(report.alignment),
        odometry,
        estimate,
    })
}

/// Returns the name of an alignment in documents.
pub fn alignment_name(alignment: Alignment) -> String {
    let json = serde_json::to_value(alignment).unwrap_or_default();
    json.as_str().unwrap_or_default().to_owned()
}
