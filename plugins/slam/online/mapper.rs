//! Online mapping, frame by frame.
//!
//! A [`Mapper`] takes a frame with its boxes, and updates the pose and the map before the next one.
//! [`Mapping`] decides about objects with all boxes known. Here, an object is added to the map as soon as its
//! place can be determined. The decision is revised if later boxes contradict it.
mod association;
mod frame;
mod gravity;
mod locate;
mod object;
mod pose_graph;
mod present;
mod revision;

use association::AssociationContext;
use frame::FrameBoxes;
use gravity::UpEstimate;
use manifactor_association::{Associator, Corrections, FrameDetections, MapEstimate, ObjectIdChanges};
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::{TypeName, manifold_name};
use manifactor_mapping::estimate::variance::StreamNoise;
use manifactor_mapping::estimate::{Estimate, EstimateError};
use manifactor_mapping::gravity::GravityError;
use manifactor_mapping::mapping::measurements::{Measurements, ObjectMeasurements};
use manifactor_mapping::mapping::rules::SemanticFactors;
use manifactor_mapping::mapping::{Mapping, MappingError, object_key, pose_key, rejection};
use manifactor_mapping::motion::MotionError;
use manifactor_mapping::semantics::RuleError;
use manifactor_mapping::settings::RunSettings;
use manifactor_quadric::DualQuadric;
use manifactor_recording::camera::Cameras;
use manifactor_recording::georeference::{ENU_FROM_MAP, Georeference};
use manifactor_recording::sequence::{Frame, ObjectId, Observation, Sequence, SequenceHeader};
use manifactor_smoother::{ChangeError, FactorId, Smoother, UpdateError, UpdateReport};
use manifactor_solve::Observer;
use object::ObjectState;
use std::any::TypeId;
use std::collections::BTreeMap;
use std::sync::Arc;

pub use frame::FrameReport;
pub use locate::Relocalization;

/// A map that grows with each frame.
///
/// It keeps the data for a batch solve at the end: about 140 bytes per frame, and 50 per box. With data
/// association, it also keeps each object with its detections. Everything else is bounded by the window of
/// the smoother, if there is one.
#[derive(Debug)]
pub struct Mapper {
    /// With the current noise of the stream.
    settings: Arc<RunSettings>,
    /// For the batch solve at the end.
    batch_settings: Arc<RunSettings>,
    cameras: Cameras,
    /// For the poses of the body in reports.
    camera_from_body: Option<Se3>,
    georeference: Option<Georeference>,
    smoother: Smoother,
    up: UpEstimate,
    associator: Box<dyn Associator>,
    /// Current objects of detections that were assigned differently at first.
    id_changes: ObjectIdChanges,
    /// Corrections to earlier frames, for the next update.
    pending: Vec<Corrections>,
    measurements: Measurements,
    objects: BTreeMap<ObjectId, ObjectState>,
    semantic_factors: SemanticFactors,
    /// The accepted frames, with corrected odometry.
    frames: Vec<Frame>,
    /// True if the odometry of earlier frames was corrected.
    is_corrected: bool,
    /// Factors on poses that can be replaced or removed by id.
    pose_factors: BTreeMap<String, FactorId>,
    /// Pose estimates at the time of their frames.
    live_poses: Vec<StampedPose>,
}

/// Reason why a frame is rejected. The map stays unchanged, and the next frame is connected to the last
/// accepted one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// The timestamp is not later than the one before.
    #[error("the frame at {timestamp} s is left out: it does not come after the one before, at {before} s")]
    Timestamp {
        /// Timestamp of the frame, in seconds.
        timestamp: f64,
        /// Timestamp of the previous frame, in seconds.
        before: f64,
    },
    /// The source returned an invalid frame.
    #[error("left out: {0}")]
    Source(String),
    /// The pose or the timestamp is not finite.
    #[error("the frame at {timestamp} s is left out: its pose by odometry, or its time stamp, is not finite")]
    NotFinite {
        /// Timestamp of the frame, in seconds.
        timestamp: f64,
    },
    /// The up direction is unknown.
    #[error(transparent)]
    Gravity(#[from] GravityError),
    /// A semantic rule cannot be applied.
    #[error(transparent)]
    Rule(#[from] RuleError),
    /// The motion model has no factor for the step.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The smoother rejects the factors.
    #[error(transparent)]
    Change(#[from] ChangeError),
    /// The update of the smoother fails.
    #[error(transparent)]
    Update(#[from] UpdateError),
}

/// Reason why a map could not be finished.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FinishError {
    /// The graph cannot be created.
    #[error(transparent)]
    Mapping(#[from] MappingError),
    /// The graph cannot be solved.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
}

impl Mapper {
    /// Creates a map with the settings [for streams](RunSettings::for_stream). It is empty, or has the objects
    /// of the prior map if the settings give one with a start pose. If the noise is to be estimated, the map
    /// begins with the [initial](StreamNoise::initial) one.
    pub fn new(opening: SequenceHeader, settings: &RunSettings) -> Self {
        let batch_settings = Arc::new(settings.clone().for_stream());
        let noise = settings.variance_components.as_ref().map(StreamNoise::initial).unwrap_or_default();
        let settings = Arc::new(noise.apply_to(&batch_settings));
        let mut online = settings.online.clone();
        if let Some(window) = &mut online.window {
            // only poses leave the window
            let of_motion = settings.motion.lasting_types().iter().copied();
            let kept = of_motion.chain([manifold_name(TypeId::of::<DualQuadric>())]);
            window.keep.extend(kept.filter_map(|name| TypeName::new(name).ok()));
            let own = settings.own.values.iter().map(|(key, _)| key.clone());
            window.keep_keys.extend(own.chain(opening.georeference.map(|_| ENU_FROM_MAP.into())));
        }
        let trusted = settings.prior_map.as_ref().filter(|prior| prior.start.is_some());
        let known = trusted.map(|prior| prior.inflated_map().objects).unwrap_or_default();
        let measurements = Measurements::new(settings.anchor());
        let objects = measurements
            .objects
            .iter()
            .filter_map(|measured| Some((measured.id, ObjectState::of_prior_object(measured)?)));
        Self {
            cameras: opening.cameras.clone(),
            georeference: opening.georeference,
            camera_from_body: opening.body_from_camera.map(|pose| pose.inverse()),
            smoother: Smoother::new(online),
            associator: settings.association.create_associator(&settings.aliases, &known),
            settings,
            batch_settings,
            id_changes: ObjectIdChanges::default(),
            pending: vec![],
            up: UpEstimate::new(opening),
            objects: objects.collect(),
            measurements,
            semantic_factors: SemanticFactors::default(),
            frames: vec![],
            is_corrected: false,
            pose_factors: BTreeMap::new(),
            live_poses: vec![],
        }
    }

    /// Adds a frame: its pose, and its boxes of mapped objects; then objects that can be initialized with it.
    /// The `association` of the settings assigns the boxes to objects. Changes of the pose graph are applied even if
    /// the frame is rejected: corrected poses before it, factors after it.
    ///
    /// # Errors
    /// If the pose is rejected. Rejected boxes and changes are not an error: the report lists them.
    pub fn add_frame(&mut self, observation: &Observation) -> Result<FrameReport, FrameError> {
        let mut report = FrameReport::new(self.live_poses.len(), observation.frame.timestamp);
        self.correct_poses(&observation.pose_graph.corrected, &mut report);
        let seen = self.add_pose(observation, &mut report);
        self.apply_pose_factors(&observation.pose_graph, &mut report);
        let seen = seen?;
        self.update_objects(seen, &mut report);
        self.report_pose(&mut report);
        self.live_poses.push(StampedPose { timestamp: report.timestamp, pose: report.pose });
        Ok(report)
    }

    /// Writes the current pose of a report's frame.
    fn report_pose(&self, report: &mut FrameReport) {
        report.pose = self.pose(report.frame).unwrap_or(report.pose);
        report.body = self.camera_from_body.map(|body| report.pose.compose(&body));
    }

    /// Replaces the noise of all motions and boxes, of earlier frames and of those to come. The final solve
    /// does not use it.
    ///
    /// # Errors
    /// If the smoother cannot be updated. The noise of the frames to come is replaced all the same.
    pub fn set_noise(&mut self, noise: &StreamNoise) -> Result<UpdateReport, FrameError> {
        self.settings = Arc::new(noise.apply_to(&self.batch_settings));
        let (graph, ids) = self.smoother.graph();
        for (entry, id) in graph.factors().iter().zip(ids) {
            if let Some(entry) = noise.replace_noise_of(entry, &self.settings) {
                self.smoother.replace(id, entry)?;
            }
        }
        Ok(self.smoother.update()?)
    }

    /// Reconsiders all frames after the last one, and corrects their data association. The changes are
    /// reported as those of the last frame.
    pub fn finish_association(&mut self) -> FrameReport {
        let frame = self.live_poses.len();
        let last = self.frames.last().map_or(0.0, |last| last.timestamp);
        let mut report = FrameReport::new(frame.saturating_sub(1), last);
        let known = AssociationContext {
            newest: (frame, Se3::identity()),
            live_poses: &self.live_poses,
            smoother: &self.smoother,
            measurements: &self.measurements,
        };
        let corrections = self.associator.finish_association(&known);
        self.queue_corrections(corrections, &mut report);
        if let Some(corrected) = self.apply_pending_corrections(&mut report) {
            match self.smoother.update() {
                Ok(update) => {
                    self.id_changes = corrected.id_changes;
                    report.updates.push(update);
                }
                Err(error) => self.undo_corrections(corrected, &error.to_string(), &mut report),
            }
        }
        self.update_objects(FrameBoxes::without_boxes(), &mut report);
        self.report_pose(&mut report);
        report
    }

    /// Returns the smoother with the current graph and estimate.
    pub fn smoother(&mut self) -> &mut Smoother {
        &mut self.smoother
    }

    /// Returns the objects of the boxes of an earlier frame with all frames known. `names` are the objects
    /// assigned so far.
    pub fn reassociate(
        &self,
        frame: usize,
        observation: &Observation,
        names: &[Option<ObjectId>],
    ) -> Vec<Option<ObjectId>> {
        let none = (self.live_poses.len(), Se3::identity());
        let Some(pose) = self.association_context(none).pose(frame) else { return names.to_vec() };
        let (timestamp, detections) = (observation.frame.timestamp, observation.detections.as_slice());
        self.associator.reassociate(
            &FrameDetections { frame, timestamp, detections },
            names,
            &self.association_context((frame, pose)),
        )
    }

    /// Returns the current ids of the objects of all detections.
    pub fn id_changes(&self) -> &ObjectIdChanges {
        &self.id_changes
    }

    /// Returns the measurements of each object.
    pub fn measurements(&self) -> &Measurements {
        &self.measurements
    }

    /// Returns the number of objects in the map.
    pub fn mapped_objects(&self) -> usize {
        self.objects.values().filter(|object| object.is_mapped()).count()
    }

    /// Returns the pose estimates at the time of their frames.
    pub fn live_poses(&self) -> &[StampedPose] {
        &self.live_poses
    }

    /// Solves the whole graph as one batch, starting from the estimate. Objects that could not be initialized
    /// online are tried again with all their boxes, so the final map has the objects of a batch.
    ///
    /// # Errors
    /// If `sequence`, which contains all accepted frames, is empty, or the graph cannot be solved.
    pub fn finish(
        self,
        sequence: Arc<Sequence>,
        observer: &mut dyn Observer,
    ) -> Result<Estimate, FinishError> {
        let frame = self.up.map_frame().ok_or(MappingError::NoFrames)?;
        let start_of_pose = |i: usize| match self.frames.get(i).filter(|_| self.is_corrected) {
            // the estimate at the time is older than the correction
            Some(corrected) => {
                Some(self.pose(i).unwrap_or(frame.map_from_odometry.compose(&corrected.world_from_camera)))
            }
            None => self.pose_of(i),
        };
        let poses: Vec<Se3> = (0..self.live_poses.len()).filter_map(start_of_pose).collect();
        let start = |measured: &ObjectMeasurements| match self
            .objects
            .get(&measured.id)
            .and_then(ObjectState::initial_value)
        {
            Some(start) => Ok(start),
            None => {
                let at = |i: usize| Some(StampedPose { pose: *poses.get(i)?, ..*self.live_poses.get(i)? });
                rejection::initial_quadric(measured, at, &self.batch_settings)
            }
        };
        let starts = self.measurements.objects.iter().map(start).collect();
        let decisions = self.semantic_factors.complete_decisions(
            &self.measurements,
            starts,
            &self.batch_settings,
            frame.up,
        );
        let decisions = decisions.map_err(MappingError::from)?;
        let mapping =
            Mapping::assemble(&sequence, &self.batch_settings, frame, self.measurements, decisions)?;
        let mut values = mapping.values.clone();
        for (i, pose) in poses.into_iter().enumerate() {
            values.insert(pose_key(i), pose);
        }
        for (key, value) in self.smoother.estimates().iter() {
            if values.contains(key.as_str()) {
                values.insert_boxed(key.clone(), value.erased().clone_box());
            }
        }
        Ok(Estimate::from_start(sequence, mapping, values, &self.batch_settings, observer)?)
    }

    /// Returns the estimate of a pose; `None` if it is not in the smoother.
    fn pose(&self, frame: usize) -> Option<Se3> {
        self.smoother.get(pose_key(frame).as_str()).ok()
    }

    /// Returns the estimate of a pose with its time. Includes the frame in progress.
    fn stamped_pose(&self, frame: usize) -> Option<StampedPose> {
        let timestamp = self.live_poses.get(frame).map(|live| live.timestamp);
        let newest = self.frames.last().map(|last| last.timestamp);
        Some(StampedPose { timestamp: timestamp.or(newest)?, pose: self.pose(frame)? })
    }

    fn measured(&self, id: ObjectId) -> Option<&ObjectMeasurements> {
        self.measurements.object(id)
    }

    fn quadric(&self, id: ObjectId) -> Option<DualQuadric> {
        self.smoother.get(object_key(id).as_str()).ok()
    }
}
