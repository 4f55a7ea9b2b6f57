//! A seeded simulator of the paper's protocol (Jablonsky, Milford and Sünderhauf, section V-B).
//!
//! It simulates a scene of solids, a camera that moves around them, and noisy odometry and boxes. Scene,
//! trajectory and noise have separate seeds. Equal settings give equal bits.
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::{Direction, register};
use manifactor_quadric::Camera;
use manifactor_recording::camera::{CameraNameError, Cameras};
use manifactor_recording::sequence::{Acceleration, Frame, GroundTruth, Sequence};
use manifactor_recording::source::{InputFolders, SequenceSource, SourceError};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

mod catalogue;
mod detection;
mod moves;
mod noise;
mod occlusion;
#[cfg(test)]
mod round_trip_tests;
mod scene;
mod solid;
mod trajectory;

pub use noise::{AccelerometerNoise, DetectorSettings, MotionNoise, NoiseSpread};
pub use scene::SceneSettings;
pub use trajectory::TrajectorySettings;

use detection::DetectorErrors;

/// Simulated scene, trajectory and detector.
///
/// Objects are solids with flat faces (cuboids, round bodies, folded sheets) that rest on a plane. Their
/// boxes enclose the projected corners, clipped by the image border, so an ellipsoid is only a model of their
/// shape. Odometry has 5 % noise of translation and 15 % of rotation, and boxes have 2 px. `seed` is the seed
/// of the noise. The scene and the trajectory have separate seeds, and changing one of them also changes the
/// noise.
///
/// ```toml
/// source = { type = "simulated", seed = 1, scene = { seed = 3, objects = 15, tilted = 0.1 }, trajectory = { frames = 200 } }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Simulated")]
pub struct SimulatedSource {
    /// Seed of all noise.
    pub seed: u64,
    /// The camera. Default: the camera of the paper.
    pub camera: Camera,
    /// Further cameras on the same body, by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub cameras: BTreeMap<String, SimulatedCamera>,
    /// Objects of the scene.
    pub scene: SceneSettings,
    /// Motion of the camera.
    pub trajectory: TrajectorySettings,
    /// Noise of the odometry.
    pub odometry: MotionNoise,
    /// Noise of boxes and classes.
    pub detector: DetectorSettings,
    /// Accelerometer in the camera frame with one reading for each image. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accelerometer: Option<AccelerometerNoise>,
}

impl Default for SimulatedSource {
    fn default() -> Self {
        let camera =
            Camera { fx: 320.0, fy: 320.0, cx: 320.0, cy: 240.0, skew: 0.0, width: 640, height: 480 };
        Self {
            seed: 1,
            camera,
            cameras: BTreeMap::new(),
            scene: SceneSettings::default(),
            trajectory: TrajectorySettings::default(),
            odometry: MotionNoise::default(),
            detector: DetectorSettings::default(),
            accelerometer: None,
        }
    }
}

/// A further camera on the body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SimulatedCamera {
    /// The camera.
    pub camera: Camera,
    /// Pose of the camera in the frame of the first camera: the translation in metres, and the rotation as a unit
    /// quaternion (x, y, z, w).
    pub body_from_camera: Se3,
}

/// Error that prevents a simulation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// A class without a known solid.
    #[error("no solid is known for the class `{class}`; those known are {}", known.join(", "))]
    UnknownClass {
        /// The class.
        class: String,
        /// Known classes.
        known: Vec<&'static str>,
    },
    /// A further camera whose name cannot be used.
    #[error(transparent)]
    CameraName(#[from] CameraNameError),
    /// Too many objects for the rectangle.
    #[error(
        "there is no room for object {object} of the scene: make `scene.area` larger, or `scene.objects`, `scene.moved` or `scene.gap` less"
    )]
    NoRoom {
        /// Number of the object, from 0.
        object: usize,
    },
}

impl SimulatedSource {
    /// Runs the simulation.
    ///
    /// # Errors
    /// Invalid settings, or a scene without enough room.
    pub fn simulate(&self) -> Result<Sequence, SimulationError> {
        let scene = self.scene.scene()?;
        let mut path = Pcg64::seed_from_u64(self.trajectory.seed);
        let poses = self.trajectory.poses(*self.scene.height, &mut path);
        // mixes the seeds, so that trials with different scenes or trajectories have independent noise for
        // any seed
        let seeds = [self.seed, self.scene.seed, self.trajectory.seed];
        let mixed = seeds.iter().fold(0, |mixed, seed| Pcg64::seed_from_u64(mixed ^ seed).next_u64());
        // separate random streams: more draws from one do not change the rest
        let mut noise = Pcg64::seed_from_u64(mixed);
        let (mut motion, boxes) = (Pcg64::from_rng(&mut noise), Pcg64::from_rng(&mut noise));

        let time = |i: usize| i as f64 * *self.trajectory.interval;
        let mut frames: Vec<Frame> = vec![];
        for (i, pose) in poses.iter().enumerate() {
            let world_from_camera = match (i.checked_sub(1).map(|j| &poses[j]), frames.last()) {
                (Some(before), Some(last)) => {
                    let measured = self.odometry.add_noise(&before.between(pose), &mut motion);
                    last.world_from_camera.compose(&measured)
                }
                _ => *pose,
            };
            frames.push(Frame::new(time(i), world_from_camera));
        }
        let stamped = |(i, pose): (usize, &_)| StampedPose { timestamp: time(i), pose: *pose };
        let [mut imagination, mistakes, mut felt, depths] = [(); 4].map(|()| Pcg64::from_rng(&mut noise));
        let count = scene.objects.len();
        let before = DetectorErrors::new(count, boxes, mistakes, depths);
        let after = DetectorErrors::draw(count, &mut noise);
        let mut cameras = Cameras::new(self.camera);
        for (name, further) in &self.cameras {
            cameras.add(name, further.camera, further.body_from_camera)?;
        }
        let mut detections = self.detect(&scene, cameras.first(), &poses, [before, after], &mut imagination);
        for camera in cameras.iter().skip(1) {
            let errors = [(); 2].map(|()| DetectorErrors::draw(count, &mut noise));
            detections.extend(self.detect(&scene, camera, &poses, errors, &mut imagination));
        }
        detections.sort_by_key(|detection| detection.frame);
        let readings = self.accelerometer.as_ref().map(|sensor| {
            let readings = sensor.read(&poses, *self.trajectory.interval, &mut felt).into_iter().enumerate();
            readings.map(|(i, acceleration)| Acceleration { timestamp: time(i), acceleration }).collect()
        });
        let truth = GroundTruth {
            trajectory: poses.iter().enumerate().map(stamped).collect(),
            objects: scene.true_objects(time(poses.len() - 1)),
        };
        Ok(Sequence {
            cameras,
            body_from_camera: None,
            frames,
            detections,
            up: Some(Direction::Z),
            accelerometer: readings.unwrap_or_default(),
            ground_truth: Some(truth),
            georeference: None,
            pose_factors: vec![],
            corrected_jumps: vec![],
            unused: vec![],
        })
    }
}

#[typetag::serialize(name = "simulated")]
impl SequenceSource for SimulatedSource {
    fn load(&self, _: &InputFolders) -> Result<Sequence, SourceError> {
        self.simulate().map_err(|e| SourceError::Simulation(e.to_string()))
    }
}
register!(dyn SequenceSource, "simulated", SimulatedSource);

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_graph::checked::{Count, Finite, NotNegative, Share};
    use nalgebra::Vector3;
    use std::collections::BTreeMap;

    #[test]
    fn the_same_settings_give_the_same_bits() {
        let [a, b] = [(); 2].map(|()| SimulatedSource::default().simulate().unwrap());
        assert_eq!((a.frames, a.detections), (b.frames, b.detections));
        let other = SimulatedSource { seed: 2, ..SimulatedSource::default() }.simulate().unwrap();
        let again = SimulatedSource::default().simulate().unwrap();
        assert_ne!(other.frames, again.frames);
        assert_eq!(other.ground_truth.unwrap().objects, again.ground_truth.unwrap().objects);
    }

    #[test]
    fn the_noise_of_another_trajectory_is_another() {
        let turns = |seed| {
            let mut settings = SimulatedSource::default();
            settings.trajectory.seed = seed;
            let sequence = settings.simulate().unwrap();
            let truth = sequence.ground_truth.unwrap().trajectory;
            let error = |i: usize| {
                let [a, b] = [i, i + 1].map(|i| &sequence.frames[i].world_from_camera);
                let [c, d] = [i, i + 1].map(|i| &truth[i].pose);
                c.between(d).between(&a.between(b)).rotation.log() / c.between(d).rotation.log().norm()
            };
            (0..100).map(error).collect::<Vec<_>>()
        };
        let (a, b) = (turns(1), turns(2));
        let dot = |x: &[nalgebra::Vector3<f64>], y: &[nalgebra::Vector3<f64>]| {
            x.iter().zip(y).map(|(x, y)| x.dot(y)).sum::<f64>()
        };
        let correlation = dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt();
        assert!(correlation.abs() < 0.3, "{correlation}");
    }

    #[test]
    fn without_noise_all_is_as_it_is() {
        let mut settings = SimulatedSource::default();
        settings.odometry = MotionNoise {
            translation: NotNegative::literal(0.0),
            rotation: NotNegative::literal(0.0),
            ..settings.odometry
        };
        settings.detector.sigma_px = NotNegative::literal(0.0);
        let sequence = settings.simulate().unwrap();
        let truth = sequence.ground_truth.unwrap();
        for (frame, stamped) in sequence.frames.iter().zip(&truth.trajectory) {
            let error = stamped.pose.between(&frame.world_from_camera).log();
            assert!(error.norm() < 1e-9, "{error}");
        }
        for detection in &sequence.detections {
            let object = truth.objects.iter().find(|o| Some(o.id) == detection.object).unwrap();
            assert_eq!(detection.scores.best().unwrap().0, object.class);
        }
    }

    #[test]
    fn noise_is_as_large_as_it_says() {
        let mut settings = SimulatedSource::default();
        settings.trajectory.frames = Count::literal(4000);
        let sequence = settings.simulate().unwrap();
        let truth = sequence.ground_truth.unwrap().trajectory;
        let (mut shift, mut turn) = (0.0, 0.0);
        for i in 1..truth.len() {
            let motion = truth[i - 1].pose.between(&truth[i].pose);
            let measured =
                sequence.frames[i - 1].world_from_camera.between(&sequence.frames[i].world_from_camera);
            let error = motion.between(&measured);
            shift += (error.translation.norm() / motion.translation.norm()).powi(2);
            turn += (error.rotation.log().norm() / motion.rotation.log().norm()).powi(2);
        }
        let n = (truth.len() - 1) as f64;
        let (shift, turn) = ((shift / n).sqrt(), (turn / n).sqrt());
        assert!((shift - 0.05).abs() < 0.005 && (turn - 0.15).abs() < 0.01, "{shift} {turn}");
    }

    #[test]
    fn each_object_rests_on_the_plane_and_is_seen() {
        let mut settings = SimulatedSource::default();
        settings.scene.tilted = Share::literal(0.5);
        settings.scene.height = Finite::literal(0.7);
        let sequence = settings.simulate().unwrap();
        let objects = sequence.ground_truth.unwrap().objects;
        assert_eq!(objects.len(), 15);
        for object in objects {
            assert!((object.bounding_box.min.z - 0.7).abs() < 1e-9);
            let views = sequence.detections.iter().filter(|d| d.object == Some(object.id)).count();
            assert!(views > 20, "{} is seen {views} times", object.class);
        }
    }

    #[test]
    fn rates_are_kept() {
        let count = |change: fn(&mut DetectorSettings)| {
            let mut settings = SimulatedSource::default();
            change(&mut settings.detector);
            settings.simulate().unwrap().detections.len() as f64
        };
        let all = count(|_| {});
        let share = count(|d| d.missed = Share::literal(0.25)) / all;
        assert!((share - 0.75).abs() < 0.03, "{share}");
        assert_eq!(count(|d| d.confused = Share::literal(0.5)), all);
    }

    #[test]
    fn what_others_hide_is_seen_less_and_no_other_box_changes() {
        let boxes = |hide| {
            let mut settings = SimulatedSource::default();
            settings.detector.occluded_by_objects = hide;
            let detections = settings.simulate().unwrap().detections.into_iter();
            detections.map(|d| ((d.frame, d.object), d.bounding_box)).collect::<BTreeMap<_, _>>()
        };
        let (all, left) = (boxes(false), boxes(true));
        assert!(left.len() < all.len() && left.keys().all(|key| all.contains_key(key)));
        let same = left.iter().filter(|(key, found)| all[*key] == **found).count() as f64;
        let share = same / left.len() as f64;
        assert!((0.5..0.99).contains(&share), "{share}");
    }

    #[test]
    fn boxes_of_a_wrong_object_are_as_many_as_said() {
        let mut settings = SimulatedSource::default();
        let right = settings.simulate().unwrap().detections;
        settings.detector.wrong_object = Share::literal(0.2);
        let wrong = settings.simulate().unwrap().detections;
        assert_eq!(right.len(), wrong.len());
        let pairs = || right.iter().zip(&wrong);
        assert!(pairs().all(|(a, b)| a.bounding_box == b.bounding_box));
        let share = pairs().filter(|(a, b)| a.object != b.object).count() as f64 / right.len() as f64;
        assert!((share - 0.2).abs() < 0.03, "{share}");
    }

    #[test]
    fn an_accelerometer_feels_up_and_its_own_motion() {
        let sensor = AccelerometerNoise { sigma: NotNegative::literal(0.0), bias: NotNegative::literal(0.0) };
        let settings = SimulatedSource { accelerometer: Some(sensor), ..SimulatedSource::default() };
        let sequence = settings.simulate().unwrap();
        let truth = &sequence.ground_truth.as_ref().unwrap().trajectory;
        assert_eq!(sequence.accelerometer.len(), truth.len());
        for (reading, pose) in sequence.accelerometer.iter().zip(truth) {
            let felt = pose.pose.rotation.act(&reading.acceleration);
            assert!((felt - Vector3::z() * 9.81).norm() < 1.5, "{felt}");
        }
        let before = SimulatedSource::default().simulate().unwrap();
        assert_eq!(sequence.detections, before.detections);
        let mut two = settings;
        two.trajectory.frames = Count::literal(2);
        for reading in two.simulate().unwrap().accelerometer {
            assert!((reading.acceleration.norm() - 9.81).abs() < 1e-9, "{reading:?}");
        }
    }

    #[test]
    fn settings_that_make_no_sense_are_refused() {
        let read = |settings: &str| {
            serde_json::from_str::<SimulatedSource>(settings).map_err(|error| error.to_string())
        };
        for (settings, expected) in [
            (r#"{"scene": {"tilted": 1.5}}"#, "from 0 to 1, got 1.5"),
            (r#"{"scene": {"moved_at_s": -1}}"#, "0 or more, got -1"),
            (r#"{"detector": {"wrong_object": 2}}"#, "from 0 to 1, got 2"),
            (r#"{"accelerometer": {"sigma": -1}}"#, "0 or more, got -1"),
            (r#"{"scene": {"objects": 10001}}"#, "at most 10000, got 10001"),
            (r#"{"trajectory": {"frames": 0}}"#, "from 2 to 1000000, got 0"),
            (r#"{"trajectory": {"interval": 0}}"#, "above zero, got 0"),
        ] {
            assert!(read(settings).unwrap_err().contains(expected), "{settings}");
        }
        for (settings, expected) in [
            (r#"{"scene": {"objects": 5000}}"#, "no room"),
            (r#"{"scene": {"classes": ["unicorn"]}}"#, "unicorn"),
        ] {
            assert!(read(settings).unwrap().simulate().unwrap_err().to_string().contains(expected));
        }
    }
}
