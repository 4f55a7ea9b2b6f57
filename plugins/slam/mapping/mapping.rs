//! Construction of the graph from a sequence.
//!
//! Variables are the camera poses `x0`, `x1`, … by frame, and the objects `q<number>` as dual quadrics.
//! Factors, in this order: the prior on the first pose; odometry between consecutive poses; for each object
//! its boxes, then its semantic factors; variables and factors of the run document; last, factors on poses that
//! arrived with frames.
use crate::gravity::{GravityError, MapFrame};
use crate::mapping::measurements::{Measurements, ObjectBox, ObjectMeasurements};
use crate::motion::{MotionError, MotionStep, RelativePose, STEP_WITH_NOISE};
use crate::semantics::{AppliedRule, RuleCandidate, RuleError, RuleVerdict, SkippedRule, unmatched};
use crate::settings::{DetectionSettings, OdometrySettings, RunSettings};
use manifactor_formats::plausible;
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::{Prior, Se3};
use manifactor_graph::{FactorEntry, Graph, Key, Noise, Values, Variable};
use manifactor_quadric::{BoundingBox, BoundingBoxFactor, Camera, DualQuadric, QuadricPrior};
use manifactor_recording::camera::MountedCamera;
use manifactor_recording::ellipse::ImageEllipse;
use manifactor_recording::fusion::FusedClass;
use manifactor_recording::measurement::MeasurementSigmas;
use manifactor_recording::prior_map::PriorObject;
use manifactor_recording::sequence::jumps::{OdometryJump, find_jumps};
use manifactor_recording::sequence::{Frame, ObjectId, Sequence, UnusedInput};
use manifactor_semantic::ConicDistance;
use serde::Serialize;
use std::sync::Arc;

pub mod measurements;
mod moving_objects;
mod pose_factors;
pub mod rejection;
pub mod rules;
mod warning;

use manifactor_recording::keys::key_number;
pub use manifactor_recording::keys::{object_key, pose_key};
pub use rejection::Rejection;
use rules::SemanticFactors;
pub use warning::Warning;

/// The graph of a sequence, and the decisions behind it.
#[derive(Debug, Clone)]
pub struct Mapping {
    /// Factors: priors, odometry, boxes and semantics.
    pub graph: Graph,
    /// Initial values.
    pub values: Values,
    /// Frame of the values, with the up direction.
    pub frame: MapFrame,
    /// All detected objects, in the map or not, sorted by id.
    pub objects: Vec<MappedObject>,
    /// Measurements per object, and counts of unused detections.
    pub measurements: Measurements,
    /// Warnings for the user.
    pub warnings: Vec<Warning>,
}

/// A detected object.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MappedObject {
    /// Object id.
    pub id: ObjectId,
    /// Key in the graph if the object is mapped.
    pub key: Key,
    /// Class; `None` if no detection has one.
    pub class: Option<FusedClass>,
    /// Number of detections associated with it.
    pub detections: usize,
    /// Number of boxes that passed the filters.
    pub boxes: usize,
    /// Reason why it is not mapped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rejected: Option<Rejection>,
    /// Factors from semantic rules, with their reasons.
    pub semantic_factors: Vec<AppliedRule>,
    /// Rules for its class that were not applied, with their reasons.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<SkippedRule>,
}

/// Reason why a sequence cannot be mapped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MappingError {
    /// The sequence has no frames.
    #[error("the sequence has no frames")]
    NoFrames,
    /// The up direction is unknown.
    #[error(transparent)]
    Gravity(#[from] GravityError),
    /// A semantic rule cannot be applied.
    #[error(transparent)]
    Rule(#[from] RuleError),
    /// The motion model has no factor for a step.
    #[error(transparent)]
    Motion(#[from] MotionError),
}

/// Returns the frame of a pose key; `None` for any other key.
pub fn frame_of(key: &Key) -> Option<usize> {
    key_number(key, "x")?.parse().ok()
}

impl Mapping {
    /// Creates the graph of a sequence.
    ///
    /// # Errors
    /// If there is no frame, or a rule needs the up direction and it is unknown.
    pub fn new(sequence: &Sequence, settings: &RunSettings) -> Result<Self, MappingError> {
        let first = sequence.frames.first().ok_or(MappingError::NoFrames)?;
        let located = settings.gravity.locate(sequence)?;
        let frame = settings.anchor().map_or(located, |anchor| anchor.map_frame(first, located));
        let measurements = Measurements::gather(sequence, settings);
        let at = |i: usize| {
            let seen = sequence.frames.get(i)?;
            let pose = frame.map_from_odometry.compose(&seen.world_from_camera);
            Some(StampedPose { timestamp: seen.timestamp, pose })
        };
        let start = |measured| rejection::initial_quadric(measured, at, settings);
        let starts = measurements.objects.iter().map(start).collect();
        let decisions =
            SemanticFactors::default().complete_decisions(&measurements, starts, settings, frame.up)?;
        Self::assemble(sequence, settings, frame, measurements, decisions)
    }

    /// Assembles the graph from measurements and decisions, with one decision per object in the order of the
    /// objects.
    pub fn assemble(
        sequence: &Sequence,
        settings: &RunSettings,
        frame: MapFrame,
        measurements: Measurements,
        decisions: Vec<ObjectDecision>,
    ) -> Result<Self, MappingError> {
        let (graph, values) = (Graph::new(), Values::new());
        let (objects, warnings) = (vec![], vec![]);
        let mut mapping = Self { graph, values, frame, objects, measurements, warnings };
        mapping.add_poses(sequence, settings)?;
        let all = mapping.measurements.objects.clone();
        for (measured, decision) in all.iter().zip(decisions) {
            let object = mapping.add_object(measured, decision, settings);
            mapping.objects.push(object);
        }
        if let Some(place) = &sequence.georeference {
            place.add_to(&mapping.frame.map_from_odometry, &mut mapping.graph, &mut mapping.values);
        }
        settings.own.add_to(&mut mapping.graph, &mut mapping.values);
        let (entries, unused) = pose_factors::entries(sequence, &mapping.values, mapping.frame.up);
        mapping.graph.factors_mut().extend(entries);
        mapping.add_warnings(sequence, &unused, settings);
        let (poses, objects, factors) =
            (sequence.frames.len(), mapping.mapped().count(), mapping.graph.factors().len());
        tracing::info!(poses, objects, factors, "mapped");
        Ok(mapping)
    }

    /// Returns the objects in the graph.
    pub fn mapped(&self) -> impl Iterator<Item = &MappedObject> {
        self.objects.iter().filter(|object| object.rejected.is_none())
    }

    fn add_poses(&mut self, sequence: &Sequence, settings: &RunSettings) -> Result<(), MappingError> {
        for (i, frame) in sequence.frames.iter().enumerate() {
            let pose = self.frame.map_from_odometry.compose(&frame.world_from_camera);
            self.values.insert(pose_key(i), pose);
        }
        let first = *self.values.get(pose_key(0)).map_err(|_| MappingError::NoFrames)?;
        self.graph.push(prior_entry(first, settings));
        for (i, pair) in sequence.frames.windows(2).enumerate() {
            let [from, to] = pair else { continue };
            let estimates = |key: &str| self.values.variable(key).map(|value| value.erased().clone_box());
            let step = motion_step([i, i + 1], [from, to], settings, &estimates);
            let factors = settings.motion.factors(&step)?;
            if let (Ok(a), Ok(b)) = (self.values.get(pose_key(i)), self.values.get(pose_key(i + 1))) {
                let variables = settings.motion.variables(&step, [a, b]);
                for (key, value) in variables.iter() {
                    self.values.insert_boxed(key.clone(), value.erased().clone_box());
                }
            }
            self.graph.factors_mut().extend(factors);
        }
        Ok(())
    }

    fn add_object(
        &mut self,
        measured: &ObjectMeasurements,
        decision: ObjectDecision,
        settings: &RunSettings,
    ) -> MappedObject {
        let key = object_key(measured.id);
        let ObjectDecision { start, verdict } = decision;
        match &start {
            Err(rejection) => tracing::info!(object = %measured.id, "not mapped: {rejection}"),
            Ok(start) => {
                let known = measured.prior.as_ref().map(|known| prior_object_entry(known, settings));
                self.graph.factors_mut().extend(known);
                let boxes = measured.views.iter();
                let boxes = boxes.flat_map(|view| view_entries(view, &key, &settings.detections));
                self.graph.factors_mut().extend(boxes);
                self.graph.factors_mut().extend(verdict.entries);
                self.values.insert(key.clone(), *start);
            }
        }
        MappedObject {
            id: measured.id,
            key,
            class: measured.class(),
            detections: measured.detections,
            boxes: measured.views.len(),
            rejected: start.err(),
            semantic_factors: verdict.applied,
            left_out: verdict.left_out,
        }
    }

    fn add_warnings(&mut self, sequence: &Sequence, unused: &[UnusedInput], settings: &RunSettings) {
        let odometry = sequence.frames.iter().map(|frame| (frame.timestamp, frame.world_from_camera));
        let doubts =
            plausible::trajectory_doubts(odometry).into_iter().map(|what| Warning::Implausible { what });
        self.warnings.extend(doubts);
        self.warnings.extend(jump_warnings(sequence));
        self.warnings.extend(image_warnings(sequence));
        let unused = sequence.unused.iter().chain(unused);
        self.warnings.extend(unused_warnings(unused, self.measurements.without_area));
        let detected = self.objects.iter().filter(|object| object.detections > 0);
        self.warnings.extend(not_mapped_warnings(
            detected.filter_map(|object| Some((object, object.rejected.as_ref()?))),
        ));
        let classes = self.objects.iter().filter_map(|object| Some(object.class.as_ref()?.name.clone()));
        let mut seen: Vec<String> = classes.collect();
        seen.sort();
        seen.dedup();
        for rule in settings.semantics.iter().filter(|rule| !rule.optional) {
            for class in unmatched(rule, &seen, &settings.aliases) {
                let (class, factor) = (class.to_owned(), rule.factor.factor_type().to_owned());
                self.warnings.push(Warning::ClassWithoutObjects { class, factor, seen: seen.clone() });
            }
        }
        if self.mapped().next().is_none() {
            let unused = sequence.unused.iter().map(UnusedInput::boxes).sum();
            self.warnings.push(match (sequence.detections.len(), unused) {
                (0, 1..) => Warning::NoUsableBoxes { boxes: unused },
                (boxes, _) => Warning::NoObjects { boxes, detected: self.objects.len() },
            });
        } else if !settings.association.uses_source_ids() && settings.detections.loss.is_none() {
            self.warnings.push(Warning::NotRobust);
        }
    }
}

/// Largest share of boxes outside of the image that a detector makes by mistake. A box that was rectified may
/// leave the image.
const MAX_OUTSIDE_SHARE: f64 = 0.05;

/// Normalized sides are this far outside of the image at most: centre and size of a box are rounded.
const NORMALIZED_MARGIN: f64 = 0.01;

/// Returns a warning for each camera whose image its boxes do not fit.
fn image_warnings(sequence: &Sequence) -> impl Iterator<Item = Warning> {
    sequence.cameras.iter().filter_map(|camera| image_warning(sequence, camera))
}

fn image_warning(sequence: &Sequence, camera: &MountedCamera) -> Option<Warning> {
    let Camera { width, height, .. } = camera.model;
    let all = || {
        let own = sequence.detections.iter().filter(|detection| detection.camera.index == camera.index);
        own.map(|detection| &detection.bounding_box).filter(|b| b.xmin < b.xmax && b.ymin < b.ymax)
    };
    let boxes = all().count();
    let is_share = |side: f64| (-NORMALIZED_MARGIN..=1.0 + NORMALIZED_MARGIN).contains(&side);
    let is_normalized = |b: &BoundingBox| [b.xmin, b.ymin, b.xmax, b.ymax].into_iter().all(is_share);
    if boxes > 0 && all().all(is_normalized) {
        return Some(Warning::NormalizedBoxes { boxes, setting: camera.setting(), image: [width, height] });
    }
    let is_outside = |b: &&BoundingBox| {
        b.xmax <= 0.0 || b.ymax <= 0.0 || b.xmin >= f64::from(width) || b.ymin >= f64::from(height)
    };
    let outside = all().filter(is_outside).count();
    let is_too_many = outside as f64 > MAX_OUTSIDE_SHARE * boxes as f64;
    let (setting, image) = (camera.setting(), [width, height]);
    is_too_many.then_some(Warning::OutsideImage { outside, boxes, setting, image })
}

/// Returns warnings about unused input, one per reason.
fn unused_warnings<'a>(all: impl Iterator<Item = &'a UnusedInput>, without_area: usize) -> Vec<Warning> {
    let mut warnings = vec![];
    let (mut boxes, mut first) = (0, None);
    let (mut changes, mut first_change) = (0, None);
    let (mut images, mut first_image) = ((0, 0), None);
    for unused in all {
        match unused {
            UnusedInput::WithoutPose(without) if without.is_too_many() => {
                warnings.push(Warning::TooManyUnused { what: without.to_string(), allowed: without.allowed });
            }
            UnusedInput::WithoutPose(without) => {
                warnings.push(Warning::Unused { what: without.to_string() });
            }
            UnusedInput::Recording(what) => warnings.push(Warning::Unused { what: what.clone() }),
            UnusedInput::Box { timestamp, place, fault } => {
                boxes += 1;
                first.get_or_insert_with(|| format!("box {place} at {timestamp} s: {fault}"));
            }
            UnusedInput::Image { boxes, fault } => {
                images = (images.0 + 1, images.1 + boxes);
                first_image.get_or_insert(fault);
            }
            UnusedInput::PoseGraph { timestamp, field, fault } => {
                changes += 1;
                first_change.get_or_insert_with(|| format!("{field} at {timestamp} s: {fault}"));
            }
        }
    }
    if let Some(first) = first {
        let what = format!("boxes that cannot be used are left out: {boxes}, the first {first}");
        warnings.push(Warning::Unused { what });
    }
    if let Some(first) = first_image {
        let (images, boxes) = images;
        let what =
            format!("images without a pose are left out: {images}, with {boxes} boxes; the first: {first}");
        warnings.push(Warning::Unused { what });
    }
    if let Some(first) = first_change {
        let what = format!("changes of the pose graph are left out: {changes}, the first {first}");
        warnings.push(Warning::Unused { what });
    }
    if without_area > 0 {
        let what = format!(
            "boxes without width or height are left out: {without_area}; check the detector's output"
        );
        warnings.push(Warning::Unused { what });
    }
    warnings
}

/// Returns warnings about objects that are not mapped, one per kind of reason.
fn not_mapped_warnings<'a>(objects: impl Iterator<Item = (&'a MappedObject, &'a Rejection)>) -> Vec<Warning> {
    const MAX_LISTED_OBJECTS: usize = 5;
    let mut kinds: Vec<(&Rejection, Vec<String>)> = vec![];
    for (object, rejection) in objects {
        let class = object.class.as_ref().map(|class| format!(" ({})", class.name)).unwrap_or_default();
        let named = format!("{}{class}", object.key);
        match kinds
            .iter_mut()
            .find(|(kind, _)| std::mem::discriminant(*kind) == std::mem::discriminant(rejection))
        {
            Some((_, keys)) => keys.push(named),
            None => kinds.push((rejection, vec![named])),
        }
    }
    let warning = |(rejection, keys): (&Rejection, Vec<String>)| {
        let more = match keys.len().saturating_sub(MAX_LISTED_OBJECTS) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let named = keys.iter().take(MAX_LISTED_OBJECTS).map(String::as_str).collect::<Vec<_>>().join(", ");
        let first = if keys.len() > 1 { "; the first: " } else { ": " };
        let what = format!("{named}{more}{first}{rejection}");
        Warning::NotMapped { what, remedy: rejection.remedy() }
    };
    kinds.into_iter().map(warning).collect()
}

/// The decision about an object.
#[derive(Debug, Clone)]
pub struct ObjectDecision {
    /// Initial value, or the reason why the object is not mapped.
    pub start: Result<DualQuadric, Rejection>,
    /// Result of the semantic rules; empty if the object is not mapped.
    pub verdict: RuleVerdict,
}

/// Returns a mapped object as a candidate for semantic rules.
pub fn as_candidate(measured: &ObjectMeasurements, start: DualQuadric) -> RuleCandidate {
    let (key, class, known) = (object_key(measured.id), measured.class(), measured.prior.is_some());
    RuleCandidate { key, class, start, known }
}

/// Returns the prior on the first pose.
pub fn prior_entry(value: Se3, settings: &RunSettings) -> FactorEntry {
    FactorEntry {
        keys: vec![pose_key(0)],
        name: None,
        factor: Arc::new(Prior { value }),
        noise: settings.prior.noise.clone(),
        loss: None,
    }
}

/// Returns the prior on an object of the prior map, with the noise of the `[prior_map]` settings.
pub fn prior_object_entry(object: &PriorObject, settings: &RunSettings) -> FactorEntry {
    let prior_map = settings.prior_map.as_ref();
    let noise = prior_map.and_then(|prior| prior.inflated_object(object).noise().ok());
    FactorEntry {
        keys: vec![object_key(object.id)],
        name: None,
        factor: Arc::new(QuadricPrior { value: object.quadric }),
        // every object that was read from a map has a noise
        noise: noise.unwrap_or_default(),
        loss: prior_map.map(|prior| prior.loss.clone()),
    }
}

/// Returns the step between two frames for a motion model. Its noise is that of the later frame if that is given.
pub fn motion_step<'a>(
    frames: [usize; 2],
    [from, to]: [&'a Frame; 2],
    settings: &'a RunSettings,
    estimates: &'a dyn Fn(&str) -> Option<Box<dyn Variable>>,
) -> MotionStep<'a> {
    let pose = from.world_from_camera.between(&to.world_from_camera);
    let OdometrySettings { noise, loss } = &settings.odometry;
    let (noise, name) =
        to.odometry_noise.as_deref().map_or((noise, None), |given| (given, Some(STEP_WITH_NOISE)));
    let odometry = RelativePose { pose, noise, name, loss: loss.as_ref() };
    MotionStep { frames, seconds: to.timestamp - from.timestamp, odometry, estimates }
}

/// Returns warnings about jumps of the odometry: the corrected ones, and those that remain.
fn jump_warnings(sequence: &Sequence) -> impl Iterator<Item = Warning> {
    let corrected = sequence.corrected_jumps.clone();
    let is_corrected =
        |jump: &OdometryJump| corrected.iter().any(|corrected| corrected.timestamp == jump.timestamp);
    let remaining = find_jumps(&sequence.frames).into_iter().filter(|jump| !is_corrected(jump)).collect();
    [(corrected.clone(), true), (remaining, false)].into_iter().filter_map(
        |(jumps, is_corrected): (Vec<_>, _)| {
            Some(Warning::OdometryJump { first: *jumps.first()?, jumps: jumps.len(), is_corrected })
        },
    )
}

/// Returns the factors of a detection: that of its ellipse or box, then the factors of its further measurements.
pub fn view_entries<'a>(
    view: &'a ObjectBox,
    object: &'a Key,
    settings: &'a DetectionSettings,
) -> impl Iterator<Item = FactorEntry> + 'a {
    let errors = MeasurementSigmas { depth: *settings.depth_error };
    let others = view.quantities.entries(view.frame, &view.camera, object, errors, settings.loss.as_ref());
    outline_entry(view, object.clone(), settings).into_iter().chain(others)
}

/// Returns the factor of an ellipse, or else of a box.
fn outline_entry(view: &ObjectBox, object: Key, settings: &DetectionSettings) -> Option<FactorEntry> {
    let Some(ImageEllipse { centre, semi_axes, angle }) = view.ellipse else {
        return box_entry(view, object, settings);
    };
    let factor = ConicDistance { centre, semi_axes, angle, camera: view.camera.model };
    Some(FactorEntry {
        keys: vec![pose_key(view.frame), object],
        name: None,
        factor: view.camera.on_first(Arc::new(factor)).ok()?,
        noise: Noise::sigma(*settings.ellipse_error).ok()?,
        loss: settings.loss.clone(),
    })
}

/// Returns the factor of a box.
fn box_entry(view: &ObjectBox, object: Key, settings: &DetectionSettings) -> Option<FactorEntry> {
    let (bounding_box, camera, model) = (view.bounding_box, view.camera.model, settings.model);
    let factor = Arc::new(BoundingBoxFactor { bounding_box, camera, model });
    Some(FactorEntry {
        keys: vec![pose_key(view.frame), object],
        name: None,
        // its first variable is a pose
        factor: view.camera.on_first(factor).ok()?,
        noise: settings.noise_of(view.inside),
        loss: settings.loss.clone(),
    })
}
