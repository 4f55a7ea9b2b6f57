//! Motion models: factors and variables between consecutive frames.
//!
//! A model gets one [`MotionStep`] at a time, with the odometry and the estimates so far. Batch and stream use
//! models in the same way: neither depends on the variables of a frame besides its pose.
use manifactor_geometry::Se3;
use manifactor_graph::loss::Loss;
use manifactor_graph::{Factor, FactorEntry, Key, Noise, Values, Variable};
use std::fmt::{self, Debug};
use std::sync::Arc;

mod constant_velocity;
mod odometry;
mod scaled_odometry;

pub use constant_velocity::ConstantVelocityMotion;
pub use manifactor_recording::keys::pose_key;
pub use odometry::OdometryMotion;
pub use scaled_odometry::ScaledOdometryMotion;

/// A model of the motion between consecutive frames. Chosen by name in `[motion]` of a run.
#[typetag::serialize(tag = "type")]
pub trait MotionModel: Debug + Send + Sync {
    /// Predicts the pose of the second frame, world from camera, from the estimate `from` of the first.
    fn predict(&self, step: &MotionStep<'_>, from: &Se3) -> Se3;

    /// Returns initial values for the variables of the second frame besides its pose; in the first step also
    /// for the first frame. `poses` are estimates of both frames, world from camera.
    fn variables(&self, _step: &MotionStep<'_>, _poses: [&Se3; 2]) -> Values {
        Values::new()
    }

    /// Returns the factors among the variables of both frames.
    ///
    /// # Errors
    /// If the step has no factor, for example because its noise is not usable.
    fn factors(&self, step: &MotionStep<'_>) -> Result<Vec<FactorEntry>, MotionError>;

    /// Returns the prefixes of the keys of [its variables](Self::variables): `v` for `v0`, `v1`, …
    fn prefixes(&self) -> &'static [&'static str] {
        &[]
    }

    /// Returns the types of its variables that later frames share, so that they stay in the window of a stream.
    fn lasting_types(&self) -> &'static [&'static str] {
        &[]
    }
}

manifactor_graph::kind!(dyn MotionModel, "motion");

/// A step without a factor in the motion model.
#[derive(Debug, thiserror::Error)]
#[error("no motion from frame {from} to frame {to}, {seconds} s later: {why}")]
pub struct MotionError {
    /// Index of the first frame.
    pub from: usize,
    /// Index of the second frame.
    pub to: usize,
    /// Time between the frames, in seconds.
    pub seconds: f64,
    /// Cause.
    pub why: String,
}

/// The step from one frame to the next.
#[derive(Clone, Copy)]
pub struct MotionStep<'a> {
    /// Indices of both frames.
    pub frames: [usize; 2],
    /// Time from the first frame to the second, in seconds; positive.
    pub seconds: f64,
    /// Odometry measurement of the step.
    pub odometry: RelativePose<'a>,
    /// Returns the current estimate of a key; `None` for variables that are not in the graph.
    pub estimates: &'a dyn Fn(&str) -> Option<Box<dyn Variable>>,
}

/// Name of the factor of a step whose noise its frame gives. It keeps this noise if the noise of the odometry is
/// estimated.
pub const STEP_WITH_NOISE: &str = "odometry with its own noise";

/// A relative pose measured by odometry.
#[derive(Debug, Clone, Copy)]
pub struct RelativePose<'a> {
    /// Pose of the second camera in the frame of the first.
    pub pose: Se3,
    /// Noise of Log(Z⁻¹ Xᵢ⁻¹ Xⱼ): rad, then m.
    pub noise: &'a Noise,
    /// Name of its factor: [`STEP_WITH_NOISE`] if the frame gives the noise.
    pub name: Option<&'static str>,
    /// Robust loss; `None` for a quadratic one.
    pub loss: Option<&'a Arc<dyn Loss>>,
}

impl MotionStep<'_> {
    /// Returns a factor of the odometry of this step, with its noise, its loss and its name.
    pub fn entry(&self, keys: Vec<Key>, factor: Arc<dyn Factor>) -> FactorEntry {
        let RelativePose { noise, name, loss, .. } = self.odometry;
        FactorEntry { keys, name: name.map(Arc::from), factor, noise: noise.clone(), loss: loss.cloned() }
    }

    /// Returns the error of a model without a factor for this step.
    pub fn error(&self, why: &dyn fmt::Display) -> MotionError {
        let [from, to] = self.frames;
        MotionError { from, to, seconds: self.seconds, why: why.to_string() }
    }
}

impl Debug for MotionStep<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { frames: [from, to], seconds, odometry, .. } = self;
        write!(f, "Step({from} to {to} in {seconds} s, {odometry:?})")
    }
}
