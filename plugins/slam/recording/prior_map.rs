//! Map of an earlier run, whose objects are known at the start of this run.
//!
//! Each of its objects is a variable from the first frame on. A prior factor holds the object at its value in
//! the map, with the covariance of the map. Detections of the object become its measurements, and semantic
//! rules are not applied to it again.
use crate::class::ClassAliases;
use crate::fusion::ClassFusion;
use crate::keys::ObjectId;
use manifactor_config::{Diagnostics, Document, Errors, Fault};
use manifactor_graph::noise::NoiseError;
use manifactor_graph::{Direction, Noise};
use manifactor_quadric::DualQuadric;
use nalgebra::{DMatrix, SMatrix};
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

/// Objects and up direction in the frame of the map.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PriorMap {
    /// Version of the file format.
    #[serde(deserialize_with = "version")]
    version: u32,
    /// Up direction, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<Direction>,
    /// Objects, sorted by number.
    pub objects: Vec<Arc<PriorObject>>,
}

/// An object of a prior map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PriorObject {
    /// Number of the object.
    pub id: ObjectId,
    /// Class scores of its detections.
    pub classes: ClassFusion,
    /// Estimate in the map frame.
    pub quadric: DualQuadric,
    /// Covariance of the estimate in tangent order: rotation in rad and centre in m, both in the object's
    /// frame, then the logarithms of the semi-axes.
    pub covariance: [[f64; 9]; 9],
    /// Number of opportunities to detect the object, with and without a detection.
    #[serde(rename = "looks")]
    pub detection_counts: DetectionCounts,
    /// Smallest detected size in pixels: the square root of the box area. Default: unknown, as in maps of
    /// earlier programs.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "least_px")]
    pub least_px: Option<f64>,
    /// True if the shortest semi-axis is below 1/50 of the longest: the object was seen from one side, or is
    /// thin.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub flat: bool,
}

/// Number of opportunities to detect an object, and number of those with a detection. An opportunity groups
/// frames from nearby times and directions, because a detector that misses an object in one frame usually
/// misses it in the next as well.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectionCounts {
    /// Number of opportunities.
    pub expected: usize,
    /// Number of opportunities with at least one box.
    pub seen: usize,
}

/// Number of opportunities that the detection rate of one run counts for in another run. It is small, because
/// the rate depends on the sides from which an object is seen, and these differ between runs.
const RATE_STRENGTH: f64 = 4.0;

/// The only version so far.
const VERSION: u32 = 1;

fn version<'de, D: Deserializer<'de>>(from: D) -> Result<u32, D::Error> {
    let found = u32::deserialize(from)?;
    let told = || format!("a map of version {found}, and this program reads version {VERSION}");
    if found == VERSION { Ok(found) } else { Err(serde::de::Error::custom(told())) }
}

fn least_px<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    let told =
        |size: f64| serde::de::Error::custom(format!("a size of more than 0 pixels is expected, got {size}"));
    match Option::<f64>::deserialize(from)? {
        Some(size) if !(size.is_finite() && size > 0.0) => Err(told(size)),
        size => Ok(size),
    }
}

impl PriorMap {
    /// Creates a map of these objects.
    pub fn new(up: Option<Direction>, mut objects: Vec<Arc<PriorObject>>) -> Self {
        objects.sort_by_key(|object| object.id);
        Self { version: VERSION, up, objects }
    }

    /// Reads `map.json`, as written by a run.
    ///
    /// # Errors
    /// A missing file, or all errors in it, each with its position.
    pub fn read(path: &Path) -> Result<Self, Diagnostics> {
        let document = Document::open(path)?;
        let errors = Errors::new();
        let map = document.root().read::<Self>(&errors).map(|map| {
            let places = document.root().items("objects");
            let mut ids = HashSet::new();
            for (object, node) in map.objects.iter().zip(places) {
                if let Err(error) = object.noise() {
                    let place = node.field("covariance").unwrap_or(node).place.clone();
                    errors.report(place, Fault::invalid(error.to_string()));
                }
                if object.id.0 == u32::MAX {
                    let place = node.field("id").unwrap_or(node).place.clone();
                    let told =
                        format!("an object's number is below {}, so that new ones have room", u32::MAX);
                    errors.report(place, Fault::invalid(told));
                }
                if !ids.insert(object.id) {
                    let place = node.field("id").unwrap_or(node).place.clone();
                    errors.report(place, Fault::invalid(format!("object {} is there twice", object.id)));
                }
            }
            Self::new(map.up, map.objects)
        });
        errors.finish(map)
    }

    /// Returns the number of objects that `other` has too: with the same class at the same place, up to half of their
    /// length. Maps of one room in one frame share most objects.
    pub fn shared_objects(&self, other: &Self) -> usize {
        let is_same = |a: &PriorObject, b: &PriorObject| {
            let length = a.quadric.semi_axes.max().min(b.quadric.semi_axes.max());
            let apart = (a.quadric.pose.translation - b.quadric.pose.translation).norm();
            apart < length && a.classes.is_compatible(&b.classes)
        };
        self.objects.iter().filter(|a| other.objects.iter().any(|b| is_same(a, b))).count()
    }

    /// Returns the map with the canonical class names of `aliases`.
    pub fn with_classes(mut self, aliases: &ClassAliases) -> Self {
        for object in &mut self.objects {
            let object = Arc::make_mut(object);
            object.classes = object.classes.canonical(aliases);
        }
        self
    }

    /// Returns the object with this number.
    pub fn object(&self, id: ObjectId) -> Option<&Arc<PriorObject>> {
        let place = self.objects.binary_search_by_key(&id, |object| object.id).ok()?;
        self.objects.get(place)
    }
}

impl PriorObject {
    /// Returns the covariance as a matrix.
    pub fn covariance(&self) -> SMatrix<f64, 9, 9> {
        SMatrix::from_fn(|r, c| self.covariance[r][c])
    }

    /// Returns the noise of the factor that holds the object.
    ///
    /// # Errors
    /// If the matrix is not a covariance. An object that was read from a file has a valid one.
    pub fn noise(&self) -> Result<Noise, NoiseError> {
        let noise = Noise::covariance(DMatrix::from_fn(9, 9, |r, c| self.covariance[r][c]))?;
        noise.whitener(9)?;
        Ok(noise)
    }

    /// Returns the object with its standard deviations multiplied by `sigma_scale` and enlarged by
    /// `shape_error`: in rad, as a fraction of its mean semi-axis, and in the logarithms of its semi-axes.
    pub fn inflated(&self, sigma_scale: f64, shape_error: f64) -> Self {
        let mut covariance = self.covariance.map(|row| row.map(|entry| entry * sigma_scale * sigma_scale));
        let size = self.quadric.semi_axes.mean();
        let errors = [1.0, size, 1.0].map(|of| shape_error * of);
        for i in 0..9 {
            covariance[i][i] += errors[i / 3] * errors[i / 3];
        }
        Self { covariance, ..self.clone() }
    }
}

impl DetectionCounts {
    /// Returns the probability of a detection at one opportunity.
    pub fn detection_rate(&self) -> f64 {
        (self.seen + 1) as f64 / (self.expected + 2) as f64
    }

    /// Returns the log-likelihood of the detections of a second run, up to the number of their orders, if the
    /// object is present in both. The rate of the second run has a beta distribution with the mean of this
    /// rate.
    pub fn log_likelihood(self, second: Self) -> f64 {
        let rate = self.detection_rate();
        let rising = |from: f64, n: usize| (0..n).map(|i| (from + i as f64).ln()).sum::<f64>();
        let missed = second.expected.saturating_sub(second.seen);
        rising(rate * RATE_STRENGTH, second.seen) + rising((1.0 - rate) * RATE_STRENGTH, missed)
            - rising(RATE_STRENGTH, second.expected)
    }

    /// Returns the sum of both counts.
    pub fn plus(self, other: Self) -> Self {
        Self { expected: self.expected + other.expected, seen: self.seen + other.seen }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_of(change: impl FnOnce(&mut serde_json::Value)) -> String {
        let row = |r: usize| (0..9).map(|c| if r == c { 0.01 } else { 0.0 }).collect::<Vec<f64>>();
        let object = serde_json::json!({
            "id": 3,
            "classes": { "scores": { "cup": 2.5 }, "detections": 4 },
            "quadric": { "translation": [0.0, 1.0, 2.0], "rotation": [0.0, 0.0, 0.0, 1.0], "semi_axes": [0.1, 0.1, 0.1] },
            "covariance": (0..9).map(row).collect::<Vec<_>>(),
            "looks": { "expected": 5, "seen": 4 },
        });
        let mut map = serde_json::json!({ "version": 1, "up": [0.0, 0.0, 1.0], "objects": [object] });
        change(&mut map);
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("map.json");
        std::fs::write(&file, map.to_string()).unwrap();
        PriorMap::read(&file)
            .map_or_else(|error| error.to_string(), |map| format!("{} objects", map.objects.len()))
    }

    type DocumentEdit = fn(&mut serde_json::Value);

    #[test]
    fn a_file_that_is_no_map_is_reported_at_its_place() {
        assert_eq!(error_of(|_| {}), "1 objects");
        let cases: [(&str, DocumentEdit); 8] = [
            ("a map of version 2, and this program reads version 1", |map| map["version"] = 2.into()),
            ("object 3 is there twice", |map| {
                let again = map["objects"][0].clone();
                map["objects"].as_array_mut().unwrap().push(again);
            }),
            ("positive definite", |map| map["objects"][0]["covariance"][4][4] = (-1.0).into()),
            ("a score of 0 or more", |map| map["objects"][0]["classes"]["scores"]["cup"] = (-2.0).into()),
            ("three semi-axes", |map| map["objects"][0]["quadric"]["semi_axes"][1] = 0.0.into()),
            ("below 4294967295", |map| map["objects"][0]["id"] = u32::MAX.into()),
            ("of more than 0 pixels", |map| map["objects"][0]["least_px"] = 0.0.into()),
            ("expected an array", |map| map["objects"] = "none".into()),
        ];
        for (expected, change) in cases {
            let told = error_of(change);
            assert!(told.contains(expected), "{expected}: {told}");
        }
    }

    #[test]
    fn counts_give_the_detection_rate_of_an_object() {
        let counts = DetectionCounts { expected: 8, seen: 8 }.plus(DetectionCounts { expected: 10, seen: 0 });
        assert_eq!(counts, DetectionCounts { expected: 18, seen: 8 });
        assert!((counts.detection_rate() - 0.45).abs() < 1e-12);
        assert!((DetectionCounts::default().detection_rate() - 0.5).abs() < 1e-12);
        // one opportunity has the rate itself, and the four outcomes of two add up to one
        let outcome = |seen, expected| counts.log_likelihood(DetectionCounts { expected, seen }).exp();
        assert!((outcome(1, 1) - 0.45).abs() < 1e-12 && (outcome(0, 1) - 0.55).abs() < 1e-12);
        assert!((outcome(0, 2) + 2.0 * outcome(1, 2) + outcome(2, 2) - 1.0).abs() < 1e-12);
        // the second miss is less surprising than the first
        assert!(outcome(0, 2) > outcome(0, 1).powi(2));
    }
}
