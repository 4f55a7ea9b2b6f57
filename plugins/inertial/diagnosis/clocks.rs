//! Faults that show before any likelihood: units of time, clocks without a common time, units of points.
use super::{Fault, Recording, Sensor};

/// Plausible times between two readings of an IMU, and between two images, in seconds.
const READINGS: [f64; 2] = [1e-4, 0.2];
const IMAGES: [f64; 2] = [1e-3, 5.0];
/// Units of time, in seconds.
const UNITS: [f64; 4] = [1e-3, 1e-6, 1e-9, 1e3];
/// Points within so many pixels of the corner are on the plane at depth one.
const NORMALIZED: f64 = 4.0;

/// Returns a fault and its evidence.
pub(super) fn fault(recording: &Recording) -> Option<(Fault, String)> {
    let readings: Vec<f64> = recording.readings.iter().map(|reading| reading.timestamp).collect();
    let images: Vec<f64> = recording.images.iter().map(|(time, _)| *time).collect();
    for (sensor, times, plausible) in [(Sensor::Imu, &readings, READINGS), (Sensor::Camera, &images, IMAGES)]
    {
        let Some(interval) = median(times.windows(2).map(|two| two[1] - two[0])) else { continue };
        let fits = |factor: f64| (plausible[0]..=plausible[1]).contains(&(factor * interval));
        if !fits(1.0)
            && let Some(factor) = UNITS.into_iter().find(|factor| fits(*factor))
        {
            let evidence = format!("the median time between two timestamps is {interval} s");
            return Some((Fault::TimeUnit { sensor, factor }, evidence));
        }
    }
    let [first, last] = [*readings.first()?, *readings.last()?];
    let [begin, end] = [*images.first()?, *images.last()?];
    if begin > last || end < first {
        let evidence =
            format!("readings from {first:.3} to {last:.3} s, images from {begin:.3} to {end:.3} s");
        return Some((Fault::Clocks { seconds: first - begin }, evidence));
    }
    let points = recording.images.iter().flat_map(|(_, points)| points);
    let farthest = median(points.map(|(_, pixel)| pixel.amax()))?;
    if farthest < NORMALIZED && recording.camera.width > 100 {
        let evidence = format!("the median of the larger coordinate is {farthest:.3} px");
        return Some((Fault::NormalizedPixels, evidence));
    }
    None
}

/// Returns the median, the larger one of two; `None` if there are no numbers.
pub(super) fn median(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let mut numbers: Vec<f64> = numbers.collect();
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied()
}
