//! From a sequence to a graph.
//!
//! Variables are the camera's poses `x0`, `x1`, … by frame, and the objects `q<number>` as dual quadrics. Factors, in
//! this order: the prior on the first pose; odometry between consecutive poses; for each object its boxes, then what
//! semantic rules say of it; last, variables and factors of the document's own.
use crate::fusion::FusedClass;
use crate::gravity::{GravityError, MapFrame};
use crate::input::sequence::{ObjectId, Sequence};
use crate::mapping::measurements::{Measured, Measurements, ObjectBox};
use crate::semantics::{Applied, Candidate, Judge, LeftOut, RuleError, unmatched};
use crate::settings::{DetectionSettings, Settings};
use manifactor_formats::plausible;
use manifactor_geometry::{Between, Prior, Se3};
use manifactor_graph::{FactorEntry, Graph, Key, Values};
use manifactor_quadric::{BoundingBoxFactor, DualQuadric};
use serde::Serialize;
use std::sync::Arc;

pub mod measurements;
mod rejection;
mod warning;

pub use rejection::Rejection;
pub use warning::Warning;

/// A graph made of a sequence, and how it was made.
#[derive(Debug, Clone)]
pub struct Mapping {
    /// Priors, odometry, boxes and semantics.
    pub graph: Graph,
    /// Where a solve begins.
    pub values: Values,
    /// The frame of the values, and up in it.
    pub frame: MapFrame,
    /// Each object that was detected, mapped or not, by number.
    pub objects: Vec<MappedObject>,
    /// What was done with the detections.
    pub measurements: Measurements,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

/// An object that was detected.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MappedObject {
    /// Its number.
    pub id: ObjectId,
    /// Its key in the graph, if it is mapped.
    pub key: Key,
    /// Its class; `None` where no detection named one.
    pub class: Option<FusedClass>,
    /// Detections that are associated with it.
    pub detections: usize,
    /// Boxes that passed the filters.
    pub boxes: usize,
    /// Why it is not mapped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rejected: Option<Rejection>,
    /// Factors that semantic rules brought it, and why.
    pub semantic_factors: Vec<Applied>,
    /// Rules that are for its class and were not applied, and why.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<LeftOut>,
}

/// Why a sequence could not be mapped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MappingError {
    /// A sequence of nothing.
    #[error("the sequence has no frames")]
    NoFrames,
    /// Up is unknown.
    #[error(transparent)]
    Gravity(#[from] GravityError),
    /// A semantic rule that cannot be applied.
    #[error(transparent)]
    Rule(#[from] RuleError),
}

/// The key of a pose.
pub(crate) fn pose_key(frame: usize) -> Key {
    Key::indexed("x", frame)
}

/// The key of an object.
pub fn object_key(id: ObjectId) -> Key {
    Key::indexed("q", id)
}

impl Mapping {
    /// Makes the graph of a sequence.
    ///
    /// # Errors
    /// Where there is no frame, or up is not known and a rule needs it.
    pub fn new(sequence: &Sequence, settings: &Settings) -> Result<Self, MappingError> {
        let frame = settings.gravity.locate(sequence)?;
        let measurements = Measurements::gather(sequence, &settings.detections, &settings.aliases);
        let (graph, values) = (Graph::new(), Values::new());
        let (objects, warnings) = (vec![], vec![]);
        let mut mapping = Self { graph, values, frame, objects, measurements, warnings };
        let poses = mapping.add_poses(sequence, settings)?;
        let all = mapping.measurements.objects.clone();
        let start = |measured: &Measured| rejection::start(measured, &poses, sequence, &settings.objects);
        let starts: Vec<_> = all.iter().map(start).collect();
        let mapped = all.iter().zip(&starts).filter_map(|(object, start)| candidate(object, start));
        let up = mapping.frame.up;
        let mut judge = Judge::new(&settings.semantics, &settings.aliases, up, mapped.collect());
        for (measured, start) in all.iter().zip(starts) {
            let object = mapping.add_object(measured, start, &mut judge, sequence, settings)?;
            mapping.objects.push(object);
        }
        settings.own.add_to(&mut mapping.graph, &mut mapping.values);
        mapping.warn(sequence, settings);
        let (poses, objects, factors) =
            (poses.len(), mapping.mapped().count(), mapping.graph.factors().len());
        tracing::info!(poses, objects, factors, "mapped");
        Ok(mapping)
    }

    /// Objects that are in the graph.
    pub fn mapped(&self) -> impl Iterator<Item = &MappedObject> {
        self.objects.iter().filter(|object| object.rejected.is_none())
    }

    fn add_poses(&mut self, sequence: &Sequence, settings: &Settings) -> Result<Vec<Se3>, MappingError> {
        let odometry = sequence.frames.iter().map(|frame| frame.world_from_camera);
        let poses: Vec<Se3> = odometry.map(|pose| self.frame.map_from_odometry.compose(&pose)).collect();
        let first = poses.first().ok_or(MappingError::NoFrames)?;
        for (i, pose) in poses.iter().enumerate() {
            self.values.insert(pose_key(i), *pose);
        }
        let prior = self.graph.add([pose_key(0)], Prior { value: *first });
        prior.noise(settings.prior.noise.clone());
        let pairs = sequence.frames.iter().zip(sequence.frames.iter().skip(1));
        for (i, (here, next)) in pairs.enumerate() {
            let relative = here.world_from_camera.between(&next.world_from_camera);
            let between = self.graph.add([pose_key(i), pose_key(i + 1)], Between { relative });
            between.noise(settings.odometry.noise.clone());
            between.loss.clone_from(&settings.odometry.loss);
        }
        Ok(poses)
    }

    fn add_object(
        &mut self,
        measured: &Measured,
        start: Result<DualQuadric, Rejection>,
        judge: &mut Judge<'_>,
        sequence: &Sequence,
        settings: &Settings,
    ) -> Result<MappedObject, MappingError> {
        let key = object_key(measured.id);
        if let Err(rejection) = &start {
            tracing::info!(object = %measured.id, "not mapped: {rejection}");
        }
        let (mut semantic_factors, mut left_out) = (vec![], vec![]);
        if let Some(candidate) = candidate(measured, &start) {
            let boxes = measured.views.iter();
            let boxes = boxes.map(|view| box_entry(view, key.clone(), sequence, &settings.detections));
            self.graph.factors_mut().extend(boxes);
            let verdict = judge.judge(&candidate)?;
            self.graph.factors_mut().extend(verdict.entries);
            self.values.insert(key.clone(), candidate.start);
            (semantic_factors, left_out) = (verdict.applied, verdict.left_out);
        }
        Ok(MappedObject {
            id: measured.id,
            key,
            class: measured.class.clone(),
            detections: measured.detections,
            boxes: measured.views.len(),
            rejected: start.err(),
            semantic_factors,
            left_out,
        })
    }

    fn warn(&mut self, sequence: &Sequence, settings: &Settings) {
        let odometry = sequence.frames.iter().map(|frame| (frame.timestamp, frame.world_from_camera));
        let doubts = plausible::trajectory(odometry).into_iter().map(|what| Warning::Implausible { what });
        self.warnings.extend(doubts);
        let classes = self.objects.iter().filter_map(|object| Some(object.class.as_ref()?.name.clone()));
        let mut seen: Vec<String> = classes.collect();
        seen.sort();
        seen.dedup();
        for rule in settings.semantics.iter().filter(|rule| !rule.shipped) {
            for class in unmatched(rule, &seen, &settings.aliases) {
                let (class, factor) = (class.to_owned(), rule.factor.name().to_owned());
                self.warnings.push(Warning::ClassWithoutObjects { class, factor, seen: seen.clone() });
            }
        }
        if self.mapped().next().is_none() {
            self.warnings.push(Warning::NoObjects { detected: self.objects.len() });
        }
    }
}

/// A measured object as rules look at it; `None`, where it is not mapped.
fn candidate(measured: &Measured, start: &Result<DualQuadric, Rejection>) -> Option<Candidate> {
    let start = *start.as_ref().ok()?;
    Some(Candidate { key: object_key(measured.id), class: measured.class.clone(), start })
}

fn box_entry(
    view: &ObjectBox,
    object: Key,
    sequence: &Sequence,
    settings: &DetectionSettings,
) -> FactorEntry {
    let (bounding_box, camera, model) = (view.bounding_box, sequence.camera, settings.model);
    FactorEntry {
        keys: vec![pose_key(view.frame), object],
        name: None,
        factor: Arc::new(BoundingBoxFactor { bounding_box, camera, model }),
        noise: settings.noise_of(view.inside),
        loss: settings.loss.clone(),
    }
}
