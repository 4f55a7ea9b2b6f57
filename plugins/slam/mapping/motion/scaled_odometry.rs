use super::{MotionError, MotionModel, MotionStep, pose_key};
use manifactor_geometry::{Between, LieGroup, Point1, Prior, ScaledBetween, Se3};
use manifactor_graph::checked::Positive;
use manifactor_graph::{Factor, FactorEntry, Key, Noise, Values, register};
use nalgebra::Vector1;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Odometry with an unknown scale, as a camera without depth measures it. The scale is a variable: `s0` for the
/// whole trajectory, or one for each frame if it drifts.
///
/// The variables are logarithms of the scale, in metres per unit of the odometry. A prior keeps the first one near
/// zero. Noise and loss are those of `[odometry]`, with translations in the unit of the odometry. Something else has to
/// determine the scale: the sizes of objects (`sizes = "household"`), depths, or loop closures.
///
/// ```toml
/// motion = { type = "scaled_odometry", drift = 0.01 }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "ScaledOdometry")]
pub struct ScaledOdometryMotion {
    /// Standard deviation of the logarithm of the first scale: with 1, the scale is within a factor of 2.7.
    pub first: Positive,
    /// Standard deviation of the change of the logarithm in one second; it grows with the root of time. Without it,
    /// the scale is constant. Unit: 1/√s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drift: Option<Positive>,
}

impl Default for ScaledOdometryMotion {
    fn default() -> Self {
        Self { first: Positive::literal(1.0), drift: None }
    }
}

impl ScaledOdometryMotion {
    /// Returns the key of the scale of the step from a frame to the next.
    fn scale_key(&self, frame: usize) -> Key {
        Key::indexed("s", if self.drift.is_some() { frame } else { 0 })
    }

    /// Returns the estimated logarithm of the scale of the step from a frame.
    fn scale(&self, step: &MotionStep<'_>, frame: usize) -> Option<f64> {
        let estimate = (step.estimates)(self.scale_key(frame).as_str())?;
        estimate.erased().as_any().downcast_ref::<Point1>().map(|scale| scale.0.x)
    }

    /// Returns the last estimated logarithm of the scale before a step, or zero.
    fn last_scale(&self, step: &MotionStep<'_>) -> f64 {
        let [from, _] = step.frames;
        let before = from.checked_sub(1).and_then(|before| self.scale(step, before));
        self.scale(step, from).or(before).unwrap_or_default()
    }

    /// Returns the factor on a scale that is new in this step: the prior on the first one, or its change since
    /// the step before.
    fn of_new_scale(&self, step: &MotionStep<'_>) -> Result<FactorEntry, MotionError> {
        let [from, _] = step.frames;
        let key = self.scale_key(from);
        let (keys, factor, sigma): (_, Arc<dyn Factor>, _) = match (self.drift, from) {
            (Some(drift), 1..) => {
                let keys = vec![self.scale_key(from - 1), key];
                (keys, Arc::new(Between { relative: Point1::identity() }), *drift * step.seconds.sqrt())
            }
            _ => (vec![key], Arc::new(Prior { value: Point1::identity() }), *self.first),
        };
        let noise = Noise::sigma(sigma).map_err(|error| step.error(&error))?;
        Ok(FactorEntry { keys, name: None, factor, noise, loss: None })
    }
}

#[typetag::serialize(name = "scaled_odometry")]
impl MotionModel for ScaledOdometryMotion {
    fn predict(&self, step: &MotionStep<'_>, from: &Se3) -> Se3 {
        let Se3 { rotation, translation } = step.odometry.pose;
        from.compose(&Se3::new(rotation, translation * self.last_scale(step).exp()))
    }

    fn variables(&self, step: &MotionStep<'_>, _poses: [&Se3; 2]) -> Values {
        let [from, _] = step.frames;
        let mut values = Values::new();
        if self.scale(step, from).is_none() {
            values.insert(self.scale_key(from), Point1::new(Vector1::new(self.last_scale(step))));
        }
        values
    }

    fn factors(&self, step: &MotionStep<'_>) -> Result<Vec<FactorEntry>, MotionError> {
        let [from, to] = step.frames;
        let keys = vec![pose_key(from), pose_key(to), self.scale_key(from)];
        let measured = step.entry(keys, Arc::new(ScaledBetween { relative: step.odometry.pose }));
        let is_new = self.scale(step, from).is_none();
        let new = is_new.then(|| self.of_new_scale(step)).transpose()?;
        Ok(new.into_iter().chain([measured]).collect())
    }

    fn prefixes(&self) -> &'static [&'static str] {
        &["s"]
    }

    fn lasting_types(&self) -> &'static [&'static str] {
        if self.drift.is_some() { &[] } else { &["point1"] }
    }
}
register!(dyn MotionModel, "scaled_odometry", ScaledOdometryMotion);
