//! Motion models: the factors and variables that tie consecutive frames.
//!
//! A model sees one [`Step`] at a time, with the odometry and the estimates so far. A batch and a stream use it alike: neither knows which
//! variables a frame has besides its pose.
use manifactor_geometry::Se3;
use manifactor_graph::loss::Loss;
use manifactor_graph::{FactorEntry, Noise, Values, Variable};
use std::fmt::{self, Debug};
use std::sync::Arc;

mod constant_velocity;
mod odometry;

pub use constant_velocity::ConstantVelocity;
pub use manifactor_recording::keys::pose_key;
pub use odometry::Odometry;

/// Ties consecutive frames. Chosen by name in a run's `[motion]`.
#[typetag::serialize(tag = "type")]
pub trait MotionModel: Debug + Send + Sync {
    /// Pose of the second frame, world from camera, for an estimate `from` of the first.
    fn predict(&self, step: &Step<'_>, from: &Se3) -> Se3;

    /// Variables of the second frame besides its pose, where a solve begins; in the first step also those of the first frame. `poses` are
    /// estimates of both frames, world from camera.
    fn variables(&self, _step: &Step<'_>, _poses: [&Se3; 2]) -> Values {
        Values::new()
    }

    /// Factors among the variables of both frames.
    ///
    /// # Errors
    /// If the step has no factor, for example one without a usable noise.
    fn factors(&self, step: &Step<'_>) -> Result<Vec<FactorEntry>, MotionError>;

    /// Prefixes of the keys of [its variables](Self::variables): `v` for `v0`, `v1`, …
    fn prefixes(&self) -> &'static [&'static str] {
        &[]
    }
}

manifactor_graph::kind!(dyn MotionModel, "motion");

/// A step that a motion model has no factor for.
#[derive(Debug, thiserror::Error)]
#[error("no motion from frame {from} to frame {to}, {seconds} s later: {why}")]
pub struct MotionError {
    /// Number of the first frame.
    pub from: usize,
    /// Number of the second frame.
    pub to: usize,
    /// Time between them.
    pub seconds: f64,
    /// The fault.
    pub why: String,
}

/// From one frame to the next.
#[derive(Clone, Copy)]
pub struct Step<'a> {
    /// Numbers of both frames.
    pub frames: [usize; 2],
    /// Time from the first frame to the second, in seconds; positive.
    pub seconds: f64,
    /// The odometry's measurement of the step.
    pub odometry: RelativePose<'a>,
    /// Estimates so far, by key; `None` for variables that are not in the graph.
    pub estimates: &'a dyn Fn(&str) -> Option<Box<dyn Variable>>,
}

/// A relative pose as odometry measures it.
#[derive(Debug, Clone, Copy)]
pub struct RelativePose<'a> {
    /// Pose of the second camera in the frame of the first.
    pub pose: Se3,
    /// Noise of Log(Z⁻¹ Xᵢ⁻¹ Xⱼ): rad, then m.
    pub noise: &'a Noise,
    /// Robust loss; `None` for a quadratic one.
    pub loss: Option<&'a Arc<dyn Loss>>,
}

impl Step<'_> {
    /// The error of a model that has no factor for this step.
    pub fn error(&self, why: &dyn fmt::Display) -> MotionError {
        let [from, to] = self.frames;
        MotionError { from, to, seconds: self.seconds, why: why.to_string() }
    }
}

impl Debug for Step<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { frames: [from, to], seconds, odometry, .. } = self;
        write!(f, "Step({from} to {to} in {seconds} s, {odometry:?})")
    }
}
