//! UTIAS MR.CLAM: a robot sees barcodes, by range and bearing, and finds its way among them, as Vicon saw it do.
//!
//! Noises are what the sensors are, not what fits the truth. Odometry is the commanded speed: its error is a random walk, so that
//! its variance grows with the way, the turn and the time, however often the robot looks. A camera tells ranges by a barcode's
//! size, so their error grows with the range. Some barcodes are read as others: hence a robust loss.
use crate::online::{data, rows};
use manifactor_formats::replay::Latencies;
use manifactor_geometry::{BearingRange2, Between, Point2, Se2, So2};
use manifactor_graph::checked::Positive;
use manifactor_graph::loss::Cauchy;
use manifactor_graph::{Graph, Key, Noise, Values};
use manifactor_online::{Session, Settings};
use manifactor_solve::{LevenbergMarquardt, Silent};
use nalgebra::{Vector2, Vector3};
use std::collections::HashMap;

/// A table of numbers of the data set; `None` where it is not there.
fn table(name: &str) -> Option<Vec<Vec<f64>>> {
    data(&format!("online/mrclam7_robot3/{name}.dat")).map(rows)
}

/// Speeds, by the time from which they hold: metres and radians per second.
struct Odometry {
    rows: Vec<Vec<f64>>,
    next: usize,
    time: f64,
}

impl Odometry {
    /// How the robot moves until `time`, and the standard deviations of that.
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
        // 5 cm and 0.05 rad after a metre, 0.1 rad after a radian; 5 mm and 0.01 rad after a second, as where a wheel slips
        let place = (0.05_f64.powi(2) * way + 0.005_f64.powi(2) * seconds).sqrt();
        let angle = (0.05_f64.powi(2) * way + 0.1_f64.powi(2) * turn + 0.01_f64.powi(2) * seconds).sqrt();
        (relative, Noise::sigmas(&[place, place, angle]).unwrap())
    }
}

/// What is seen of a landmark, in metres and radians.
struct Sighting {
    subject: usize,
    range: f64,
    bearing: f64,
}

/// What is seen of landmarks, by time. Robots (subjects 1 to 5) and barcodes that none has are left out.
fn sightings(measurements: &[Vec<f64>], barcodes: &[Vec<f64>]) -> Vec<(f64, Vec<Sighting>)> {
    let subjects = barcodes.iter().map(|row| (row[1] as usize, row[0] as usize));
    let subjects: HashMap<usize, usize> = subjects.filter(|(_, subject)| *subject > 5).collect();
    let mut all: Vec<(f64, Vec<Sighting>)> = vec![];
    for row in measurements {
        let Some(subject) = subjects.get(&(row[1] as usize)).copied() else { continue };
        let seen = Sighting { subject, range: row[2], bearing: row[3] };
        match all.last_mut().filter(|(time, _)| *time == row[0]) {
            Some((_, list)) => list.push(seen),
            None => all.push((row[0], vec![seen])),
        }
    }
    all
}

/// The motion that takes the first points to the second with the least sum of squares.
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

/// The root of the mean square, and the largest.
fn errors(found: &[Vector2<f64>], truth: &[Vector2<f64>]) -> (f64, f64) {
    let apart: Vec<f64> = found.iter().zip(truth).map(|(a, b)| (a - b).norm()).collect();
    let square = apart.iter().map(|x| x * x).sum::<f64>() / apart.len() as f64;
    (square.sqrt(), apart.iter().fold(0.0, |most, x| x.max(most)))
}

/// Where the truth has the robot at a time.
fn truth_at(truth: &[Vec<f64>], time: f64) -> Vector2<f64> {
    let after = truth.partition_point(|row| row[0] < time).clamp(1, truth.len() - 1);
    let (a, b) = (&truth[after - 1], &truth[after]);
    let share = ((time - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0);
    Vector2::new(a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2]))
}

/// What a session came to, pose by pose.
struct Driven {
    session: Session,
    /// Where the newest pose was after its update, and where odometry alone leads.
    newest: Vec<Vector2<f64>>,
    odometry: Vec<Se2>,
    /// CPU time of the updates, in milliseconds.
    times: Vec<f64>,
    /// By what share the estimate costs more than a batch solve from it, now and then.
    gaps: Vec<f64>,
}

fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

fn drive(sightings: &[(f64, Vec<Sighting>)], mut odometry: Odometry) -> Driven {
    let session = Session::new(Settings::default()).unwrap();
    let mut driven = Driven { session, newest: vec![], odometry: vec![], times: vec![], gaps: vec![] };
    let Driven { session, newest, odometry: path, times, gaps } = &mut driven;
    let (mut pose, mut alone) = (Se2::identity(), Se2::identity());
    for (i, (time, seen)) in sightings.iter().enumerate() {
        let (mut graph, mut values, here) = (Graph::new(), Values::new(), Key::indexed("x", i));
        if i == 0 {
            graph.fix(here.clone());
        } else {
            let (relative, noise) = odometry.until(*time);
            graph.add([Key::indexed("x", i - 1), here.clone()], Between { relative }).noise(noise);
            pose = Se2::compose(&pose, &relative);
            alone = Se2::compose(&alone, &relative);
        }
        values.insert(here.clone(), pose);
        for Sighting { subject, range, bearing } in seen {
            let landmark = Key::indexed("l", *subject);
            if session.estimate(landmark.as_str()).is_none() && !values.contains(landmark.as_str()) {
                let place = pose.act(&So2::exp(*bearing).act(&Vector2::new(*range, 0.0)));
                values.insert(landmark.clone(), Point2::new(place));
            }
            let measured = BearingRange2::new(So2::exp(*bearing), Positive::new(*range).unwrap());
            // a degree, and a twentieth of the range
            let noise = Noise::sigmas(&[0.0175, (0.05 * range).max(0.05)]).unwrap();
            graph.add([here.clone(), landmark], measured).noise(noise).loss(Cauchy::default());
        }
        let begin = cpu_seconds();
        session.push(&graph, &values).unwrap();
        let report = session.update().unwrap();
        times.push(1e3 * (cpu_seconds() - begin));
        assert!(report.parked.is_empty() && report.undetermined.is_empty(), "{report:?}");
        pose = session.get(here.as_str()).unwrap();
        newest.push(pose.translation);
        path.push(alone);
        if i % 500 == 499 || i + 1 == sightings.len() {
            let finished = session.finish(&LevenbergMarquardt::default(), &mut Silent).unwrap();
            let best = finished.outcome.final_cost;
            gaps.push((session.cost() - best) / best);
        }
    }
    driven
}

#[test]
fn a_robot_finds_its_way_among_barcodes() {
    let (Some(odometry), Some(measurements), Some(barcodes), Some(truth), Some(landmarks)) = (
        table("Robot3_Odometry"),
        table("Robot3_Measurement"),
        table("Barcodes"),
        table("Robot3_Groundtruth"),
        table("Landmark_Groundtruth"),
    ) else {
        return;
    };
    let sightings = sightings(&measurements, &barcodes);
    let odometry = Odometry { rows: odometry, next: 0, time: sightings[0].0 };
    let Driven { session, newest, odometry, times, gaps } = drive(&sightings, odometry);
    let truth: Vec<_> = sightings.iter().map(|(time, _)| truth_at(&truth, *time)).collect();
    // in the frame of the truth: the errors, and the motion that leads there
    let aligned = |path: &[Vector2<f64>]| {
        let motion = align(path, &truth);
        let moved: Vec<_> = path.iter().map(|place| motion.act(place)).collect();
        (errors(&moved, &truth), motion)
    };
    let place = |i: usize| session.get::<Se2>(Key::indexed("x", i).as_str()).unwrap().translation;
    let (ate, motion) = aligned(&(0..truth.len()).map(place).collect::<Vec<_>>());
    let (of_newest, _) = aligned(&newest);
    let (of_odometry, _) = aligned(&odometry.iter().map(|pose| pose.translation).collect::<Vec<_>>());
    let (mapped, known): (Vec<_>, Vec<_>) = landmarks
        .iter()
        .map(|row| {
            let landmark: Point2 = session.get(Key::indexed("l", row[0]).as_str()).unwrap();
            (motion.act(&landmark), Vector2::new(row[1], row[2]))
        })
        .unzip();
    let of_landmarks = errors(&mapped, &known);
    println!("{} poses, ATE {ate:?} m, newest {of_newest:?}, odometry alone {of_odometry:?}", truth.len());
    println!("{} landmarks, {of_landmarks:?} m, gaps {gaps:?}", known.len());
    println!("{:?} ms", Latencies::of(&times));
    assert!(ate.0 < 0.15 && of_newest.0 < 0.3 && ate.0 < 0.1 * of_odometry.0);
    assert!(known.len() == 15 && of_landmarks.1 < 0.4);
    // what is left goes with `Settings.bend`: at a tenth of its default, the gap is a tenth
    assert!(gaps.iter().all(|gap| *gap < 0.05) && gaps.last().unwrap() < &0.02);
}
