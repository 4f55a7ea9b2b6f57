//! Odometry and positions arrive one at a time; a smoother keeps the estimate of the last 20 poses.
//! `cargo run --release --example smoother`
#![allow(clippy::print_stdout, reason = "an example prints")]
use manifactor::geometry::{Between, Coordinates, Position, Se2};
use manifactor::prelude::*;
use manifactor::smoother::{Smoother, SmootherSettings, Span, Window};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let window = Window::from(Span::Poses(20.try_into()?));
    let mut smoother =
        Smoother::new(SmootherSettings { window: Some(window), ..SmootherSettings::default() });
    let step = Se2::exp(&Vector3::new(1.0, 0.0, 0.1));
    let mut truth = Se2::identity();
    for i in 0..100 {
        let (mut factors, mut values) = (Graph::new(), Values::new());
        let key = Key::indexed("x", i);
        if i == 0 {
            values.insert("x0", truth);
            factors.fix("x0");
        } else {
            let last = Key::indexed("x", i - 1);
            // odometry that turns too far
            let relative = Se2::exp(&Vector3::new(1.0, 0.0, 0.11));
            values.insert(key.clone(), Se2::compose(&smoother.get(last.as_str())?, &relative));
            factors.add([last, key.clone()], Between { relative }).noise(Noise::sigmas(&[0.05, 0.05, 0.02])?);
            truth = Se2::compose(&truth, &step);
        }
        if i % 10 == 9 {
            let fix = Position::<2> {
                position: Coordinates::new(truth.translation)?,
                lever_arm: Coordinates::default(),
            };
            factors.add([key.clone()], fix).noise(Noise::sigma(0.1)?);
        }
        smoother.push(&factors, &values)?;
        smoother.update()?;
        if i % 10 == 9 {
            let pose: Se2 = smoother.get(key.as_str())?;
            let error = (pose.translation - truth.translation).norm();
            println!("{key}: {} poses in the window, {error:.3} m from the truth", smoother.variables());
        }
    }
    Ok(())
}
