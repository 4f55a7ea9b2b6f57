//! Memory and time of a robot that drives through streets for hours.
//!
//! `cargo run --release -p manifactor-bench -- measure long [--poses N] [--step METRES] [--seconds S]
//! [--seed N]`. Streets cross every ten metres, twenty in each direction. At each crossing the robot turns
//! in a random direction. It makes ten poses per second, one for each step. At a crossing that it has
//! visited before, a factor closes the loop to the pose of its last visit. `--seconds` sets a window; loop
//! closures to marginalized poses are left out. Prints one row for each tenth of the way. Times are CPU
//! times of one thread in milliseconds.
use super::{Arguments, BenchmarkResult, cpu_seconds, resident};
use manifactor_formats::replay::Latencies;
use manifactor_geometry::{Between, Se2, So2};
use manifactor_graph::checked::Positive;
use manifactor_graph::{Graph, Key, Noise, Values};
use manifactor_smoother::{Smoother, SmootherSettings, Span};
use manifactor_solve::{LevenbergMarquardt, Silent};
use nalgebra::{Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;

/// Distance of two crossings in metres, and number of streets in each direction.
const BLOCK: f64 = 10.0;
const STREETS: i32 = 20;

/// Standard deviations in metres and radians: of a step of one metre (proportional to the square root of
/// its length), and of a loop closure.
const ODOMETRY: [f64; 3] = [0.05, 0.05, 0.01];
const CLOSURE: [f64; 3] = [0.1, 0.1, 0.02];

/// The true motion of the robot.
struct Robot {
    rng: Pcg64,
    steps_a_block: usize,
    /// Steps since the last crossing, that crossing, and the direction in quarters of a turn.
    since: usize,
    crossing: [i32; 2],
    quarters: i32,
}

impl Robot {
    fn new(seed: u64, step: f64) -> Self {
        let steps_a_block = (BLOCK / step).round().max(1.0) as usize;
        let crossing = [STREETS / 2; 2];
        Self { rng: Pcg64::seed_from_u64(seed), steps_a_block, since: 0, crossing, quarters: 0 }
    }

    fn ahead(&self, quarters: i32) -> [i32; 2] {
        let [x, y] = self.crossing;
        match quarters.rem_euclid(4) {
            0 => [x + 1, y],
            1 => [x, y + 1],
            2 => [x - 1, y],
            _ => [x, y - 1],
        }
    }

    fn pose(&self) -> Se2 {
        let [x, y] = self.crossing.map(|i| BLOCK * f64::from(i));
        let way = BLOCK * self.since as f64 / self.steps_a_block as f64;
        let rotation = So2::exp(FRAC_PI_2 * f64::from(self.quarters));
        Se2::new(rotation, Vector2::new(x, y) + rotation.act(&Vector2::new(way, 0.0)))
    }

    /// Moves by one step; returns the crossing if it reaches one.
    fn go(&mut self) -> Option<[i32; 2]> {
        self.since += 1;
        if self.since < self.steps_a_block {
            return None;
        }
        (self.since, self.crossing) = (0, self.ahead(self.quarters));
        let within = |[x, y]: [i32; 2]| (0..STREETS).contains(&x) && (0..STREETS).contains(&y);
        // left, straight on or right, within the town
        let ways: Vec<i32> = (-1..=1).filter(|turn| within(self.ahead(self.quarters + turn))).collect();
        self.quarters = (self.quarters + ways[self.rng.random_range(0..ways.len())]).rem_euclid(4);
        Some(self.crossing)
    }

    /// Measures a motion with an error of these standard deviations.
    fn measure(&mut self, motion: &Se2, sigmas: &[f64; 3]) -> Se2 {
        // the sum of twelve uniform numbers has the variance of a normal one
        let mut normal = || (0..12).map(|_| self.rng.random_range(-0.5..0.5)).sum::<f64>();
        let error = Vector3::from_fn(|i, _| sigmas[i] * normal());
        Se2::compose(motion, &Se2::exp(&error))
    }
}

pub(super) fn run(mut arguments: Arguments) -> BenchmarkResult {
    let (mut poses, mut step, mut seed, mut window) = (100_000_usize, 1.0_f64, 1, None);
    while let Some(argument) = arguments.next() {
        let value = arguments.next().ok_or(format!("{argument} takes a number"))?;
        match argument.as_str() {
            "--poses" => poses = value.parse()?,
            "--step" => step = value.parse()?,
            "--seed" => seed = value.parse()?,
            "--seconds" => window = Some(Span::Seconds(Positive::new(value.parse()?)?).into()),
            _ => return Err(format!("there is no option {argument}").into()),
        }
    }
    let is_windowed = window.is_some();
    let mut session = Smoother::new(SmootherSettings { window, ..SmootherSettings::default() });
    let mut robot = Robot::new(seed, step);
    let sigmas = ODOMETRY.map(|sigma| sigma * step.sqrt());
    let (odometry, closure) = (Noise::sigmas(&sigmas)?, Noise::sigmas(&CLOSURE)?);
    let mut visits: HashMap<[i32; 2], (Key, Se2)> = HashMap::new();
    let (mut times, mut closures, mut here) = (vec![], 0, robot.pose());
    println!(
        "| poses | hours | closures | p50 | p99 | max | total s | MB of fronts | MB of the process | kB saved |"
    );
    println!("| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    for i in 0..poses {
        let (mut factors, mut values) = (Graph::new(), Values::new());
        let key = Key::indexed("x", i);
        if i == 0 {
            values.insert(key.clone(), here);
            factors.fix(key);
        } else {
            let (before, crossing) = (here, robot.go());
            here = robot.pose();
            let relative = robot.measure(&before.between(&here), &sigmas);
            let last = Key::indexed("x", i - 1);
            values.insert(key.clone(), Se2::compose(&session.get(last.as_str())?, &relative));
            factors.add([last, key.clone()], Between { relative }).noise(odometry.clone());
            if let Some(crossing) = crossing {
                let visit = visits.insert(crossing, (key.clone(), here));
                if let Some((then, place)) =
                    visit.filter(|(then, _)| session.estimate(then.as_str()).is_some())
                {
                    let relative = robot.measure(&place.between(&here), &CLOSURE);
                    factors.add([then, key], Between { relative }).noise(closure.clone());
                    closures += 1;
                }
            }
        }
        let begin = cpu_seconds();
        session.set_time(0.1 * i as f64)?;
        session.push(&factors, &values)?;
        session.update()?;
        times.push(1e3 * (cpu_seconds() - begin));
        if (i + 1) % (poses / 10).max(1) == 0 {
            let Latencies { p50, p99, max, total } = Latencies::of(&times);
            times.clear();
            let (resident, fronts) = (resident(), session.bytes() as f64 / 1e6);
            // a text of all poses would be the largest object in memory
            let saved = if is_windowed {
                format!("{:.1}", session.save()?.len() as f64 / 1e3)
            } else {
                String::new()
            };
            println!(
                "| {} | {:.1} | {closures} | {p50:.3} | {p99:.2} | {max:.1} | {:.1} | {fronts:.2} | {resident:.1} | {saved} |",
                i + 1,
                (i + 1) as f64 / 36e3,
                total / 1e3
            );
        }
    }
    let cost = session.cost();
    let best = session.finish(&LevenbergMarquardt::default(), &mut Silent)?.outcome.final_cost;
    println!("cost {cost:.3}, as one batch {best:.3}: {:.1e} above", (cost - best) / best);
    if !is_windowed {
        // memory that is due to the history, compared with the same graph ordered at once
        let mut fresh = Smoother::new(SmootherSettings::default());
        fresh.push(&session.graph().0, &session.estimates())?;
        let begin = cpu_seconds();
        fresh.update()?;
        let (fronts, seconds) = (fresh.bytes() as f64 / 1e6, cpu_seconds() - begin);
        println!("fronts of a session that takes all in at once: {fronts:.2} MB, in {seconds:.1} s");
    }
    Ok(())
}
