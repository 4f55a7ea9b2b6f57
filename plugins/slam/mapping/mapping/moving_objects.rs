//! Detection of moving objects from measured depths.
use super::Rejection;
use super::measurements::ObjectBox;
use manifactor_formats::tum::StampedPose;
use nalgebra::{Matrix3x4, Matrix4, Vector3, Vector4};

/// Length of the windows in seconds. Odometry counts as exact within a window.
const WINDOW_S: f64 = 2.0;
/// Largest allowed value of twice the log-likelihood ratio of moving to standing still. In simulation, it
/// rejects an object at rest in 2 of 200 trials (`docs/decisions/moving-objects.md`).
const MAX_EVIDENCE: f64 = 9.0;
/// Largest allowed root mean square scatter of the positions within a window, in standard deviations.
const MAX_SCATTER: f64 = 2.0;
/// Weight of the prior that scatter is as expected, in number of differences.
const SCATTER_PRIOR_WEIGHT: f64 = 4.0;
/// Standard deviation of the centre of a box, in pixels.
const CENTRE_SIGMA_PX: f64 = 5.0;
/// Prior standard deviation of the velocity, in m/s.
const SPEED_SIGMA: f64 = 100.0;

/// The centre of an object from a box and its depth.
struct PosedCentre {
    /// Unit: seconds.
    time: f64,
    /// Position of the camera in the map frame.
    camera: Vector3<f64>,
    /// Measured position of the object in the map frame.
    place: Vector3<f64>,
    /// Standard deviation of the position, in metres.
    sigma: f64,
}

/// Checks that an object stands still within short windows. `at` returns time and pose of a frame.
///
/// # Errors
/// If the object moves or its positions scatter.
pub(super) fn check_still(
    views: &[ObjectBox],
    at: impl Fn(usize) -> Option<StampedPose>,
    depth_error: f64,
) -> Result<(), Rejection> {
    let error_of = |view: &ObjectBox| depth_error.hypot(CENTRE_SIGMA_PX / view.camera.model.fx);
    let place = |view: &ObjectBox| {
        // the border shifts the centre of a box that it cuts
        let depth = view.quantities.depth().filter(|_| view.inside == [true; 4])?;
        let StampedPose { timestamp: time, pose } = at(view.frame)?;
        let pose = view.camera_pose(&pose);
        let place = pose.act(&(view.camera.model.ray(view.bounding_box.centre()) * depth));
        Some(PosedCentre { time, camera: pose.translation, place, sigma: depth * error_of(view) })
    };
    let places: Vec<PosedCentre> = views.iter().filter_map(place).collect();
    let MotionStatistics { speed, evidence, scatter } = MotionStatistics::from_centres(&places, depth_error);
    if evidence > MAX_EVIDENCE {
        return Err(Rejection::Moves { speed, evidence, limit: MAX_EVIDENCE });
    }
    if scatter > MAX_SCATTER {
        let error = views.iter().map(error_of).fold(0.0, f64::max);
        return Err(Rejection::Scatters { scatter: scatter * error, limit: MAX_SCATTER * error });
    }
    Ok(())
}

/// Test statistics of the motion of an object.
#[derive(Debug, Default)]
struct MotionStatistics {
    /// Unit: m/s.
    speed: f64,
    /// Twice the log-likelihood ratio of this motion to standing still.
    evidence: f64,
    /// Root mean square scatter of the positions within windows, in standard deviations.
    scatter: f64,
}

impl MotionStatistics {
    /// Compares two hypotheses. Moving: within each window the positions follow a line, with one velocity
    /// common to all windows. This also covers several objects that pass through one place in turn. Standing
    /// still: one position per window. All depths may share a scale error: with standard deviation
    /// `depth_error` for an object at rest, of any size for a moving one.
    fn from_centres(places: &[PosedCentre], depth_error: f64) -> Self {
        let (mut information, mut gradient) = (Matrix4::zeros(), Vector4::zeros());
        let (mut squares, mut differences) = (0.0_f64, 0.0);
        let window = |place: &PosedCentre| (place.time / WINDOW_S).floor();
        for window in places.chunk_by(|a, b| window(a) == window(b)).filter(|window| window.len() > 1) {
            let n = window.len() as f64;
            let mean = |of: fn(&PosedCentre) -> Vector3<f64>| window.iter().map(of).sum::<Vector3<f64>>() / n;
            let (camera, centre) = (mean(|place| place.camera), mean(|place| place.place));
            let time = window.iter().map(|place| place.time).sum::<f64>() / n;
            let sigma = window.iter().map(|place| place.sigma).sum::<f64>() / n;
            let span = window[window.len() - 1].time - window[0].time;
            let square: f64 = window.iter().map(|place| (place.time - time).powi(2)).sum();
            // depth errors persist: a window has the information of its two ends, however many frames it has
            let weight = span.powi(2) / (2.0 * square * sigma.powi(2));
            for place in window {
                let off = place.place - centre;
                let mut row = Matrix3x4::identity() * (place.time - time);
                row.set_column(3, &(camera - place.camera));
                information += weight * row.transpose() * row;
                gradient += weight * row.transpose() * off;
                squares += off.norm_squared() / sigma.powi(2);
            }
            differences += n - 1.0;
        }
        let still = gradient[3].powi(2) / (information[(3, 3)] + depth_error.powi(-2));
        let weak = Vector4::new(SPEED_SIGMA.powi(-2), SPEED_SIGMA.powi(-2), SPEED_SIGMA.powi(-2), 1.0);
        match (information + Matrix4::from_diagonal(&weak)).cholesky() {
            Some(factor) if differences > 0.0 => {
                let moving = factor.solve(&gradient);
                let evidence = moving.dot(&gradient) - still;
                Self {
                    speed: moving.xyz().norm(),
                    evidence,
                    scatter: ((squares + SCATTER_PRIOR_WEIGHT) / (differences + SCATTER_PRIOR_WEIGHT)).sqrt(),
                }
            }
            // no two positions in one window
            _ => Self::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    /// A measured position of an object at `x`, from a camera that moves along x at 2 m/s. `factor` scales
    /// the depth.
    fn centre_from_moving_camera(time: f64, x: f64, factor: f64) -> PosedCentre {
        let camera = Vector3::new(2.0 * time, 0.0, 0.0);
        let sight = (Vector3::new(x, 0.0, 7.0) - camera) * factor;
        PosedCentre { time, camera, place: camera + sight, sigma: 0.03 * sight.z }
    }

    fn exact_centre(time: f64, x: f64) -> PosedCentre {
        centre_from_moving_camera(time, x, 1.0)
    }

    /// Ten frames per second in every even second, from 0 to 6 s.
    fn times() -> impl Iterator<Item = f64> {
        (0..60).map(|i| 0.1 * f64::from(i)).filter(|time| time.rem_euclid(2.0) < 0.95)
    }

    #[test]
    fn things_that_pass_through_one_place_move() {
        let places: Vec<PosedCentre> =
            times().map(|time| exact_centre(time, 20.0 + 5.0 * time.rem_euclid(2.0))).collect();
        let MotionStatistics { speed, evidence, .. } = MotionStatistics::from_centres(&places, 0.03);
        assert!((speed - 5.0).abs() < 0.1 && evidence > MAX_EVIDENCE, "{speed} {evidence}");
    }

    #[test]
    fn two_things_at_once_are_not_one_that_stands_still() {
        let places: Vec<PosedCentre> =
            times().enumerate().map(|(i, time)| exact_centre(time, 20.0 + (i % 2) as f64)).collect();
        let MotionStatistics { evidence, scatter, .. } = MotionStatistics::from_centres(&places, 0.03);
        assert!(evidence < MAX_EVIDENCE && scatter > MAX_SCATTER, "{evidence} {scatter}");
    }

    #[test]
    fn what_stands_still_does_not_move_though_depths_are_off_and_odometry_drifts() {
        for places in [
            times().map(|time| centre_from_moving_camera(time, 20.0, 1.05)).collect::<Vec<_>>(),
            times().map(|time| exact_centre(time, 20.0 + 0.3 * time)).collect(),
            times().map(|time| exact_centre(time, 20.0 + 0.4 * (40.0 * time).sin())).collect(),
            vec![],
            vec![exact_centre(1.0, 20.0), exact_centre(3.0, 25.0)],
            vec![exact_centre(1.0, 20.0)],
        ] {
            let motion = MotionStatistics::from_centres(&places, 0.03);
            assert!(motion.evidence < MAX_EVIDENCE && motion.scatter < MAX_SCATTER, "{motion:?}");
        }
    }

    /// Simulates an object at rest for 15 s, with depth errors of the assumed size that last for `lasts`
    /// seconds. Returns whether it passes all checks.
    fn at_rest(errors: &mut Pcg64, frames_per_second: u32, lasts: f64) -> bool {
        let step = 1.0 / f64::from(frames_per_second);
        let kept = if lasts > 0.0 { (-step / lasts).exp() } else { 0.0 };
        let mut error: f64 = StandardNormal.sample(errors);
        let places: Vec<PosedCentre> = (0..15 * frames_per_second)
            .map(|i| {
                let time = f64::from(i) * step;
                let draw: f64 = StandardNormal.sample(errors);
                error = kept * error + (1.0 - kept * kept).sqrt() * draw;
                let camera = Vector3::new((0.3 * time).sin(), 0.0, 0.3 * (0.5 * time).sin());
                let sight = Vector3::new(0.0, 0.0, 2.0) - camera;
                PosedCentre {
                    time,
                    camera,
                    place: camera + sight * (1.0 + 0.03 * error),
                    sigma: 0.03 * sight.z,
                }
            })
            .collect();
        (3..places.len()).step_by(frames_per_second as usize / 5).all(|end| {
            let motion = MotionStatistics::from_centres(&places[..end], 0.03);
            motion.evidence < MAX_EVIDENCE && motion.scatter < MAX_SCATTER
        })
    }

    #[test]
    fn errors_of_depths_that_last_are_no_motion() {
        let mut errors = Pcg64::seed_from_u64(1);
        let ways = [10, 30].into_iter().flat_map(|rate| [0.0, 0.5, 1.0, 3.0].map(|lasts| (rate, lasts)));
        let trials = ways.flat_map(|way| [way; 25]);
        let moved = trials.filter(|(rate, lasts)| !at_rest(&mut errors, *rate, *lasts)).count();
        assert!(moved <= 10, "{moved} of 200");
    }
}
