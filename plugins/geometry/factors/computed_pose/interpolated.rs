//! Factors on the pose at a time between two poses.
use super::interpolation::Interpolation;
use super::{TimeOffset, variable_names};
use crate::{Point1, Se3};
use manifactor_graph::prelude::*;
use manifactor_graph::{
    AsVariable, Dynamic, DynamicBlocks, DynamicResidual, ErasedResidual, Factor, Variable, WrongRows,
    as_variable, register,
};
use std::any::{Any, TypeId};
use std::sync::Arc;

/// A factor on the pose at a time between two poses, for measurements with timestamps of their own.
///
/// Variables: as in `factor`, with the two poses in the place of its pose; then the time offset (`point1`) if it is a
/// variable. Factors of one camera share this variable by its key, to estimate the offset between two clocks. Rows and
/// noise are those of `factor`.
///
/// The pose belongs to `time` + `time_offset` on the clock of the poses. It is X₀ Exp(s Log(X₀⁻¹ X₁)) with s = (`time` +
/// `time_offset` - t₀) / (t₁ - t₀). The sign follows `timeshift_cam_imu` of Kalibr: t_imu = t_cam + shift. The
/// formula is linear interpolation on SE(3), with constant velocity in the frame of the body; see Barfoot, *State
/// Estimation for Robotics*, 2017.
///
/// Before and after the two times, the motion goes on with the same velocity. The factor is not defined more than one
/// interval away, or if the poses differ by a rotation of more than 3.1 rad; it is inactive there.
///
/// ```toml
/// [[factors]]
/// keys = ["x0", "x1", "l0", "offset"]
/// noise = { sigma = 1.0 }
///
/// [factors.factor]
/// type = "interpolated"
/// times = [12.0, 13.0]
/// time = 12.4
/// time_offset = "variable"
/// factor = { type = "projection", pixel = [310.0, 262.5], camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 } }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Document", into = "Document")]
#[schemars(with = "Document")]
pub struct Interpolated {
    document: Document,
    compiled: Dynamic<Compiled>,
}

#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Interpolated")]
struct Document {
    /// Factor with a variable of type `se3`.
    factor: Arc<dyn Factor>,
    /// Times of the two poses, in increasing order. Unit: seconds.
    times: [f64; 2],
    /// Time of the measurement. Unit: seconds.
    time: f64,
    /// Time on the clock of the poses minus time on the clock of the measurement: a number, or `"variable"` for a
    /// further variable of type `point1`, the last one. Default: 0. Unit: seconds.
    #[serde(default, skip_serializing_if = "TimeOffset::is_zero")]
    time_offset: TimeOffset,
    /// Variable of `factor` that the two poses replace, as an index from 0. Default: the first of type `se3`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pose: Option<usize>,
}

/// The reason why a factor cannot be used between two poses.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InterpolatedError {
    /// `pose` is not the index of a pose.
    #[error(
        "`pose` names variable {place}, but the factor has the variables {found}: expected the index of an `se3`, from 0"
    )]
    NoPose {
        /// The index.
        place: usize,
        /// Types of the factor's variables.
        found: String,
    },
    /// The factor has no pose as a variable, or any number of variables.
    #[error("expected a factor with a fixed number of variables and a pose (`se3`) among them, got {found}")]
    NoPoses {
        /// Types of the factor's variables.
        found: String,
    },
    /// The times of the two poses do not increase, or are not finite.
    #[error("`times` are {} s and {} s: expected two finite times, the second one later than the first", times[0], times[1])]
    Times {
        /// The times, in seconds.
        times: [f64; 2],
    },
    /// The measurement is too far from the two poses, or its time is not finite.
    #[error(
        "the measurement is at {time} s on the clock of the poses, and they are at {} s and {} s: expected two poses \
         around it, or at most one interval away", times[0], times[1]
    )]
    Outside {
        /// `time` plus a constant `time_offset`, in seconds.
        time: f64,
        /// Times of the poses, in seconds.
        times: [f64; 2],
    },
    /// The factor has too many rows.
    #[error(transparent)]
    Rows(#[from] WrongRows),
}

impl Interpolated {
    /// Creates a factor on two poses at `times` from a factor on the pose at `time + time_offset`; all in seconds.
    /// `pose` is the index of that pose among the variables of the factor; `None` for the first of type [`Se3`].
    ///
    /// # Errors
    /// If the factor has no such variable, has any number of variables, or has too many rows; if the times are not
    /// finite or do not increase; if a measurement with a constant offset is more than one interval away from the poses.
    pub fn new(
        factor: Arc<dyn Factor>,
        times: [f64; 2],
        time: f64,
        time_offset: impl Into<TimeOffset>,
        pose: Option<usize>,
    ) -> Result<Self, InterpolatedError> {
        let signature = factor.erased().signature();
        let found = || variable_names(&signature);
        let is_pose = |id: &TypeId| *id == TypeId::of::<Se3>();
        let place = match pose {
            Some(place) if !signature.variables.get(place).is_some_and(is_pose) => {
                return Err(InterpolatedError::NoPose { place, found: found() });
            }
            Some(place) => Some(place),
            None => signature.variables.iter().position(is_pose),
        };
        let place = place.filter(|_| !signature.many);
        let place = place.ok_or_else(|| InterpolatedError::NoPoses { found: found() })?;
        let interval = times[1] - times[0];
        if !(interval > 0.0 && interval.is_finite()) {
            return Err(InterpolatedError::Times { times });
        }
        let time_offset = time_offset.into();
        let elapsed = time - times[0];
        let is_within = match time_offset {
            TimeOffset::Constant(offset) => {
                Interpolation::FRACTIONS.contains(&((elapsed + offset) / interval))
            }
            // a clock may be far off; the initial value of the variable brings the time between the poses
            TimeOffset::Variable => elapsed.is_finite(),
        };
        if !is_within {
            return Err(InterpolatedError::Outside {
                time: time + time_offset.constant().unwrap_or(0.0),
                times,
            });
        }
        let mut types = signature.variables.clone();
        types.insert(place, TypeId::of::<Se3>());
        if time_offset == TimeOffset::Variable {
            types.push(TypeId::of::<Point1>());
        }
        let casts: Vec<_> = types.iter().filter_map(|id| as_variable(*id)).collect();
        let compiled = Dynamic::new(Compiled {
            place,
            elapsed,
            interval,
            offset: time_offset.constant(),
            dimensions: casts.iter().map(|cast| cast.dimension).collect(),
            rows: signature.rows.unwrap_or(0),
            factor: factor.clone(),
            types,
            casts,
        })?;
        Ok(Self { document: Document { factor, times, time, time_offset, pose }, compiled })
    }
}

impl TryFrom<Document> for Interpolated {
    type Error = InterpolatedError;
    fn try_from(document: Document) -> Result<Self, InterpolatedError> {
        let Document { factor, times, time, time_offset, pose } = document;
        Self::new(factor, times, time, time_offset, pose)
    }
}

impl From<Interpolated> for Document {
    fn from(factor: Interpolated) -> Self {
        factor.document
    }
}

#[typetag::serialize(name = "interpolated")]
impl Factor for Interpolated {
    #[inline(never)]
    fn erased(&self) -> &dyn ErasedResidual {
        &self.compiled
    }
    fn with_up(&self, up: manifactor_graph::Direction) -> Option<Box<dyn Factor>> {
        let Document { factor, times, time, time_offset, pose } = &self.document;
        let filled = Self::new(factor.with_up(up)?.into(), *times, *time, *time_offset, *pose).ok()?;
        Some(Box::new(filled))
    }
}
register!(dyn Factor, "interpolated", Interpolated);

/// The factor with its inputs looked up.
#[derive(Debug, Clone)]
struct Compiled {
    factor: Arc<dyn Factor>,
    /// Index of the first of the two poses, and of the pose of `factor`.
    place: usize,
    /// Time from the first pose to the measurement, without the offset, in seconds.
    elapsed: f64,
    /// Time from the first pose to the second one, in seconds.
    interval: f64,
    /// `None` if the offset is the last variable.
    offset: Option<f64>,
    types: Vec<TypeId>,
    dimensions: Vec<usize>,
    casts: Vec<&'static AsVariable>,
    rows: usize,
}

impl Compiled {
    /// Returns the pose at the time of the measurement. `None` if a variable is of another type.
    fn interpolation(&self, variables: &[&dyn Any]) -> Option<Interpolation> {
        let pose = |i: usize| variables.get(i)?.downcast_ref::<Se3>();
        let (first, second) = (pose(self.place)?, pose(self.place + 1)?);
        let offset = match self.offset {
            Some(constant) => constant,
            None => variables.last()?.downcast_ref::<Point1>()?.x,
        };
        Some(Interpolation::new(first, second, (self.elapsed + offset) / self.interval))
    }

    /// Returns the index among the variables for a variable of `factor`, the first one for its pose.
    fn outer_index(&self, inner: usize) -> usize {
        inner + usize::from(inner > self.place)
    }

    /// Returns the result of `run` for the variables of `factor` with this pose.
    fn with_pose<R>(
        &self,
        pose: &Se3,
        variables: &[&dyn Any],
        run: impl FnOnce(&dyn ErasedResidual, &[&dyn Variable]) -> Option<R>,
    ) -> Option<R> {
        let count = self.types.len() - 1 - usize::from(self.offset.is_none());
        let given = |inner: usize| {
            let outer = self.outer_index(inner);
            if inner == self.place {
                Some(pose as &dyn Variable)
            } else {
                (self.casts[outer].cast)(variables[outer])
            }
        };
        let inner: Vec<&dyn Variable> = (0..count).filter_map(given).collect();
        run(self.factor.erased(), &inner)
    }
}

impl DynamicResidual for Compiled {
    fn rows(&self) -> usize {
        self.rows
    }
    fn variables(&self) -> &[TypeId] {
        &self.types
    }
    fn dimensions(&self) -> &[usize] {
        &self.dimensions
    }
    fn is_defined(&self, variables: &[&dyn Any]) -> bool {
        self.interpolation(variables).is_some_and(|interpolation| {
            interpolation.is_defined()
                && self
                    .with_pose(&interpolation.pose, variables, |factor, x| factor.is_defined(x))
                    .unwrap_or(false)
        })
    }
    fn residual(&self, variables: &[&dyn Any], residual: &mut [f64]) {
        let Some(interpolation) = self.interpolation(variables) else { return };
        if let Some(rows) = self.with_pose(&interpolation.pose, variables, |factor, x| factor.residual(x)) {
            residual.copy_from_slice(&rows);
        }
    }
    fn linearize(
        &self,
        variables: &[&dyn Any],
        free: &[bool],
        residual: &mut [f64],
        blocks: &mut DynamicBlocks,
    ) {
        let Some(interpolation) = self.interpolation(variables) else { return };
        let linear = self.with_pose(&interpolation.pose, variables, |factor, x| factor.linearize(x));
        let Some(linear) = linear else { return };
        residual.copy_from_slice(&linear.residual);
        for (inner, jacobian) in linear.jacobians.iter().enumerate() {
            let outer = self.outer_index(inner);
            if inner != self.place && free[outer] {
                blocks.block_mut(outer).copy_from_slice(jacobian.as_slice());
            }
        }
        let by_pose = &linear.jacobians[self.place];
        let derivatives = interpolation.derivatives();
        for (outer, derivative) in (self.place..).zip(&derivatives.by_poses) {
            if free[outer] {
                blocks.block_mut(outer).copy_from_slice((by_pose * derivative).as_slice());
            }
        }
        let last = self.types.len() - 1;
        if self.offset.is_none() && free[last] {
            let by_offset = by_pose * (derivatives.by_fraction / self.interval);
            blocks.block_mut(last).copy_from_slice(by_offset.as_slice());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;
    use crate::{Between, OnBody};
    use manifactor_testing::{JacobianLaw, factor_laws};
    use proptest::prelude::*;

    factor_laws! { interpolated }

    const TIMES: [f64; 2] = [12.0, 12.5];

    /// Two poses with a rotation of up to 2.8 rad between them.
    fn any_poses() -> impl Strategy<Value = [Se3; 2]> {
        (any_se3(), se3_tangent()).prop_map(|(x, d)| [x, x.retract(&(0.9 * d))])
    }

    /// A factor that measures `pose` in the frame of `frame`, its first variable, with an error.
    fn measurement(frame: &Se3, pose: &Se3, error: Vector6<f64>) -> Between<Se3> {
        Between { relative: frame.between(pose).retract(&(0.3 * error)) }
    }

    fn at(fraction: f64) -> f64 {
        TIMES[0] + fraction * (TIMES[1] - TIMES[0])
    }

    fn rows(factor: &dyn Factor, variables: &[&dyn Variable]) -> Vector6<f64> {
        Vector6::from_vec(factor.erased().residual(variables).unwrap())
    }

    proptest! {
        #[test]
        fn at_the_times_of_the_poses_it_is_the_factor_of_each(
            (frame, [x, y], d) in (any_se3(), any_poses(), se3_tangent()),
        ) {
            for (time, pose) in TIMES.into_iter().zip([x, y]) {
                let inner = measurement(&frame, &pose, d);
                let outer = Interpolated::new(Arc::new(inner.clone()), TIMES, time, 0.0, Some(1)).unwrap();
                let difference = rows(&outer, &[&frame, &x, &y]) - rows(&inner, &[&frame, &pose]);
                prop_assert!(difference.norm() < 1e-9, "{difference}");
            }
        }

        #[test]
        fn a_body_with_constant_velocity_is_at_the_interpolated_pose(
            (frame, x, d) in (any_se3(), any_se3(), se3_tangent()),
            fraction in -1.0..2.0_f64,
            known in 0.0..1.0_f64,
        ) {
            let y = x.retract(&(0.9 * d));
            let inner = measurement(&frame, &x.retract(&(0.9 * fraction * d)), Vector6::zeros());
            let offset = (fraction - known) * (TIMES[1] - TIMES[0]);
            let constant = Interpolated::new(Arc::new(inner.clone()), TIMES, at(known), offset, Some(1)).unwrap();
            let r = rows(&constant, &[&frame, &x, &y]);
            prop_assert!(r.norm() < 1e-8, "{r}");
            let variable =
                Interpolated::new(Arc::new(inner), TIMES, at(known), TimeOffset::Variable, Some(1)).unwrap();
            let r = rows(&variable, &[&frame, &x, &y, &Point1::new([offset])]);
            prop_assert!(r.norm() < 1e-8, "{r}");
        }

        #[test]
        fn jacobians_agree(
            (frame, [x, y], d) in (any_se3(), any_poses(), se3_tangent()),
            fraction in -0.9..1.9_f64,
            offset in -0.02..0.02_f64,
        ) {
            let pose = x.retract(&(fraction * x.local(&y)));
            let inner: Arc<dyn Factor> = Arc::new(measurement(&frame, &pose, d));
            let time = at(fraction) - offset;
            let (law, offsets) = (JacobianLaw::default(), [TimeOffset::Constant(offset), TimeOffset::Variable]);
            for time_offset in offsets {
                // the two poses are the last variables of the factor, then the first ones
                for (place, inner) in [(1, inner.clone()), (0, Arc::new(measurement(&pose, &frame, d)))] {
                    let factor = Interpolated::new(inner, TIMES, time, time_offset, Some(place)).unwrap();
                    let free = Point1::new([offset]);
                    let mut variables: Vec<&dyn Variable> = vec![&x, &y];
                    variables.insert(2 * (1 - place), &frame);
                    variables.extend((time_offset == TimeOffset::Variable).then_some(&free as &dyn Variable));
                    law.check(&factor, &variables).unwrap();
                }
            }
        }
    }

    #[test]
    fn the_other_variables_stay_in_order() {
        // x rotates by 90° in 1 s and is the body, with a camera 1 m ahead
        let turn = |angle: f64| Se3::exp(&Vector6::new(0.0, 0.0, angle, 0.0, 0.0, 0.0));
        let ahead = Se3::exp(&Vector6::new(0.0, 0.0, 0.0, 1.0, 0.0, 0.0));
        let seen = measurement(&Se3::identity(), &turn(0.5), Vector6::zeros());
        let on_body = OnBody::new(Arc::new(seen), None, Some(vec![1])).unwrap();
        let factor =
            Interpolated::new(Arc::new(on_body), [0.0, 1.0], 0.2, TimeOffset::Variable, Some(1)).unwrap();
        let (first, second) = (ahead, turn(1.0).compose(&ahead));
        let r = rows(&factor, &[&Se3::identity(), &first, &second, &ahead, &Point1::new([0.3])]);
        assert!(r.norm() < 1e-12, "{r}");
    }

    #[test]
    fn it_is_defined_near_the_two_poses_that_are_less_than_half_a_turn_apart() {
        let inner = Arc::new(measurement(&Se3::identity(), &Se3::identity(), Vector6::zeros()));
        let factor = Interpolated::new(inner, TIMES, TIMES[0], TimeOffset::Variable, Some(1)).unwrap();
        let is_defined = |offset: f64, angle: f64| {
            let second = Se3::exp(&Vector6::new(angle, 0.0, 0.0, 1.0, 0.0, 0.0));
            let poses: [&dyn Variable; 4] =
                [&Se3::identity(), &Se3::identity(), &second, &Point1::new([offset])];
            factor.erased().is_defined(&poses).unwrap()
        };
        assert!(is_defined(-0.49, 0.1) && is_defined(0.99, 3.0));
        assert!(!is_defined(-0.51, 0.1) && !is_defined(1.01, 0.1) && !is_defined(0.2, 3.12));
    }

    #[test]
    fn a_wrong_document_is_refused() {
        let read = |fields: &str| serde_json::from_str::<Interpolated>(&format!("{{{fields}}}"));
        let refused = |fields: &str, expected: &str| {
            let error = read(fields).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        };
        let between = r#""factor": {"type": "between_se3", "relative": {"translation": [1,0,0], "rotation": [0,0,0,1]}}"#;
        let point = r#""factor": {"type": "between_point2", "relative": {"position": [1, 0]}}"#;
        let times = r#""times": [1.0, 1.5], "time": 1.2"#;
        for more in ["", r#", "time_offset": -0.2"#, r#", "time_offset": "variable", "pose": 1"#] {
            let written =
                serde_json::to_string(&read(&format!("{between}, {times}{more}")).unwrap()).unwrap();
            assert!(
                written.ends_with(&format!("{more}}}").replace(": ", ":").replace(", ", ",")),
                "{written}"
            );
            let again = serde_json::from_str::<Interpolated>(&written).unwrap();
            assert_eq!(serde_json::to_string(&again).unwrap(), written);
        }
        refused(&format!("{point}, {times}"), "point2, point2");
        refused(&format!(r#"{between}, {times}, "pose": 2"#), "`pose` names variable 2");
        refused(&format!(r#"{between}, "times": [1.5, 1.0], "time": 1.2"#), "`times` are 1.5 s and 1 s");
        refused(&format!(r#"{between}, "times": [1.0, 1.0], "time": 1.0"#), "later than the first");
        refused(&format!(r#"{between}, "times": [1.0, 1.5], "time": 3.0"#), "at most one interval away");
        refused(&format!(r#"{between}, {times}, "time_offset": 1.0"#), "at 2.2 s");
        refused(&format!(r#"{between}, {times}, "time_offset": "free""#), "variable");
        refused(
            &format!(r#"{between}, {times}, "time_offset": true"#),
            "a number of seconds or \"variable\"",
        );
        // a clock may be far off
        assert!(
            read(&format!(r#"{between}, "times": [1.0, 1.5], "time": 90.0, "time_offset": "variable""#))
                .is_ok()
        );
        let inner = || Arc::new(measurement(&Se3::identity(), &Se3::identity(), Vector6::zeros()));
        assert!(Interpolated::new(inner(), [1.0, f64::NAN], 1.0, 0.0, None).is_err());
        assert!(Interpolated::new(inner(), TIMES, f64::NAN, TimeOffset::Variable, None).is_err());
        assert!(Interpolated::new(inner(), TIMES, 12.0, f64::INFINITY, None).is_err());
    }
}
