//! Mapping frame by frame, as they come.
//!
//! A [`Mapper`] takes a frame with its boxes and has the pose and the map up to date before the next one. What
//! [`Mapping`] decides with all boxes in view is decided here when an object is *born*, which is as soon as it can be
//! placed, and decided again where later boxes say otherwise.
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
use manifactor_graph::manifold_name;
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
use manifactor_smoother::{ChangeError, ManifoldType, Session, UpdateError};
use manifactor_solve::Observer;
use object::Tracked;
use std::any::TypeId;
use std::collections::BTreeMap;
use std::sync::Arc;

pub use frame::FrameReport;
pub use locate::Located;

/// A map that grows with each frame.
///
/// It keeps what a batch solve at the end needs: some 70 bytes for each frame, and 50 for each box; and each object, where boxes are
/// put to objects, with its detections. Everything else is bounded by the window of the session, where there is one.
#[derive(Debug)]
pub struct Mapper {
    settings: Arc<Settings>,
    camera: Camera,
    session: Session,
    up: Up,
    associator: Box<dyn Associator>,
    /// What boxes are called now that were called otherwise when they came.
    names: Names,
    /// What was learned of earlier frames, for the next update.
    pending: Vec<Learned>,
    measurements: Measurements,
    objects: BTreeMap<ObjectId, Tracked>,
    ledger: Ledger,
    /// The last frame that was taken.
    last: Option<Frame>,
    /// Each pose as it was estimated when its frame came.
    live: Vec<StampedPose>,
}

/// Why a frame is refused. The map is as it was; the next frame is tied to the last one that was taken.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// A time stamp that does not come after the one before.
    #[error("the frame at {timestamp} s is left out: it does not come after the one before, at {before} s")]
    Time {
        /// In seconds.
        timestamp: f64,
        /// In seconds.
        before: f64,
    },
    /// What the source gives is no frame.
    #[error("left out: {0}")]
    Source(String),
    /// A pose or a time stamp that is not a number.
    #[error("the frame at {timestamp} s is left out: its pose by odometry, or its time stamp, is not finite")]
    NotFinite {
        /// In seconds.
        timestamp: f64,
    },
    /// Up is unknown.
    #[error(transparent)]
    Gravity(#[from] GravityError),
    /// A semantic rule that cannot be applied.
    #[error(transparent)]
    Rule(#[from] RuleError),
    /// A step that the motion model has no factor for.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// Factors that do not fit.
    #[error(transparent)]
    Change(#[from] ChangeError),
    /// A pose that cannot be taken in.
    #[error(transparent)]
    Update(#[from] UpdateError),
}

/// Why a map could not be finished.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FinishError {
    /// There is no graph.
    #[error(transparent)]
    Mapping(#[from] MappingError),
    /// The graph cannot be solved.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
}

impl Mapper {
    /// An empty map, by the settings [for streams](Settings::for_stream). If the settings have a prior map and the start in it, the
    /// map begins with its objects.
    pub fn new(opening: Opening, settings: &Settings) -> Self {
        let settings = settings.clone().for_stream();
        let mut online = settings.online.clone();
        if let Some(window) = &mut online.window {
            // poses leave, and nothing else
            let own = settings.own.values.iter().map(|(_, value)| value.typetag_name());
            let kept = own.chain([manifold_name(TypeId::of::<DualQuadric>())]);
            window.keep.extend(kept.filter_map(|name| ManifoldType::try_from(name.to_owned()).ok()));
        }
        let trusted = settings.prior_map.as_ref().filter(|prior| prior.start.is_some());
        let known = trusted.map(|prior| prior.trusted_map().objects).unwrap_or_default();
        let measurements = Measurements::new(settings.anchor());
        let objects =
            measurements.objects.iter().filter_map(|measured| Some((measured.id, Tracked::known(measured)?)));
        Self {
            camera: opening.camera,
            session: Session::new(online),
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

    /// Takes a frame in: its pose, and its boxes of objects that are in the map; then objects that it completes. The settings'
    /// `association` says which object a box shows.
    ///
    /// # Errors
    /// If the pose cannot be taken. Boxes that cannot be taken are no error: the report tells of them.
    pub fn take(&mut self, observation: &Observation) -> Result<FrameReport, FrameError> {
        let mut report = FrameReport::new(self.live.len(), observation.frame.timestamp);
        let seen = self.take_pose(observation, &mut report)?;
        self.revise(seen, &mut report);
        report.pose = self.pose(report.frame).unwrap_or(report.pose);
        self.live.push(StampedPose { timestamp: report.timestamp, pose: report.pose });
        Ok(report)
    }

    /// Looks back at all frames when no other comes, and corrects what they were thought to show. What comes of it is told as if of the last
    /// frame.
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

    /// The graph so far, with its estimate.
    pub fn session(&mut self) -> &mut Session {
        &mut self.session
    }

    /// The objects of a frame's boxes, which had these names, when all other frames have been seen.
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

    /// What boxes are called now.
    pub fn names(&self) -> &Names {
        &self.names
    }

    /// What is measured of each object.
    pub fn measurements(&self) -> &Measurements {
        &self.measurements
    }

    /// Objects that are in the map.
    pub fn mapped(&self) -> usize {
        self.objects.values().filter(|object| object.is_mapped()).count()
    }

    /// Each pose as it was estimated when its frame came.
    pub fn live(&self) -> &[StampedPose] {
        &self.live
    }

    /// Solves all of it as one batch, from the estimate. Objects that were never seen from far enough apart to be placed as
    /// they came have another chance, with all their boxes: what is mapped in the end is what a batch maps.
    ///
    /// # Errors
    /// If `sequence`, all frames that were taken, has none, or the graph cannot be solved.
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

    /// The estimate of a pose; `None`, where it is not there, or not any more.
    fn pose(&self, frame: usize) -> Option<Se3> {
        self.session.get(pose_key(frame).as_str()).ok()
    }

    /// The same, with its time; of the frame that is being taken as well.
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
