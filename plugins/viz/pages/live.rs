//! The state of a growing map for its live page.
mod notes;
mod path;
#[cfg(test)]
mod tests;

use super::viewer::{bounds, number, of_box, of_frame, of_object, of_scenes, scene};
use crate::canvas::Ink;
use manifactor_formats::replay::Latencies;
use manifactor_graph::{Direction, Key};
use manifactor_quadric::{BoundingBox, Camera, DualQuadric};
use manifactor_slam::estimate::{Estimate, LandmarkEstimate};
use manifactor_slam::mapping::object_key;
use manifactor_slam::measurements::ObjectMeasurements;
use manifactor_slam::online::{FrameReport, Mapper};
use manifactor_slam::record::{BoxRecord, FrameRecord, ObjectRecord, PoseRecord};
use manifactor_slam::run::MappedFrame;
use manifactor_slam::sequence::{ObjectId, Observation};
use nalgebra::Vector3;
use notes::Notes;
use path::Path;
use serde_json::{Value, json};
use std::collections::VecDeque;

/// Number of recent frames whose latencies are shown.
const LATENCIES: usize = 300;
/// Largest number of undetermined variables and directions that are listed.
const NAMED: usize = 20;
/// Largest length of a class name next to a box. Unit: characters.
const ROOM: usize = 20;

/// State of the [`live_page`](crate::live_page). Updates and clones are cheap, so the mapping thread never
/// waits for browsers: a server encodes a clone.
#[derive(Debug, Clone, Default)]
pub struct LiveMap {
    title: String,
    variant: String,
    phase: Phase,
    /// Number of accepted frames.
    frames: usize,
    timestamp: f64,
    camera: Option<Camera>,
    up: Direction,
    path: Path,
    boxes: Vec<LiveBox>,
    objects: Vec<ObjectRecord>,
    /// Classes in order of appearance, so that their colours stay.
    classes: Vec<String>,
    seconds: VecDeque<f64>,
    cost: Option<f64>,
    /// Number of undetermined variables and directions, and descriptions of the first of them.
    waiting: usize,
    undetermined: Vec<String>,
    boxes_so_far: usize,
    notes: Notes,
}

/// Phase of a stream.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Phase {
    /// Before the first frame.
    #[default]
    Waiting,
    /// Frames arrive.
    Running,
    /// All frames have arrived, and are solved as one batch.
    Solving {
        /// Iterations so far.
        iteration: usize,
    },
    /// The end, with a message.
    Ended(String),
}

/// A box of the last frame.
#[derive(Debug, Clone)]
enum LiveBox {
    /// The box of an object.
    Named(BoxRecord, String),
    /// A box without an object, or of an object that is not in the map yet.
    Nameless(BoundingBox, String),
}

impl LiveMap {
    /// Creates an empty map with the run's title and the variant's name.
    pub fn new(title: &str, variant: &str) -> Self {
        Self { title: title.to_owned(), variant: variant.to_owned(), ..Self::default() }
    }

    /// Adds the result of a frame. The time depends on the number of objects and boxes, but not on the
    /// length of the path.
    pub fn add_frame(&mut self, frame: &MappedFrame<'_>) {
        self.phase = Phase::Running;
        let mapper = &*frame.mapper;
        let report = match frame.report {
            Ok(report) => report,
            Err(error) => return self.notes.add_skipped_frame(self.frames, &error.to_string()),
        };
        if self.seconds.len() == LATENCIES {
            self.seconds.pop_front();
        }
        self.seconds.push_back(frame.seconds);
        (self.frames, self.timestamp) = (report.frame + 1, report.timestamp);
        self.boxes_so_far += report.boxes;
        if let Some(located) = &report.located {
            // the earlier frames were mapped again in the frame of the prior map
            self.path.begin_odometry_at(&located.start);
            self.path.correct(|frame| mapper.pose_of(frame));
        }
        let class = |key: &Key| {
            let measured = mapper.measurements().objects.iter().find(|object| object_key(object.id) == *key);
            measured.and_then(ObjectMeasurements::class_name)
        };
        self.notes.add_events(report, |id| mapper.id_changes().current_id(id), class);
        let undetermined = report
            .updates
            .last()
            .map(|update| (&update.undetermined_variables, &update.undetermined_directions));
        if let Some((variables, directions)) = undetermined {
            self.waiting = variables.len() + directions.len();
            let variables = variables.iter().map(ToString::to_string);
            let directions = directions.iter().map(|(key, direction)| format!("{key}: {direction}"));
            self.undetermined = variables.chain(directions).take(NAMED).collect();
        }
        self.update_objects(mapper);
        if let Some(observation) = frame.observation {
            let odometry = mapper.odometry(observation).unwrap_or(report.pose);
            let tracked = |pose| PoseRecord { pose, error: None, relative: None };
            self.path.push(FrameRecord {
                timestamp: report.timestamp,
                truth: None,
                odometry: tracked(odometry),
                estimate: tracked(report.pose),
                boxes: vec![],
            });
            self.set_boxes(report, observation, mapper);
        }
    }

    /// Updates the whole path and the cost. The time is linear in the size of the map.
    pub fn refresh(&mut self, mapper: &mut Mapper) {
        self.path.correct(|frame| mapper.pose_of(frame));
        self.cost = Some(mapper.smoother().cost());
        self.update_objects(mapper);
    }

    /// Shows the map estimated from all frames.
    pub fn show_estimate(&mut self, estimate: &Estimate) {
        let poses = estimate.trajectory();
        self.path.correct(|frame| poses.get(frame).map(|stamped| stamped.pose));
        let landmarks = estimate.landmarks();
        let record = |mark: &LandmarkEstimate<'_>| {
            let class = mark.object.class.as_ref().map(|class| class.name.as_str());
            record(mark.object.id, class, mark.object.boxes, *mark.quadric)
        };
        self.set_objects(landmarks.iter().map(record).collect());
        // the predictions of the last image belong to the earlier estimate
        self.boxes.iter_mut().for_each(LiveBox::forget_estimate);
        self.cost = Some(estimate.solution.outcome.final_cost);
    }

    /// Sets the phase of the stream, and the cost if it is known.
    pub fn set_phase(&mut self, phase: Phase, cost: Option<f64>) {
        self.phase = phase;
        self.cost = cost.or(self.cost);
    }

    /// Updates the objects and the up direction.
    fn update_objects(&mut self, mapper: &Mapper) {
        self.camera = Some(*mapper.camera());
        let record = |(measured, quadric): (&ObjectMeasurements, DualQuadric)| {
            record(measured.id, measured.class_name(), measured.views.len(), quadric)
        };
        self.set_objects(mapper.objects().map(record).collect());
        // if up is unknown, up in the first image is the best guess
        let image_up = || self.path.first().map(|first| first.rotation.act(&-Vector3::y()));
        let up = mapper.up().or_else(|| Direction::new(image_up()?).ok());
        self.up = up.unwrap_or(self.up);
    }

    /// Replaces the objects, and adds their new classes to the legend.
    fn set_objects(&mut self, objects: Vec<ObjectRecord>) {
        for object in &objects {
            if !self.classes.contains(&object.class) {
                self.classes.push(object.class.clone());
            }
        }
        self.objects = objects;
    }

    /// Stores the boxes of a frame, each with the prediction of the estimate.
    fn set_boxes(&mut self, report: &FrameReport, observation: &Observation, mapper: &Mapper) {
        let known = |id: ObjectId| self.objects.iter().find(|object| object.id == id);
        let boxes = observation.detections.iter().zip(&report.box_objects).map(|(detection, name)| {
            let class = detection.scores.best().map_or("unknown", |(class, _)| class);
            let Some(id) = name.map(|name| mapper.id_changes().current_id(name)) else {
                return LiveBox::Nameless(detection.bounding_box, short(class));
            };
            let object = known(id);
            let class = object.map_or(class, |object| object.class.as_str());
            let estimate = object.and_then(|object| Some((&report.pose, object.estimate.as_ref()?)));
            let seen = BoxRecord::new(id, detection.bounding_box, estimate, mapper.camera());
            LiveBox::Named(seen, format!("{} {id}", short(class)))
        });
        self.boxes = boxes.collect();
    }

    /// Returns the input of the page's script.
    pub fn to_json(&self) -> Value {
        let seconds: Vec<f64> = self.seconds.iter().copied().collect();
        let (latencies, ms) = (Latencies::of(&seconds), |seconds: f64| number(1e3 * seconds, 3));
        let (phase, words) = match &self.phase {
            Phase::Waiting => ("waiting", String::new()),
            Phase::Running => ("running", String::new()),
            Phase::Solving { iteration } => ("solving", format!("iteration {iteration}")),
            Phase::Ended(words) => ("ended", words.clone()),
        };
        json!({
            "title": self.title,
            "phase": phase,
            "words": words,
            "frames": self.frames,
            "timestamp": self.timestamp,
            "boxes": self.boxes_so_far,
            "cost": self.cost,
            "latencies": {
                "ms": seconds.iter().map(|seconds| ms(*seconds)).collect::<Vec<_>>(),
                "p50": ms(latencies.p50),
                "p99": ms(latencies.p99),
                "max": ms(latencies.max),
            },
            "waiting": self.waiting,
            "undetermined": self.undetermined,
            "notes": self.notes.to_json(),
            "run": of_scenes(&[self.scene()]),
        })
    }

    /// Returns the map in the format of the map script, which all pages share.
    fn scene(&self) -> Value {
        let color =
            |class: &String| self.classes.iter().position(|own| own == class).map_or(Ink::Text, Ink::Class);
        let objects = self.objects.iter().map(|object| of_object(object, color(&object.class)));
        let start = self.path.start();
        let mut frames: Vec<Value> = self.path.frames().map(|frame| of_frame(frame, start)).collect();
        // the boxes are the last part of a frame, and only the last frame keeps them
        for parts in frames.iter_mut().filter_map(Value::as_array_mut) {
            parts.pop();
            parts.push(Value::Null);
        }
        if let Some(boxes) = frames.last_mut().and_then(Value::as_array_mut).and_then(|last| last.last_mut())
        {
            *boxes = self.boxes.iter().map(LiveBox::to_json).collect();
        }
        let camera = self.camera.unwrap_or(NO_CAMERA);
        scene(&self.variant, &self.up, &camera, self.path.every(), &frames, &objects.collect::<Vec<_>>())
    }
}

/// Camera before the first frame.
const NO_CAMERA: Camera = Camera { fx: 1.0, fy: 1.0, cx: 0.0, cy: 0.0, skew: 0.0, width: 4, height: 3 };

impl LiveBox {
    fn forget_estimate(&mut self) {
        if let Self::Named(seen, _) = self {
            (seen.projected, seen.ellipse) = (None, None);
        }
    }

    /// Returns the box in the format of the map script, and its label.
    fn to_json(&self) -> Value {
        match self {
            Self::Named(seen, label) => match of_box(seen) {
                Value::Array(mut parts) => {
                    parts.push(Value::from(label.as_str()));
                    Value::Array(parts)
                }
                other => other,
            },
            Self::Nameless(measured, label) => json!([null, bounds(measured), null, label]),
        }
    }
}

/// Shortens a class name to the space next to its box.
fn short(class: &str) -> String {
    match class.char_indices().nth(ROOM) {
        Some((end, _)) => format!("{}…", class.get(..end).unwrap_or_default()),
        None => class.to_owned(),
    }
}

/// Returns the record of an object while frames arrive.
fn record(id: ObjectId, class: Option<&str>, boxes: usize, estimate: DualQuadric) -> ObjectRecord {
    ObjectRecord {
        id,
        key: object_key(id).to_string(),
        class: class.unwrap_or("unknown").to_owned(),
        score: None,
        boxes,
        box_rms: None,
        initial: None,
        estimate: Some(estimate),
        truth: None,
        error: None,
        factors: vec![],
        left_out: vec![],
        rejected: None,
    }
}
