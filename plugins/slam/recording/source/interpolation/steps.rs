//! Noise of the steps between images whose poses are interpolated: that of the odometry, as far as the source gives it,
//! and the error of interpolation.
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::{Manifold, Noise};
use nalgebra::{DMatrix, Matrix6, Vector6};
use std::collections::VecDeque;

/// Largest number of poses whose changes of velocity give the noise of the acceleration.
const POSES: usize = 20;
/// Largest age of these poses, in seconds.
const MAX_AGE_S: f64 = 5.0;
/// Largest number of steps that wait for an image; older ones are joined.
const MAX_STEPS: usize = 1000;

/// A pose between two poses, with the error of interpolation.
///
/// The model of the motion is a constant twist with white noise on its derivative, the acceleration. Given the poses at
/// both ends of a gap T, and nothing about the velocities, the errors at the times s ≤ t after its start have the
/// covariance q s (T - t)(2Tt - t² - s²) / (6T), with the spectral density q of the noise. This is the kernel of the
/// natural cubic spline (Wahba, *Spline Models for Observational Data*, 1990).
#[derive(Debug, Clone, Copy)]
pub(super) struct InterpolatedPose {
    pub pose: Se3,
    timestamp: f64,
    /// Timestamps of the poses around it, in seconds.
    gap: [f64; 2],
    /// Spectral densities of the angular and the linear acceleration, in rad²/s³ and m²/s³.
    densities: [f64; 2],
}

impl InterpolatedPose {
    /// Returns a pose without an error.
    pub(super) fn at(pose: &StampedPose) -> Self {
        let StampedPose { timestamp, pose } = *pose;
        Self { pose, timestamp, gap: [timestamp; 2], densities: [0.0; 2] }
    }

    /// Returns the timestamp, in seconds.
    pub(super) fn timestamp(&self) -> f64 {
        self.timestamp
    }

    /// Interpolates between the last two of `poses`, which ascend in time. The others give the noise of the
    /// acceleration.
    pub(super) fn between(poses: &[StampedPose], timestamp: f64) -> Option<Self> {
        let [.., from, to] = poses else { return None };
        Some(Self {
            pose: from.interpolate(to, timestamp),
            timestamp,
            gap: [from.timestamp, to.timestamp],
            densities: densities(poses),
        })
    }

    /// Returns the variances of rotation and translation, on each axis, that interpolation adds to the step from the image
    /// before. Unit: rad², m². `None` if it adds nothing.
    pub(super) fn added_variance(&self, before: Option<&Self>) -> Option<[f64; 2]> {
        let own = self.error_with(self);
        let of = |i: usize| {
            let before = before.map_or(0.0, |before| {
                before.densities[i] * before.error_with(before)
                    - 2.0 * self.densities[i] * before.error_with(self)
            });
            (self.densities[i] * own + before).max(0.0)
        };
        let variances = [of(0), of(1)];
        variances.iter().any(|variance| *variance > 0.0).then_some(variances)
    }

    /// Returns the covariance of the errors of two poses for a spectral density of one; zero in different gaps.
    fn error_with(&self, later: &Self) -> f64 {
        let [start, end] = self.gap;
        let (gap, s, t) = (end - start, self.timestamp - start, later.timestamp - start);
        if self.gap != later.gap || gap <= 0.0 {
            return 0.0;
        }
        s * (gap - t) * (2.0 * gap * t - t * t - s * s) / (6.0 * gap)
    }
}

/// Returns the spectral densities of the angular and the linear acceleration. The mean velocities in two consecutive gaps
/// T₁ and T₂ differ by a variance of q (T₁ + T₂) / 3 on each axis.
fn densities(poses: &[StampedPose]) -> [f64; 2] {
    let recent = &poses[poses.len().saturating_sub(POSES)..];
    let newest = poses.last().map_or(0.0, |last| last.timestamp);
    let recent = recent.iter().skip_while(|pose| pose.timestamp < newest - MAX_AGE_S).collect::<Vec<_>>();
    let (mut squares, mut seconds) = ([0.0; 2], 0.0);
    for three in recent.windows(3) {
        let velocity = |i: usize| {
            three[i].pose.local(&three[i + 1].pose) / (three[i + 1].timestamp - three[i].timestamp)
        };
        let change: Vector6<f64> = velocity(1) - velocity(0);
        squares[0] += change.fixed_rows::<3>(0).norm_squared();
        squares[1] += change.fixed_rows::<3>(3).norm_squared();
        seconds += three[2].timestamp - three[0].timestamp;
    }
    if seconds > 0.0 { squares.map(|squares| squares / seconds) } else { [0.0; 2] }
}

/// Noise of the odometry between consecutive poses, as the source gives it.
#[derive(Debug, Default)]
pub(super) struct GivenSteps(VecDeque<GivenStep>);

#[derive(Debug, Clone, Copy)]
struct GivenStep {
    from: f64,
    to: StampedPose,
    /// Covariance of the step, in the tangent space of its end.
    covariance: Matrix6<f64>,
}

/// Noise of the odometry between two images.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum GivenNoise {
    /// The source gives no noise.
    None,
    /// The source gives the noise of a part of the poses between the images.
    Partial,
    /// The noise of the whole step.
    Whole(Noise),
}

impl GivenStep {
    /// Returns the covariance of a part of the step in the tangent space of a pose.
    fn covariance_at(&self, share: f64, pose: &Se3) -> Matrix6<f64> {
        let moved = pose.between(&self.to.pose).adjoint();
        moved * self.covariance * moved.transpose() * share
    }
}

impl GivenSteps {
    /// Adds the noise of the step from the pose at time `from`.
    ///
    /// # Errors
    /// If the noise leaves rows out.
    pub(super) fn push(&mut self, from: f64, to: StampedPose, noise: &Noise) -> Result<(), String> {
        let whole = noise.observed().is_none_or(|rows| rows.iter().all(|row| *row));
        let information = noise.information_matrix(Se3::TANGENT.len()).map_err(|error| error.to_string())?;
        let covariance = information.try_inverse().filter(|_| whole).ok_or(
            "expected a noise of all six rows, for the steps between images whose poses are interpolated",
        )?;
        let covariance = Matrix6::from_fn(|i, j| covariance[(i, j)]);
        self.0.push_back(GivenStep { from, to, covariance });
        while self.0.len() > MAX_STEPS
            && let (Some(first), Some(second)) = (self.0.pop_front(), self.0.front_mut())
        {
            second.covariance += first.covariance_at(1.0, &second.to.pose);
            second.from = first.from;
        }
        Ok(())
    }

    /// Moves the poses to a corrected odometry frame.
    pub(super) fn move_by(&mut self, correction: &Se3) {
        for step in &mut self.0 {
            step.to.pose = correction.compose(&step.to.pose);
        }
    }

    /// Returns the noise of the step from the image at time `from` to a later one, and discards the steps up to
    /// that one. A part of a step has the same part of its variance.
    pub(super) fn take(&mut self, from: f64, to: &StampedPose) -> GivenNoise {
        let (mut covariance, mut seconds) = (Matrix6::zeros(), 0.0);
        for step in &self.0 {
            let overlap = step.to.timestamp.min(to.timestamp) - step.from.max(from);
            if overlap > 0.0 {
                covariance += step.covariance_at(overlap / (step.to.timestamp - step.from), &to.pose);
                seconds += overlap;
            }
        }
        let used = self.0.partition_point(|step| step.to.timestamp <= to.timestamp);
        self.0.drain(..used);
        if seconds == 0.0 {
            return GivenNoise::None;
        }
        let covariance = 0.5 * (covariance + covariance.transpose());
        let is_whole = seconds >= (to.timestamp - from) * (1.0 - 1e-6);
        let noise = Noise::covariance(DMatrix::from_fn(6, 6, |i, j| covariance[(i, j)]));
        noise.ok().filter(|_| is_whole).map_or(GivenNoise::Partial, GivenNoise::Whole)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::So3;
    use nalgebra::Vector3;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    fn at(timestamp: f64, x: f64) -> StampedPose {
        StampedPose { timestamp, pose: Se3::new(So3::identity(), Vector3::new(x, 0.0, 0.0)) }
    }

    #[test]
    fn a_constant_twist_adds_no_noise() {
        let poses: Vec<StampedPose> = (0..9)
            .map(|i| f64::from(i) * 0.1)
            .map(|t| StampedPose {
                timestamp: t,
                pose: Se3::exp(&(Vector6::new(0.1, 0.2, -0.1, 1.0, 0.5, 0.0) * t)),
            })
            .collect();
        let found = InterpolatedPose::between(&poses, 0.75).unwrap();
        assert!(
            found.added_variance(None).is_none_or(|added| added.iter().all(|variance| *variance < 1e-25))
        );
    }

    /// Integrates white noise on the acceleration, and compares poses that are interpolated over a gap with the true ones.
    #[test]
    fn the_error_of_interpolation_has_the_predicted_variance() {
        let (density, step, gap) = (0.04, 0.01, 40);
        let mut random = Pcg64::seed_from_u64(7);
        let (mut x, mut v, mut path) = (0.0, 0.0, vec![]);
        for i in 0..80_000_u32 {
            path.push(at(f64::from(i) * step, x));
            // exact for piecewise constant acceleration
            let deviate: f64 = StandardNormal.sample(&mut random);
            let a = deviate * (density / step).sqrt();
            x += step * v + 0.5 * step * step * a;
            v += step * a;
        }
        let (mut squares, mut predicted, mut count) = ([0.0; 2], [0.0; 2], 0.0);
        let kept: Vec<StampedPose> = path.iter().step_by(gap).copied().collect();
        for i in 30..kept.len() - 1 {
            let [first, second] = [10, 25].map(|k| &path[i * gap + k]);
            let poses = &kept[..i + 2];
            let of = |truth: &StampedPose| InterpolatedPose::between(poses, truth.timestamp).unwrap();
            let error = |truth: &StampedPose| of(truth).pose.translation.x - truth.pose.translation.x;
            squares[0] += error(first).powi(2);
            squares[1] += (error(second) - error(first)).powi(2);
            predicted[0] += of(first).added_variance(None).unwrap()[1];
            predicted[1] += of(second).added_variance(Some(&of(first))).unwrap()[1];
            count += 1.0;
        }
        for (squares, predicted) in squares.iter().zip(predicted) {
            // the motion is along one of three axes
            let ratio = squares / (3.0 * predicted);
            assert!((0.85..1.15).contains(&ratio), "{ratio} in {count} gaps");
        }
    }

    #[test]
    fn the_noise_of_steps_adds_up_from_image_to_image() {
        let mut steps = GivenSteps::default();
        let noise = Noise::sigma(0.1).unwrap();
        for i in 1..=4 {
            let (from, to) = (f64::from(i) - 1.0, f64::from(i));
            steps.push(from, StampedPose { timestamp: to, pose: Se3::identity() }, &noise).unwrap();
        }
        let mut variance = |from: f64, to: f64| match steps
            .take(from, &StampedPose { timestamp: to, pose: Se3::identity() })
        {
            GivenNoise::Whole(noise) => 1.0 / noise.information_matrix(6).unwrap()[(0, 0)],
            other => panic!("{other:?}"),
        };
        assert!((variance(0.5, 2.25) - 0.0175).abs() < 1e-12);
        assert!((variance(2.25, 3.0) - 0.0075).abs() < 1e-12);
        let to = |timestamp| StampedPose { timestamp, pose: Se3::identity() };
        assert_eq!(steps.take(3.0, &to(4.5)), GivenNoise::Partial);
        assert_eq!(steps.take(4.5, &to(5.0)), GivenNoise::None);
    }

    #[test]
    fn a_rotation_far_from_the_image_moves_it() {
        let mut steps = GivenSteps::default();
        let noise = Noise::sigmas(&[1e-5, 1e-5, 0.1, 1e-5, 1e-5, 1e-5]).unwrap();
        steps.push(0.0, at(1.0, 0.0), &noise).unwrap();
        let certain = Noise::sigma(1e-5).unwrap();
        steps.push(1.0, at(2.0, 2.0), &certain).unwrap();
        let GivenNoise::Whole(found) = steps.take(0.0, &at(2.0, 2.0)) else { panic!("no noise") };
        // the second pose is two metres in front of the rotation
        let covariance = found.information_matrix(6).unwrap().try_inverse().unwrap();
        assert!((covariance[(4, 4)].sqrt() - 0.2).abs() < 1e-6, "{covariance}");
    }

    #[test]
    fn many_steps_without_an_image_are_joined() {
        let mut steps = GivenSteps::default();
        let noise = Noise::sigma(0.1).unwrap();
        let count = 3 * MAX_STEPS;
        for i in 1..=count {
            steps.push(i as f64 - 1.0, at(i as f64, 0.0), &noise).unwrap();
        }
        assert_eq!(steps.0.len(), MAX_STEPS);
        let GivenNoise::Whole(found) = steps.take(0.0, &at(count as f64, 0.0)) else { panic!("no noise") };
        let information = found.information_matrix(6).unwrap()[(0, 0)];
        assert!((information * 0.01 * count as f64 - 1.0).abs() < 1e-9);
    }
}
