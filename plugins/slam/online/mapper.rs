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
mod present;
mod revision;

use association::Known;
use frame::Seen;
use gravity::Up;
use manifactor_association::{Associator, Image, Learned, Map, Names};
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::{TypeName, manifold_name};
use manifactor_mapping::estimate::{Estimate, EstimateError};
use manifactor_mapping::gravity::GravityError;
use manifactor_mapping::mapping::measurements::{Measured, Measurements};
use manifactor_mapping::mapping::rules::Ledger;
use manifactor_mapping::mapping::{Mapping, MappingError, object_key, pose_key, rejection};
use manifactor_mapping::motion::MotionError;
use manifactor_mapping::semantics::RuleError;
use manifactor_mapping::settings::Settings;
use manifactor_quadric::{Camera, DualQuadric};
use manifactor_recording::sequence::{Frame, ObjectId, Observation, Opening, Sequence};
use manifactor_smoother::{ChangeError, Smoother, UpdateError};
use manifactor_solve::Observer;
use object::Tracked;
use std::any::TypeId;
use std::collections::BTreeMap;
use std::sync::Arc;

pub use frame::FrameReport;
pub use locate::Located;

/// A map that grows with each frame.
///
/// It keeps the data for a batch solve at the end: about 70 bytes per frame, and 50 per box. With data
/// association, it also keeps each object with its detections. Everything else is bounded by the window of
/// the smoother, if there is one.
#[derive(Debug)]
pub struct Mapper {
    settings: Arc<Settings>,
    camera: Camera,
    session: Smoother,
    up: Up,
    associator: Box<dyn Associator>,
    /// Current objects of detections that were assigned differently at first.
    names: Names,
    /// Corrections to earlier frames, for the next update.
    pending: Vec<Learned>,
    measurements: Measurements,
    objects: BTreeMap<ObjectId, Tracked>,
    ledger: Ledger,
    /// The last accepted frame.
    last: Option<Frame>,
    /// Pose estimates at the time of their frames.
    live: Vec<StampedPose>,
}

/// Reason why a frame is rejected. The map stays unchanged, and the next frame is connected to the last
/// accepted one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// The timestamp is not later than the one before.
    #[error("the frame at {timestamp} s is left out: it does not come after the one before, at {before} s")]
    Time {
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
    /// Creates a map with the settings [for streams](Settings::for_stream). It is empty, or has the objects
    /// of the prior map if the settings give one with a start pose.
    pub fn new(opening: Opening, settings: &Settings) -> Self {
        let settings = settings.clone().for_stream();
        let mut online = settings.online.clone();
        if let Some(window) = &mut online.window {
            // only poses leave the window
            let own = settings.own.values.iter().map(|(_, value)| value.typetag_name());
            let kept = own.chain([manifold_name(TypeId::of::<DualQuadric>())]);
            window.keep.extend(kept.filter_map(|name| TypeName::new(name).ok()));
        }
        let trusted = settings.prior_map.as_ref().filter(|prior| prior.start.is_some());
        let known = trusted.map(|prior| prior.trusted_map().objects).unwrap_or_default();
        let measurements = Measurements::new(settings.anchor());
        let objects =
            measurements.objects.iter().filter_map(|measured| Some((measured.id, Tracked::known(measured)?)));
        Self {
            camera: opening.camera,
            session: Smoother::new(online),
            associator: settings.association.begin(opening.camera, &settings.aliases, &known),
            settings: Arc::new(settings),
            names: Names::default(),
            pending: vec![],
            up: Up::new(opening),
            objects: objects.collect(),
            measurements,
            ledger: Ledger::default(),
            last: None,
            live: vec![],
        }
    }

    /// Adds a frame: its pose, and its boxes of mapped objects; then objects that can be initialized with it.
    /// The `association` of the settings assigns the boxes to objects.
    ///
    /// # Errors
    /// If the pose is rejected. Rejected boxes are not an error: the report lists them.
    pub fn take(&mut self, observation: &Observation) -> Result<FrameReport, FrameError> {
        let mut report = FrameReport::new(self.live.len(), observation.frame.timestamp);
        let seen = self.take_pose(observation, &mut report)?;
        self.revise(seen, &mut report);
        report.pose = self.pose(report.frame).unwrap_or(report.pose);
        self.live.push(StampedPose { timestamp: report.timestamp, pose: report.pose });
        Ok(report)
    }

    /// Reconsiders all frames after the last one, and corrects their data association. The changes are
    /// reported as those of the last frame.
    pub fn settle(&mut self) -> FrameReport {
        let frame = self.live.len();
        let last = self.last.as_ref().map_or(0.0, |last| last.timestamp);
        let mut report = FrameReport::new(frame.saturating_sub(1), last);
        let (live, session, measurements) = (&self.live, &self.session, &self.measurements);
        let known = Known { newest: (frame, Se3::identity()), live, session, measurements };
        let learned = self.associator.settle(&known);
        self.teach(learned, &mut report);
        if let Some(corrected) = self.correct(&mut report) {
            match self.session.update() {
                Ok(update) => {
                    self.names = corrected.names;
                    report.updates.push(update);
                }
                Err(error) => self.undo(corrected, &error.to_string(), &mut report),
            }
        }
        self.revise(Seen::nothing(), &mut report);
        report.pose = self.pose(report.frame).unwrap_or(report.pose);
        report
    }

    /// Returns the smoother with the current graph and estimate.
    pub fn session(&mut self) -> &mut Smoother {
        &mut self.session
    }

    /// Returns the objects of the boxes of an earlier frame with all frames known. `names` are the objects
    /// assigned so far.
    pub fn reconsider(
        &self,
        frame: usize,
        observation: &Observation,
        names: &[Option<ObjectId>],
    ) -> Vec<Option<ObjectId>> {
        let none = (self.live.len(), Se3::identity());
        let Some(pose) = self.known(none).pose(frame) else { return names.to_vec() };
        let (timestamp, detections) = (observation.frame.timestamp, observation.detections.as_slice());
        self.associator.reconsider(&Image { frame, timestamp, detections }, names, &self.known((frame, pose)))
    }

    /// Returns the current ids of the objects of all detections.
    pub fn names(&self) -> &Names {
        &self.names
    }

    /// Returns the measurements of each object.
    pub fn measurements(&self) -> &Measurements {
        &self.measurements
    }

    /// Returns the number of objects in the map.
    pub fn mapped(&self) -> usize {
        self.objects.values().filter(|object| object.is_mapped()).count()
    }

    /// Returns the pose estimates at the time of their frames.
    pub fn live(&self) -> &[StampedPose] {
        &self.live
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
        let frame = self.up.frame().ok_or(MappingError::NoFrames)?;
        let poses: Vec<Se3> = (0..self.live.len()).filter_map(|i| self.pose_of(i)).collect();
        let start = |measured: &Measured| match self.objects.get(&measured.id).and_then(Tracked::born_as) {
            Some(start) => Ok(start),
            None => {
                let at = |i: usize| Some(StampedPose { pose: *poses.get(i)?, ..*self.live.get(i)? });
                rejection::start(measured, at, self.camera, &self.settings)
            }
        };
        let starts = self.measurements.objects.iter().map(start).collect();
        let decisions = self.ledger.complete(&self.measurements, starts, &self.settings, frame.up);
        let decisions = decisions.map_err(MappingError::from)?;
        let mapping = Mapping::assemble(&sequence, &self.settings, frame, self.measurements, decisions)?;
        let mut values = mapping.values.clone();
        for (i, pose) in poses.into_iter().enumerate() {
            values.insert(pose_key(i), pose);
        }
        for (key, value) in self.session.estimates().iter() {
            if values.contains(key.as_str()) {
                values.insert_boxed(key.clone(), value.erased().clone_box());
            }
        }
        Ok(Estimate::from_start(sequence, mapping, values, &self.settings, observer)?)
    }

    /// Returns the estimate of a pose; `None` if it is not in the smoother.
    fn pose(&self, frame: usize) -> Option<Se3> {
        self.session.get(pose_key(frame).as_str()).ok()
    }

    /// Returns the estimate of a pose with its time. Includes the frame in progress.
    fn at(&self, frame: usize) -> Option<StampedPose> {
        let timestamp = self.live.get(frame).map(|live| live.timestamp);
        let newest = self.last.as_ref().map(|last| last.timestamp);
        Some(StampedPose { timestamp: timestamp.or(newest)?, pose: self.pose(frame)? })
    }

    fn measured(&self, id: ObjectId) -> Option<&Measured> {
        self.measurements.object(id)
    }

    fn quadric(&self, id: ObjectId) -> Option<DualQuadric> {
        self.session.get(object_key(id).as_str()).ok()
    }
}
