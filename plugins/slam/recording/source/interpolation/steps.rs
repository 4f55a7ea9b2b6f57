//! Noise of the odometry between images whose poses are interpolated, if the source gives the noise of its poses.
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::{Manifold, Noise};
use nalgebra::{DMatrix, Matrix6};
use std::collections::VecDeque;

/// Largest number of steps that wait for an image; older ones are joined.
const MAX_STEPS: usize = 1000;

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

    fn at(timestamp: f64, x: f64) -> StampedPose {
        StampedPose { timestamp, pose: Se3::new(So3::identity(), Vector3::new(x, 0.0, 0.0)) }
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
