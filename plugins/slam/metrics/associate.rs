//! Association of the poses of two trajectories by time.
use super::MetricsError;
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;

/// An estimated pose and its true counterpart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosePair {
    /// Timestamp of the estimate, in seconds.
    pub timestamp: f64,
    /// The true pose.
    pub truth: Se3,
    /// The estimated pose.
    pub estimate: Se3,
}

/// Pairs each pose of the shorter trajectory with the nearest in time of the longer one, if that is within
/// `within` seconds; the earlier one if two are equally near. As in evo, each pose of the shorter
/// trajectory is used, and a pose of the longer one may be used twice. Both have to be sorted by time.
///
/// # Errors
/// If no poses match.
pub fn associate(
    truth: &[StampedPose],
    estimate: &[StampedPose],
    within: f64,
) -> Result<Vec<PosePair>, MetricsError> {
    let pair = |truth: &StampedPose, estimate: &StampedPose| PosePair {
        timestamp: estimate.timestamp,
        truth: truth.pose,
        estimate: estimate.pose,
    };
    let pairs: Vec<_> = if estimate.len() > truth.len() {
        truth.iter().filter_map(|t| Some(pair(t, nearest(estimate, t.timestamp, within)?))).collect()
    } else {
        estimate.iter().filter_map(|e| Some(pair(nearest(truth, e.timestamp, within)?, e))).collect()
    };
    if pairs.is_empty() {
        let span = |t: &[StampedPose]| Some((t.first()?.timestamp, t.last()?.timestamp));
        return Err(MetricsError::NothingMatches { within, estimate: span(estimate), truth: span(truth) });
    }
    Ok(pairs)
}

fn nearest(trajectory: &[StampedPose], timestamp: f64, within: f64) -> Option<&StampedPose> {
    let after = trajectory.partition_point(|p| p.timestamp <= timestamp);
    let (before, after) = (trajectory[..after].last(), trajectory.get(after));
    let away = |p: &StampedPose| (p.timestamp - timestamp).abs();
    // the earlier first, because `min_by` returns the first of equal ones
    let nearest = before.into_iter().chain(after).min_by(|a, b| away(a).total_cmp(&away(b)));
    nearest.filter(|p| away(p) <= within)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn trajectory(times: &[f64]) -> Vec<StampedPose> {
        let pose = |t: &f64| Se3 { translation: Vector3::x() * *t, ..Se3::identity() };
        times.iter().map(|t| StampedPose { timestamp: *t, pose: pose(t) }).collect()
    }

    fn matched(truth: &[f64], estimate: &[f64], within: f64) -> Vec<(f64, f64)> {
        let pairs = associate(&trajectory(truth), &trajectory(estimate), within).unwrap();
        pairs.iter().map(|p| (p.truth.translation.x, p.estimate.translation.x)).collect()
    }

    #[test]
    fn the_nearest_in_time_is_taken_and_the_earlier_of_equals() {
        let truth = [0.0, 1.0, 2.0, 3.0];
        assert_eq!(matched(&truth, &[0.25, 1.5, 9.0], 0.5), [(0.0, 0.25), (1.0, 1.5)]);
        assert_eq!(matched(&truth, &[2.0], 0.0), [(2.0, 2.0)]);
    }

    #[test]
    fn the_shorter_trajectory_looks_for_partners_in_the_longer() {
        assert_eq!(matched(&[1.0], &[0.5, 0.75, 1.125], 0.5), [(1.0, 1.125)]);
    }

    #[test]
    fn clocks_that_do_not_meet_are_an_error_that_says_so() {
        let error = associate(&trajectory(&[0.0, 1.0]), &trajectory(&[100.0]), 0.02).unwrap_err();
        assert!(error.to_string().ends_with("(estimate: 100 to 100 s; truth: 0 to 1 s)"), "{error}");
    }
}
