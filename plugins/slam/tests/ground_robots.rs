//! Planar robots that measure landmarks with known ids.
mod mr_clam;
mod victoria_park;

use manifactor_formats::replay::Latencies;
use manifactor_geometry::{Between, Point2, Prior, Se2, So2};
use manifactor_graph::loss::Loss;
use manifactor_graph::{
    Factor, FactorEntry, Graph, Key, Lifted, Manifold, Noise, Residual, Scalar, Values, register_factor,
};
use manifactor_smoother::{Smoother, SmootherSettings};
use manifactor_solve::{LevenbergMarquardt, Silent};
use nalgebra::{U3, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::Arc;

/// Key of the steering error.
const STEERING: &str = "steering";

/// Odometry of a car with a constant steering error: the car turns by a different angle than reported, by an
/// offset in radians per metre and by a share of the angle.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, JsonSchema)]
struct Steered {
    relative: Se2,
}

impl Steered {
    fn corrected<T: Scalar>(&self, by: &Vector2<T>) -> Se2<T> {
        let relative = self.relative.lift::<T>();
        let turn = by.x * relative.translation.x + by.y * relative.rotation.log().x;
        Se2::new(So2::exp(relative.rotation.log().x + turn), relative.translation)
    }
}

impl Residual for Steered {
    type Variables = (Se2, Se2, Point2);
    type Dim = U3;

    fn residual<T: Scalar>(&self, (a, b, by): Lifted<Self::Variables, T>) -> Vector3<T> {
        self.corrected(&by).between(&a.between(&b)).log()
    }
}
register_factor!("steered", Steered);

fn data(path: &str) -> Option<PathBuf> {
    let file = crate::tum::data()?.join("online").join(path);
    file.exists().then_some(file)
}

/// Reads a table of numbers without its comments.
fn rows(path: PathBuf) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines.map(|line| line.split_whitespace().map(|field| field.parse().unwrap()).collect()).collect()
}

/// One pose of the robot, with its measurements.
struct RobotStep {
    /// Motion since the previous pose.
    odometry: Option<(Se2, Noise)>,
    seen: Vec<LandmarkMeasurement>,
}

/// A measurement of a landmark.
#[derive(Clone)]
struct LandmarkMeasurement {
    /// Id of the landmark.
    id: usize,
    /// Position relative to the robot. Unit: metres.
    place: Vector2<f64>,
    factor: Arc<dyn Factor>,
    noise: Noise,
    loss: Option<Arc<dyn Loss>>,
}

/// Results of a smoother, pose by pose.
struct SmootherRun {
    session: Smoother,
    /// Newest pose after its update, and the pose from odometry alone.
    newest: Vec<Vector2<f64>>,
    odometry: Vec<Vector2<f64>>,
    /// CPU times of the steps. Unit: milliseconds.
    times: Vec<f64>,
    /// Relative excess of the cost over a batch solve from the estimate, at some of the steps.
    gaps: Vec<f64>,
}

fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Maps landmarks by their ids.
fn drive(steps: &[RobotStep], steering: Option<&Noise>) -> SmootherRun {
    let session = Smoother::new(SmootherSettings::default());
    let mut driven = SmootherRun { session, newest: vec![], odometry: vec![], times: vec![], gaps: vec![] };
    let (mut pose, mut alone) = (Se2::identity(), Se2::identity());
    for (i, RobotStep { odometry, seen }) in steps.iter().enumerate() {
        let session = &mut driven.session;
        let (mut graph, mut values, here) = (Graph::new(), Values::new(), Key::indexed("x", i));
        if let Some((relative, noise)) = odometry {
            alone = Se2::compose(&alone, relative);
            let last = Key::indexed("x", i - 1);
            let known = session.get::<Point2>(STEERING).ok();
            let relative = match known {
                Some(steering) => {
                    let factor = Steered { relative: *relative };
                    graph.add([last, here.clone(), STEERING.into()], factor).noise(noise.clone());
                    factor.corrected(&steering.0)
                }
                None => {
                    graph.add([last, here.clone()], Between { relative: *relative }).noise(noise.clone());
                    *relative
                }
            };
            pose = Se2::compose(&pose, &relative);
        } else {
            graph.fix(here.clone());
            if let Some(prior) = steering {
                values.insert(STEERING, Point2::new(Vector2::zeros()));
                let prior = prior.clone();
                graph.add([STEERING], Prior { value: Point2::new(Vector2::zeros()) }).noise(prior);
            }
        }
        values.insert(here.clone(), pose);
        let begin = cpu_seconds();
        for seen in seen {
            let key = Key::indexed("l", seen.id);
            if session.estimate(key.as_str()).is_none() && !values.contains(key.as_str()) {
                values.insert(key.clone(), Point2::new(pose.act(&seen.place)));
            }
            let LandmarkMeasurement { factor, noise, loss, .. } = seen.clone();
            graph.push(FactorEntry { keys: vec![here.clone(), key], name: None, factor, noise, loss });
        }
        session.push(&graph, &values).unwrap();
        let report = driven.session.update().unwrap();
        driven.times.push(1e3 * (cpu_seconds() - begin));
        assert!(
            report.undetermined_variables.is_empty() && report.undetermined_directions.is_empty(),
            "{report:?}"
        );
        pose = driven.session.get(here.as_str()).unwrap();
        driven.newest.push(pose.translation);
        driven.odometry.push(alone.translation);
        if i % 500 == 499 || i + 1 == steps.len() {
            let finished = driven.session.finish(&LevenbergMarquardt::default(), &mut Silent).unwrap();
            let best = finished.outcome.final_cost;
            driven.gaps.push((driven.session.cost() - best) / best);
        }
    }
    driven
}

impl SmootherRun {
    fn path(&self) -> Vec<Vector2<f64>> {
        let place = |i: usize| self.session.get::<Se2>(Key::indexed("x", i).as_str()).unwrap().translation;
        (0..self.newest.len()).map(place).collect()
    }

    /// Returns the root mean square and the largest error of the aligned path, and the aligning motion.
    fn path_errors(&self, truth: &[Vector2<f64>]) -> ((f64, f64), Se2) {
        let path = self.path();
        (aligned_errors(&path, truth), align(&path, truth))
    }

    fn latencies(&self) -> Latencies {
        Latencies::of(&self.times)
    }
}

/// Returns the root mean square and the largest error after alignment.
fn aligned_errors(path: &[Vector2<f64>], truth: &[Vector2<f64>]) -> (f64, f64) {
    let motion = align(path, truth);
    errors(&path.iter().map(|place| motion.act(place)).collect::<Vec<_>>(), truth)
}

/// Returns the motion from the first points to the second that minimizes the sum of squares.
fn align(from: &[Vector2<f64>], to: &[Vector2<f64>]) -> Se2 {
    let centre = |points: &[Vector2<f64>]| points.iter().sum::<Vector2<f64>>() / points.len() as f64;
    let (a, b) = (centre(from), centre(to));
    let (mut dot, mut cross) = (0.0, 0.0);
    for (p, q) in from.iter().zip(to) {
        let (p, q) = (p - a, q - b);
        (dot, cross) = (dot + p.dot(&q), cross + p.x * q.y - p.y * q.x);
    }
    let rotation = So2::exp(f64::atan2(cross, dot));
    let turned = rotation.act(&a);
    Se2::new(rotation, b - turned)
}

/// Returns the root mean square and the largest distance.
fn errors(found: &[Vector2<f64>], truth: &[Vector2<f64>]) -> (f64, f64) {
    let apart: Vec<f64> = found.iter().zip(truth).map(|(a, b)| (a - b).norm()).collect();
    let square = apart.iter().map(|x| x * x).sum::<f64>() / apart.len() as f64;
    (square.sqrt(), apart.iter().fold(0.0, |most, x| x.max(most)))
}
