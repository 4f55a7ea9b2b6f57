//! Readings that a working sensor does not give: equal ones in motion, and values that stop at a limit.
use crate::samples::ImuReading;
use nalgebra::Vector3;
use serde::Serialize;
use std::fmt;

/// Minimum number of equal readings in a row. Drivers with a higher rate than their sensor repeat a few.
const MIN_EQUAL: usize = 10;
/// Rates below this, in rad/s, and forces within this of gravity, as a share, are those of rest, which a simulation
/// without noise repeats.
const REST_RATE: f64 = 0.02;
const REST_SHARE: f64 = 0.02;
/// Minimum number of values in a row at a limit.
const MIN_AT_LIMIT: usize = 5;
/// A limit is at least this many steps of the sensor's resolution from zero. A sensor at rest has few different values.
const MIN_STEPS: f64 = 50.0;
/// Damaged readings of one kind.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Damage {
    /// Kind of damage.
    #[serde(flatten)]
    pub kind: DamageKind,
    /// Their number.
    pub readings: usize,
    /// Time of the first one, in seconds.
    pub from: f64,
}

/// Kind of damage.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "damage", rename_all = "snake_case")]
pub enum DamageKind {
    /// All six numbers are equal to those of the reading before, in motion.
    Repeated,
    /// An axis stays at its largest or smallest value while the other axes vary.
    Saturated {
        /// The sensor and the axis, such as `gyroscope x`.
        axis: &'static str,
        /// The value, in rad/s or m/s².
        limit: f64,
    },
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, readings, from } = self;
        match kind {
            DamageKind::Repeated => write!(
                f,
                "{readings} readings of the IMU repeat the one before, first at {from:.3} s: it did not measure there"
            ),
            DamageKind::Saturated { axis, limit } => write!(
                f,
                "{readings} readings of the {axis} are at the limit {limit}, first at {from:.3} s: the motion exceeds the \
                 range of the sensor"
            ),
        }
    }
}

/// Finds damaged readings. `gravity` is its length, in m/s².
pub fn find_damage(readings: &[ImuReading], gravity: f64) -> Vec<Damage> {
    const AXES: [[&str; 3]; 2] = [
        ["gyroscope x", "gyroscope y", "gyroscope z"],
        ["accelerometer x", "accelerometer y", "accelerometer z"],
    ];
    let mut found: Vec<Damage> = repeated(readings, gravity).into_iter().collect();
    let sensors: [fn(&ImuReading) -> Vector3<f64>; 2] = [|r| r.gyroscope, |r| r.accelerometer];
    // a gyroscope at rest has no value that it keeps
    let at_rest = [f64::INFINITY, gravity];
    for ((sensor, at_rest), names) in sensors.into_iter().zip(at_rest).zip(AXES) {
        for (axis, name) in names.into_iter().enumerate() {
            found.extend(saturated(readings, &sensor, axis, name, at_rest));
        }
    }
    found
}

/// Returns the lengths of the runs of readings for which `continues` holds between neighbours, with their starts.
fn runs(count: usize, continues: impl Fn(usize, usize) -> bool) -> Vec<(usize, usize)> {
    let mut runs = vec![];
    let mut start = 0;
    for i in 1..=count {
        if i == count || !continues(i - 1, i) {
            runs.push((start, i - start));
            start = i;
        }
    }
    runs
}

fn repeated(readings: &[ImuReading], gravity: f64) -> Option<Damage> {
    let moves = |reading: &ImuReading| {
        let force = reading.accelerometer.norm() / gravity;
        reading.gyroscope.norm() > REST_RATE || (force - 1.0).abs() > REST_SHARE
    };
    let is_equal = |i: usize, j: usize| {
        let (a, b) = (&readings[i], &readings[j]);
        a.gyroscope == b.gyroscope && a.accelerometer == b.accelerometer && moves(a)
    };
    let runs = runs(readings.len(), is_equal);
    let long: Vec<_> = runs.into_iter().filter(|(_, length)| *length >= MIN_EQUAL).collect();
    let (first, _) = long.first()?;
    let readings_of_all = long.iter().map(|(_, length)| length - 1).sum();
    Some(Damage {
        kind: DamageKind::Repeated,
        readings: readings_of_all,
        from: readings[first + 1].timestamp,
    })
}

fn saturated(
    readings: &[ImuReading],
    sensor: &impl Fn(&ImuReading) -> Vector3<f64>,
    axis: usize,
    name: &'static str,
    at_rest: f64,
) -> Vec<Damage> {
    let values: Vec<Vector3<f64>> = readings.iter().map(sensor).collect();
    let own = || values.iter().map(|value| value[axis]);
    let steps = values.windows(2).map(|two| (two[1][axis] - two[0][axis]).abs()).filter(|step| *step > 0.0);
    let resolution = steps.fold(f64::INFINITY, f64::min);
    let extremes = [own().fold(f64::INFINITY, f64::min), own().fold(f64::NEG_INFINITY, f64::max)];
    let stays = |limit: f64| {
        let continues = |i: usize, j: usize| {
            let others_vary = (0..3).filter(|other| *other != axis).all(|o| values[i][o] != values[j][o]);
            values[i][axis] == limit && values[j][axis] == limit && others_vary
        };
        let runs = runs(values.len(), continues);
        let long: Vec<_> = runs.into_iter().filter(|(_, length)| *length >= MIN_AT_LIMIT).collect();
        let (first, _) = long.first()?;
        let kind = DamageKind::Saturated { axis: name, limit };
        let count = long.iter().map(|(_, length)| length).sum();
        Some(Damage { kind, readings: count, from: readings[*first].timestamp })
    };
    // without noise, an accelerometer that stays level measures gravity, or nothing, along an axis
    let is_rest =
        |limit: f64| limit.abs() < MIN_STEPS * resolution || (limit.abs() / at_rest - 1.0).abs() < REST_SHARE;
    let is_far = |limit: &f64| limit.is_finite() && !is_rest(*limit);
    extremes.into_iter().filter(is_far).filter_map(stays).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::SimulatedFlight;

    fn said(change: impl FnOnce(&mut [ImuReading])) -> Vec<String> {
        let mut readings = SimulatedFlight::new(8.0, 2).readings;
        change(&mut readings);
        find_damage(&readings, 9.81).iter().map(Damage::to_string).collect()
    }

    #[test]
    fn a_working_sensor_has_no_damage() {
        assert_eq!(said(|_| {}), Vec::<String>::new());
        // with the resolution of a cheap sensor, and each reading twice
        let coarse = |x: f64| (x * 100.0).round() / 100.0;
        assert_eq!(
            said(|readings| {
                for i in 0..readings.len() {
                    let from = readings[i - i % 2];
                    readings[i].gyroscope = from.gyroscope.map(coarse);
                    readings[i].accelerometer = from.accelerometer.map(coarse);
                }
            }),
            Vec::<String>::new()
        );
        // at rest without noise
        let rest = ImuReading {
            timestamp: 0.0,
            gyroscope: Vector3::zeros(),
            accelerometer: Vector3::new(0.0, 0.0, 9.81),
        };
        assert_eq!(find_damage(&[rest; 100], 9.81), []);
        let moon = ImuReading { accelerometer: Vector3::new(0.0, 0.0, 1.62), ..rest };
        assert_eq!(find_damage(&[moon; 100], 1.62), []);
    }

    #[test]
    fn readings_that_repeat_or_stop_at_a_limit_are_named() {
        let clip = |x: f64, most: f64| x.clamp(-most, most);
        let stuck = said(|readings| {
            let from = readings[600];
            for reading in &mut readings[600..] {
                *reading = ImuReading { timestamp: reading.timestamp, ..from };
            }
        });
        assert!(stuck.len() == 1 && stuck[0].contains("repeat the one before, first at 3.0"), "{stuck:?}");
        let zeros = said(|readings| {
            for reading in &mut readings[500..600] {
                reading.gyroscope = Vector3::zeros();
                reading.accelerometer = Vector3::zeros();
            }
        });
        assert!(zeros[0].starts_with("99 readings of the IMU repeat"), "{zeros:?}");
        let rates = said(|readings| {
            let most = readings.iter().map(|reading| reading.gyroscope.amax()).fold(0.0, f64::max);
            readings
                .iter_mut()
                .for_each(|reading| reading.gyroscope = reading.gyroscope.map(|x| clip(x, 0.6 * most)));
        });
        assert!(!rates.is_empty() && rates.iter().all(|text| text.contains("of the gyroscope")), "{rates:?}");
        let forces = said(|readings| {
            readings.iter_mut().for_each(|reading| {
                reading.accelerometer = reading.accelerometer.map(|x| clip(x, 9.5));
            });
        });
        assert!(forces[0].contains("accelerometer z are at the limit 9.5"), "{forces:?}");
    }
}
