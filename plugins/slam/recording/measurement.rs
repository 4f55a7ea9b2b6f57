//! The seam of measurements: quantities that a detection measures of its object besides its box, such as a [`Depth`].
//!
//! A kind of measurement is one file: it implements [`Measurement`] and ends with `register_measurement!`. Its name is then a field of a
//! box in JSON lines; its factor is in the graph, and its innovation counts in data association.
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

pub use depth::Depth;

/// Most rows of one measurement.
pub const ROWS: usize = 4;

/// A number for each row of a measurement; those beyond its own are not looked at.
pub type Rows = SVector<f64, ROWS>;

/// A quantity that a detection measures of its object besides its box.
pub trait Measurement: Debug + Send + Sync {
    /// Name of the field in JSON lines.
    fn name(&self) -> &'static str;

    /// The value of that field.
    fn to_value(&self) -> Value;

    /// Factor between the pose of the camera, world from camera, and the object; of one to [`ROWS`] rows.
    fn factor(&self) -> Arc<dyn Factor>;

    /// Rows of the factor, one to [`ROWS`].
    fn rows(&self) -> usize {
        self.factor().erased().signature().rows.unwrap_or(ROWS).min(ROWS)
    }

    /// Standard deviations of the rows, if their residual is `residual`.
    fn deviations(&self, errors: &Errors, residual: &Rows) -> Rows;

    /// -2 ln of the density of the measured value for an object that was never seen.
    fn cost_of_new(&self, usual: &UsualDepth) -> f64;

    /// Distance of the object's centre along the optical axis, in metres, if that is measured: it places new objects.
    fn depth(&self) -> Option<f64> {
        None
    }

    /// Residual of the [factor](Self::factor) and its derivatives; `None` if it is not defined.
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

/// Errors of measurements, by the settings.
#[derive(Debug, Clone, Copy)]
pub struct Errors {
    /// Standard deviation of depths, as a share of the depth.
    pub depth: f64,
}

/// Distance of objects from the camera, as far as others show it.
#[derive(Debug, Clone, Copy)]
pub struct UsualDepth {
    /// In metres.
    pub depth: f64,
    /// Standard deviation of its logarithm.
    pub spread: f64,
}

/// Difference between a predicted and a measured quantity, with derivatives by the tangents of pose and object.
#[derive(Debug, Clone, Copy)]
pub struct Innovation {
    /// Rows that count; the others are zero.
    pub rows: usize,
    /// Predicted less measured.
    pub residual: Rows,
    /// By the tangent of the pose.
    pub by_pose: SMatrix<f64, ROWS, 6>,
    /// By the tangent of the object.
    pub by_object: SMatrix<f64, ROWS, 9>,
}

impl Innovation {
    /// Zeros for so many rows.
    pub fn none(rows: usize) -> Self {
        let (by_pose, by_object) = (SMatrix::zeros(), SMatrix::zeros());
        Self { rows, residual: Rows::zeros(), by_pose, by_object }
    }
}

impl UsualDepth {
    /// -2 ln of the density of a new object's depth.
    pub fn cost(&self, depth: f64) -> f64 {
        let spread = self.spread;
        ((depth / self.depth).ln() / spread).powi(2) + TAU.ln() + 2.0 * (spread * depth).ln()
    }
}

/// The measurements of one detection besides its box.
#[derive(Debug, Clone, Default)]
pub struct Quantities(Vec<Arc<dyn Measurement>>);

impl Quantities {
    /// Nothing but the box.
    pub const NONE: Self = Self(vec![]);

    /// One measurement.
    pub fn one(measurement: impl Measurement + 'static) -> Self {
        Self(vec![Arc::new(measurement)])
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &dyn Measurement> {
        self.0.iter().map(|measurement| &**measurement)
    }

    /// Returns whether there is nothing but the box.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Rows of all factors together.
    pub fn rows(&self) -> usize {
        self.iter().map(Measurement::rows).sum()
    }

    /// Distance of the object's centre along the optical axis, in metres, if that is measured.
    pub fn depth(&self) -> Option<f64> {
        self.iter().find_map(Measurement::depth)
    }

    /// Factors of a frame and an object. A measurement whose deviations are no noise has none, which is logged.
    pub fn entries<'a>(
        &'a self,
        frame: usize,
        object: &'a Key,
        errors: Errors,
        loss: Option<&'a Arc<dyn Loss>>,
    ) -> impl Iterator<Item = FactorEntry> + 'a {
        self.iter().filter_map(move |measurement| {
            let deviations = measurement.deviations(&errors, &Rows::zeros());
            let noise = match &deviations.as_slice()[..measurement.rows().min(ROWS)] {
                [sigma] => Noise::sigma(*sigma),
                sigmas => Noise::sigmas(sigmas),
            };
            let log = |why: &dyn Display| {
                let name = measurement.name();
                tracing::warn!("`{name}` of {object} in frame {frame} is left out: {why}");
            };
            let noise = noise.inspect_err(|why| log(why)).ok()?;
            let (keys, factor) = (vec![pose_key(frame), object.clone()], measurement.factor());
            Some(FactorEntry { keys, name: None, factor, noise, loss: loss.cloned() })
        })
    }

    /// As the fields of a box in JSON lines.
    pub(crate) fn to_fields(&self) -> impl Iterator<Item = (String, Value)> + '_ {
        self.iter().map(|measurement| (measurement.name().to_owned(), measurement.to_value()))
    }

    /// Reads the fields of a box in JSON lines that are none of its own; `null` is not measured.
    ///
    /// # Errors
    /// A field that is no kind of measurement, where `others` are the fields that a box has besides, or one that cannot be read.
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

impl PartialEq for Quantities {
    fn eq(&self, other: &Self) -> bool {
        self.to_fields().eq(other.to_fields())
    }
}

/// A kind of measurement that JSON lines can have. Written by [`register_measurement!`](crate::register_measurement).
pub struct MeasurementKind {
    /// Name of its field.
    pub name: &'static str,
    /// Reads the field.
    pub read: fn(Value) -> Result<Arc<dyn Measurement>, serde_json::Error>,
}

inventory::collect!(MeasurementKind);

/// Registers a [`Measurement`](crate::measurement::Measurement) that serde can read: `register_measurement!("depth", Depth);`
#[macro_export]
macro_rules! register_measurement {
    ($name:literal, $type:ty) => {
        $crate::__private::inventory::submit! {
            $crate::measurement::MeasurementKind {
                name: $name,
                read: |value| Ok(::std::sync::Arc::new($crate::__private::serde_json::from_value::<$type>(value)?)),
            }
        }
    };
}
