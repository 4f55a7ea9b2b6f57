use super::{MotionError, MotionModel, MotionStep, pose_key};
use manifactor_geometry::{Prior, Se3, Twist};
use manifactor_graph::checked::Positive;
use manifactor_graph::{FactorEntry, Key, Manifold, Noise, Values, register};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Constant velocity with white noise on the acceleration. Odometry only provides initial values; it is not a
/// measurement.
///
/// Each frame has a second variable, the velocity `v0`, `v1`, … in its own frame. A `constant_velocity`
/// factor connects two consecutive frames, and a weak prior keeps the first velocity near zero. Use it if
/// odometry is missing or useless and most frames have boxes of several objects.
///
/// ```toml
/// motion = { type = "constant_velocity", angular_acceleration = 0.5, linear_acceleration = 0.5 }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "ConstantVelocity")]
pub struct ConstantVelocityMotion {
    /// Noise density of the angular acceleration. Unit: rad/s²/√Hz.
    pub angular_acceleration: Positive,
    /// Noise density of the linear acceleration. Unit: m/s²/√Hz.
    pub linear_acceleration: Positive,
    /// Standard deviation of the first angular velocity. Unit: rad/s.
    pub first_angular: Positive,
    /// Standard deviation of the first linear velocity. Unit: m/s.
    pub first_linear: Positive,
}

impl Default for ConstantVelocityMotion {
    fn default() -> Self {
        Self {
            angular_acceleration: Positive::literal(0.5),
            linear_acceleration: Positive::literal(0.5),
            first_angular: Positive::literal(1.0),
            first_linear: Positive::literal(1.0),
        }
    }
}

impl ConstantVelocityMotion {
    fn entry(&self, step: &MotionStep<'_>) -> Result<FactorEntry, MotionError> {
        let seconds = Positive::new(step.seconds).map_err(|error| step.error(&error))?;
        let factor = manifactor_geometry::ConstantVelocity { seconds };
        let noise = factor.noise(self.angular_acceleration, self.linear_acceleration);
        let noise = noise.map_err(|error| step.error(&error))?;
        let [from, to] = step.frames;
        let keys = vec![pose_key(from), velocity_key(from), pose_key(to), velocity_key(to)];
        Ok(FactorEntry { keys, name: None, factor: Arc::new(factor), noise, loss: None })
    }

    /// Returns the prior on the first velocity.
    fn first(&self, step: &MotionStep<'_>) -> Result<FactorEntry, MotionError> {
        let [angular, linear] = [self.first_angular.get(), self.first_linear.get()];
        let noise = Noise::sigmas(&[angular, angular, angular, linear, linear, linear]);
        Ok(FactorEntry {
            keys: vec![velocity_key(step.frames[0])],
            name: None,
            factor: Arc::new(Prior { value: Twist::zero() }),
            noise: noise.map_err(|error| step.error(&error))?,
            loss: None,
        })
    }
}

/// Returns the key of the velocity of a frame.
fn velocity_key(frame: usize) -> Key {
    Key::indexed("v", frame)
}

/// Returns the estimated velocity of a frame.
fn velocity(step: &MotionStep<'_>, frame: usize) -> Option<Twist> {
    let estimate = (step.estimates)(velocity_key(frame).as_str())?;
    estimate.erased().as_any().downcast_ref::<Twist>().copied()
}

#[typetag::serialize(name = "constant_velocity")]
impl MotionModel for ConstantVelocityMotion {
    fn predict(&self, step: &MotionStep<'_>, from: &Se3) -> Se3 {
        // before the first velocity exists, odometry is the better prediction
        velocity(step, step.frames[0]).map_or_else(
            || from.compose(&step.odometry.pose),
            |twist| from.compose(&Se3::exp(&(twist.0 * step.seconds))),
        )
    }

    fn variables(&self, step: &MotionStep<'_>, [from, to]: [&Se3; 2]) -> Values {
        let twist = Twist(Se3::identity().local(&from.between(to)) / step.seconds);
        let mut values = Values::new();
        for frame in step.frames.into_iter().filter(|frame| velocity(step, *frame).is_none()) {
            values.insert(velocity_key(frame), twist);
        }
        values
    }

    fn factors(&self, step: &MotionStep<'_>) -> Result<Vec<FactorEntry>, MotionError> {
        // the prior is added together with the first velocity
        let first = velocity(step, step.frames[0]).is_none().then(|| self.first(step));
        first.into_iter().chain([self.entry(step)]).collect()
    }

    fn prefixes(&self) -> &'static [&'static str] {
        &["v"]
    }
}
register!(dyn MotionModel, "constant_velocity", ConstantVelocityMotion);
