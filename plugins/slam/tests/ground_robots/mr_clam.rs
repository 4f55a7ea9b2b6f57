//! UTIAS MR.CLAM: a robot measures range and bearing of barcodes and localizes itself among them. Vicon gives
//! the truth.
//!
//! Noise models describe the sensors and are not fitted to the truth. Odometry is the commanded speed, with a
//! random walk as its error. The variance therefore grows with distance, turn and time, at any frame rate. A
//! camera derives ranges from the size of a barcode, so their error grows with the range. Some barcodes are
//! misread, hence the robust loss.
use super::{LandmarkMeasurement, RobotStep, aligned_errors, data, drive, errors};
use manifactor_geometry::{BearingRange2, Point2, Se2, So2};
use manifactor_graph::checked::Positive;
use manifactor_graph::loss::Cauchy;
use manifactor_graph::{Key, Noise};
use nalgebra::{Vector2, Vector3};
use std::collections::HashMap;
use std::sync::Arc;

/// Subjects up to this number are robots.
const ROBOTS: usize = 5;

/// Reads a table of numbers of the data set; `None` if the file does not exist.
fn table(name: &str) -> Option<Vec<Vec<f64>>> {
    data(&format!("mrclam7_robot3/{name}.dat")).map(super::rows)
}

/// Speeds, each with the start of its interval. Unit: metres and radians per second.
struct Odometry {
    rows: Vec<Vec<f64>>,
    next: usize,
    time: f64,
}

impl Odometry {
    /// Returns the motion of the robot until `time`, and its standard deviations.
    fn until(&mut self, time: f64) -> (Se2, Noise) {
        let (mut relative, mut way, mut turn) = (Se2::identity(), 0.0, 0.0);
        let seconds = time - self.time;
        while self.time < time {
            while self.next < self.rows.len() && self.rows[self.next][0] <= self.time {
                self.next += 1;
            }
            let to = self.rows.get(self.next).map_or(time, |row| row[0].min(time));
            let [v, w] = self.next.checked_sub(1).map_or([0.0; 2], |i| [self.rows[i][1], self.rows[i][2]]);
            let step = to - self.time;
            relative = Se2::compose(&relative, &Se2::exp(&Vector3::new(v * step, 0.0, w * step)));
            (way, turn) = (way + (v * step).abs(), turn + (w * step).abs());
            self.time = to;
        }
        // 5 cm and 0.05 rad after a metre, 0.1 rad after a radian; 5 mm and 0.01 rad after a second, as from
        // wheel slip
        let place = (0.05_f64.powi(2) * way + 0.005_f64.powi(2) * seconds).sqrt();
        let angle = (0.05_f64.powi(2) * way + 0.1_f64.powi(2) * turn + 0.01_f64.powi(2) * seconds).sqrt();
        (relative, Noise::sigmas(&[place, place, angle]).unwrap())
    }
}

/// Returns the measurements of landmarks by time, without robots and unknown barcodes.
fn measurements(rows: &[Vec<f64>], barcodes: &[Vec<f64>]) -> Vec<(f64, Vec<LandmarkMeasurement>)> {
    let subjects: HashMap<usize, usize> =
        barcodes.iter().map(|row| (row[1] as usize, row[0] as usize)).collect();
    let mut all: Vec<(f64, Vec<LandmarkMeasurement>)> = vec![];
    for row in rows {
        let Some(id) = subjects.get(&(row[1] as usize)).copied().filter(|id| *id > ROBOTS) else {
            continue;
        };
        let (range, bearing) = (row[2], So2::exp(row[3]));
        // one degree, and a twentieth of the range
        let noise = Noise::sigmas(&[0.0175, (0.05 * range).max(0.05)]).unwrap();
        let place = bearing.act(&Vector2::new(range, 0.0));
        let factor = Arc::new(BearingRange2::new(bearing, Positive::new(range).unwrap()));
        let seen = LandmarkMeasurement { id, place, factor, noise, loss: Some(Arc::new(Cauchy::default())) };
        match all.last_mut().filter(|(time, _)| *time == row[0]) {
            Some((_, list)) => list.push(seen),
            None => all.push((row[0], vec![seen])),
        }
    }
    all
}

/// Returns the true position of the robot at a time.
fn truth_at(truth: &[Vec<f64>], time: f64) -> Vector2<f64> {
    let after = truth.partition_point(|row| row[0] < time).clamp(1, truth.len() - 1);
    let (a, b) = (&truth[after - 1], &truth[after]);
    let share = ((time - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0);
    Vector2::new(a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2]))
}

/// The stream from the first measurement on, and the Vicon positions of the robot and the landmarks.
struct Recording {
    steps: Vec<RobotStep>,
    truth: Vec<Vector2<f64>>,
    landmarks: Vec<Vec<f64>>,
}

fn recording() -> Option<Recording> {
    let measurements = measurements(&table("Robot3_Measurement")?, &table("Barcodes")?);
    let mut odometry = Odometry { rows: table("Robot3_Odometry")?, next: 0, time: measurements[0].0 };
    let truth = table("Robot3_Groundtruth")?;
    let truth = measurements.iter().map(|(time, _)| truth_at(&truth, *time)).collect();
    let steps = measurements
        .into_iter()
        .enumerate()
        .map(|(i, (time, seen))| RobotStep { odometry: (i > 0).then(|| odometry.until(time)), seen });
    Some(Recording { steps: steps.collect(), truth, landmarks: table("Landmark_Groundtruth")? })
}

#[test]
fn a_robot_finds_its_way_among_barcodes() {
    let Some(Recording { steps, truth, landmarks }) = recording() else { return };
    let driven = drive(&steps, None);
    let (ate, motion) = driven.path_errors(&truth);
    let of_newest = aligned_errors(&driven.newest, &truth);
    let of_odometry = aligned_errors(&driven.odometry, &truth);
    let (mapped, known): (Vec<_>, Vec<_>) = landmarks
        .iter()
        .map(|row| {
            let landmark: Point2 = driven.session.get(Key::indexed("l", row[0]).as_str()).unwrap();
            (motion.act(&landmark), Vector2::new(row[1], row[2]))
        })
        .unzip();
    let of_landmarks = errors(&mapped, &known);
    println!("{} poses, ATE {ate:?} m, newest {of_newest:?}, odometry alone {of_odometry:?}", truth.len());
    println!("{} landmarks, {of_landmarks:?} m, gaps {:?}", known.len(), driven.gaps);
    println!("{:?} ms", driven.latencies());
    assert!(ate.0 < 0.15 && of_newest.0 < 0.3 && ate.0 < 0.1 * of_odometry.0);
    assert!(known.len() == 15 && of_landmarks.1 < 0.4);
    // the remaining gap scales with `relinearization_threshold`: at a tenth of its default, the gap is a tenth
    assert!(driven.gaps.iter().all(|gap| *gap < 0.05) && driven.gaps.last().unwrap() < &0.02);
}
