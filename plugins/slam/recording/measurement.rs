//! Interface of measurements: quantities that a detection measures in addition to its box, such as a
//! [`DepthMeasurement`].
//!
//! A type of measurement is one file: it implements [`Measurement`] and ends with `register_measurement!`.
//! Its name becomes a field of a box in JSON lines. Its factor is added to the graph, and data association
//! uses its innovation.
use crate::camera::MountedCamera;
use crate::keys::pose_key;
use manifactor_geometry::Se3;
use manifactor_graph::loss::Loss;
use manifactor_graph::{Factor, FactorEntry, Key, Noise, Variable};
use manifactor_quadric::DualQuadric;
use nalgebra::{SMatrix, SVector};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::{Debug, Display};
use std::sync::Arc;

mod depth;

pub use depth::DepthMeasurement;

/// Largest number of rows of one measurement.
pub const ROWS: usize = 4;

/// One number for each row of a measurement; further entries are ignored.
pub type ResidualRows = SVector<f64, ROWS>;

/// A quantity that a detection measures of its object in addition to its box.
pub trait Measurement: Debug + Send + Sync {
    /// Returns the name of the field in JSON lines.
    fn name(&self) -> &'static str;

    /// Returns the value of that field.
    fn to_value(&self) -> Value;

    /// Returns the factor between the camera pose, world from camera, and the object; it has one to [`ROWS`]
    /// rows.
    fn factor(&self) -> Arc<dyn Factor>;

    /// Returns the number of rows of the factor, one to [`ROWS`].
    fn rows(&self) -> usize {
        self.factor().erased().signature().rows.unwrap_or(ROWS).min(ROWS)
    }

    /// Returns the standard deviations of the rows if the factor's residual is `residual`.
    fn deviations(&self, errors: &MeasurementSigmas, residual: &ResidualRows) -> ResidualRows;

    /// Returns -2 ln of the density of the measured value for an object that was never detected before.
    fn cost_of_new(&self, usual: &UsualDepth) -> f64;

    /// Returns the distance of the object's centre along the optical axis in metres, if measured. New objects
    /// are initialized with it.
    fn depth(&self) -> Option<f64> {
        None
    }

    /// Returns the measurement in the frame of a camera at the same place that looks at the object, for boxes of wide
    /// lenses. The argument is the cosine of the angle between the two optical axes. With `None`, the box is used without the
    /// measurement.
    fn turned(&self, _cosine: f64) -> Option<Arc<dyn Measurement>> {
        None
    }

    /// Returns the residual of the [factor](Self::factor) and its derivatives; `None` if it is undefined.
    fn innovation(&self, pose: &Se3, object: &DualQuadric) -> Option<Innovation> {
        let factor = self.factor();
        let variables: [&dyn Variable; 2] = [pose, object];
        let is_defined = factor.erased().is_defined(&variables)?;
        let linear = factor.erased().linearize(&variables).filter(|_| is_defined)?;
        let [by_pose, by_object] = &linear.jacobians[..] else { return None };
        let mut innovation = Innovation::none(linear.residual.len().min(ROWS));
        for i in 0..innovation.rows {
            innovation.residual[i] = linear.residual[i];
            innovation.by_pose.row_mut(i).copy_from(&by_pose.row(i));
            innovation.by_object.row_mut(i).copy_from(&by_object.row(i));
        }
        Some(innovation)
    }
}

/// Errors of measurements from the settings.
#[derive(Debug, Clone, Copy)]
pub struct MeasurementSigmas {
    /// Standard deviation of depths, as a fraction of the depth.
    pub depth: f64,
}

/// Usual distance of objects from the camera, estimated from known objects.
#[derive(Debug, Clone, Copy)]
pub struct UsualDepth {
    /// Depth. Unit: metres.
    pub depth: f64,
    /// Standard deviation of the logarithm of the depth.
    pub spread: f64,
}

/// Difference between a predicted and a measured quantity, with derivatives in the tangent spaces of pose and
/// object.
#[derive(Debug, Clone, Copy)]
pub struct Innovation {
    /// Number of valid rows; the remaining rows are zero.
    pub rows: usize,
    /// Predicted minus measured value.
    pub residual: ResidualRows,
    /// Derivative with respect to the tangent of the pose.
    pub by_pose: SMatrix<f64, ROWS, 6>,
    /// Derivative with respect to the tangent of the object.
    pub by_object: SMatrix<f64, ROWS, 9>,
}

impl Innovation {
    /// Returns zeros for this number of rows.
    pub fn none(rows: usize) -> Self {
        let (by_pose, by_object) = (SMatrix::zeros(), SMatrix::zeros());
        Self { rows, residual: ResidualRows::zeros(), by_pose, by_object }
    }
}

impl UsualDepth {
    /// Returns -2 ln of the density of a new object's depth.
    pub fn cost(&self, depth: f64) -> f64 {
        let spread = self.spread;
        ((depth / self.depth).ln() / spread).powi(2) + TAU.ln() + 2.0 * (spread * depth).ln()
    }
}

/// All measurements of one detection in addition to its box.
#[derive(Debug, Clone, Default)]
pub struct Quantities(Vec<Arc<dyn Measurement>>);

impl Quantities {
    /// No measurement besides the box.
    pub const NONE: Self = Self(vec![]);

    /// Returns a single measurement.
    pub fn one(measurement: impl Measurement + 'static) -> Self {
        Self(vec![Arc::new(measurement)])
    }

    /// Iterates over the measurements.
    pub fn iter(&self) -> impl Iterator<Item = &dyn Measurement> {
        self.0.iter().map(|measurement| &**measurement)
    }

    /// Returns whether there is no measurement besides the box.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the total number of rows of all factors.
    pub fn rows(&self) -> usize {
        self.iter().map(Measurement::rows).sum()
    }

    /// Returns the distance of the object's centre along the optical axis in metres, if measured.
    pub fn depth(&self) -> Option<f64> {
        self.iter().find_map(Measurement::depth)
    }

    /// Converts the measurements to a camera at the same place that looks at the object. `cosine` belongs to the angle
    /// between the two optical axes. A measurement that cannot be converted is left out and logged.
    pub(crate) fn turned(&self, cosine: f64) -> Self {
        let turned = |measurement: &dyn Measurement| {
            let turned = measurement.turned(cosine);
            if turned.is_none() {
                let angle = cosine.acos().to_degrees();
                tracing::warn!(
                    "`{}` at {angle:.0}° from the axis of the lens is left out",
                    measurement.name()
                );
            }
            turned
        };
        self.iter().filter_map(turned).collect()
    }

    /// Returns the factors between a frame and an object that `camera` sees. A measurement with invalid standard deviations is
    /// skipped and logged.
    pub fn entries<'a>(
        &'a self,
        frame: usize,
        camera: &'a MountedCamera,
        object: &'a Key,
        errors: MeasurementSigmas,
        loss: Option<&'a Arc<dyn Loss>>,
    ) -> impl Iterator<Item = FactorEntry> + 'a {
        self.iter().filter_map(move |measurement| {
            let deviations = measurement.deviations(&errors, &ResidualRows::zeros());
            let noise = match &deviations.as_slice()[..measurement.rows().min(ROWS)] {
                [sigma] => Noise::sigma(*sigma),
                sigmas => Noise::sigmas(sigmas),
            };
            let log = |why: &dyn Display| {
                let name = measurement.name();
                tracing::warn!("`{name}` of {object} in frame {frame} is left out: {why}");
            };
            let noise = noise.inspect_err(|why| log(why)).ok()?;
            let factor = camera.on_first(measurement.factor()).inspect_err(|why| log(why)).ok()?;
            let keys = vec![pose_key(frame), object.clone()];
            Some(FactorEntry { keys, name: None, factor, noise, loss: loss.cloned() })
        })
    }

    /// Returns the measurements as fields of a box in JSON lines.
    pub(crate) fn to_fields(&self) -> impl Iterator<Item = (String, Value)> + '_ {
        self.iter().map(|measurement| (measurement.name().to_owned(), measurement.to_value()))
    }

    /// Reads the measurements from the remaining fields of a box in JSON lines; `null` means not measured.
    ///
    /// # Errors
    /// A field that is neither a type of measurement nor one of the box's `others`, or a value that cannot be
    /// read.
    pub fn read(fields: impl IntoIterator<Item = (String, Value)>, others: &[&str]) -> Result<Self, String> {
        let mut measured = vec![];
        for (name, value) in fields {
            let kind = inventory::iter::<MeasurementKind>.into_iter().find(|kind| kind.name == name);
            let Some(kind) = kind else {
                let mut known: Vec<&str> =
                    inventory::iter::<MeasurementKind>.into_iter().map(|kind| kind.name).collect();
                known.sort_unstable();
                let known: Vec<String> =
                    others.iter().chain(&known).map(|name| format!("`{name}`")).collect();
                return Err(format!("unknown field `{name}`, expected one of {}", known.join(", ")));
            };
            if !value.is_null() {
                measured.push((kind.read)(value).map_err(|error| format!("`{name}`: {error}"))?);
            }
        }
        Ok(Self(measured))
    }
}

impl FromIterator<Arc<dyn Measurement>> for Quantities {
    fn from_iter<I: IntoIterator<Item = Arc<dyn Measurement>>>(measurements: I) -> Self {
        Self(measurements.into_iter().collect())
    }
}

impl PartialEq for Quantities {
    fn eq(&self, other: &Self) -> bool {
        self.to_fields().eq(other.to_fields())
    }
}

/// A type of measurement in JSON lines. Created by [`register_measurement!`](crate::register_measurement).
pub struct MeasurementKind {
    /// Name of the field.
    pub name: &'static str,
    /// Returns the schema of the value.
    pub schema: fn() -> Value,
    /// Reads the value of the field.
    pub read: fn(Value) -> Result<Arc<dyn Measurement>, serde_json::Error>,
}

inventory::collect!(MeasurementKind);

/// Returns the registered fields of a box with their schemas.
pub(crate) fn measurement_schemas() -> impl Iterator<Item = (String, Value)> {
    inventory::iter::<MeasurementKind>.into_iter().map(|kind| (kind.name.to_owned(), (kind.schema)()))
}

/// Registers a [`Measurement`](crate::measurement::Measurement) that serde can read and schemars can describe:
/// `register_measurement!("depth", DepthMeasurement);`
#[macro_export]
macro_rules! register_measurement {
    ($name:literal, $type:ty) => {
        $crate::__private::inventory::submit! {
            $crate::measurement::MeasurementKind {
                name: $name,
                schema: || $crate::__private::schemars::schema_for!($type).to_value(),
                read: |value| Ok(::std::sync::Arc::new($crate::__private::serde_json::from_value::<$type>(value)?)),
            }
        }
    };
}
