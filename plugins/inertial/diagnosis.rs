//! Diagnosis of a visual-inertial recording: which number of its calibration, or which unit, is probably wrong.
//!
//! Each [`Fault`] has a correction of the recording. The diagnosis compares the likelihood of the recording as it
//! is with that of each corrected recording, takes the fault with the largest gain, and repeats this until no
//! correction gains anything. Residuals are the distances of tracked points from their epipolar planes, given the rotation
//! that the gyroscope measured, and the deviations of the specific force from one constant gravity.
mod clocks;
mod faults;
mod gravity;
mod rotation;
#[cfg(test)]
mod tests;

pub use faults::{Axes, Fault, Sensor};

use crate::damage::{Damage, find_damage};
use crate::samples::ImuReading;
use crate::visual::TrackedPoint;
use gravity::GravityFit;
use manifactor_geometry::{Camera, Se3};
use nalgebra::{Vector2, Vector3};
use rotation::RotationFit;
use serde::Serialize;

/// An image: its time in seconds, and the pixels of numbered points.
pub type Image = (f64, Vec<TrackedPoint>);

/// Smallest gain of a fault, in units of the natural logarithm, and as a share of the cost.
const MIN_GAIN: f64 = 40.0;
const MIN_SHARE: f64 = 0.05;
/// Smallest gain by points that come before the camera, as a share of the cost of those behind it.
const MIN_BEHIND: f64 = 0.25;
/// Smallest gain of axes of the accelerometer by gravity alone: odds of 20 to 1 for the best of 23 possible axes, ln 20 + ln 23.
const MIN_AXES_GAIN: f64 = 6.13;
/// Minimum number of pairs of images.
const MIN_PAIRS: usize = 10;
/// Faults are first judged with every third pair of images, and the best ones again with all.
const STRIDE: usize = 3;
const BEST: usize = 6;
/// A simpler fault is preferred if it has this share of the largest gain.
const SIMPLER: f64 = 0.9;
/// A fault is an alternative if its gain is less than the largest one by at most this share, and this number.
const ALTERNATIVE: [f64; 2] = [0.05, 300.0];
/// Differences that are too small to be a fault: seconds, factor minus one, distortion, radians.
const MIN_OFFSET: f64 = 4e-3;
const MIN_FACTOR: f64 = 0.04;
const MIN_DISTORTION: f64 = 0.03;
const MIN_TURN: f64 = 0.03;
/// Plausible lengths of gravity, in m/s². That of the Moon is 1.6 m/s².
const GRAVITIES: [f64; 2] = [0.3, 30.0];
/// Largest median distance of points from their epipolar lines, in pixels, in a recording without a fault.
const MAX_RESIDUAL: f64 = 2.0;
/// Largest number of faults of one recording. Enough corrections would explain any points.
const MAX_FAULTS: usize = 2;

/// A visual-inertial recording with its calibration.
#[derive(Debug, Clone)]
pub struct Recording {
    readings: Vec<ImuReading>,
    images: Vec<Image>,
    camera: Camera,
    body_from_camera: Se3,
    gravity: f64,
    /// Radial distortion that is still in the pixels: 1 + k r².
    distortion: f64,
    /// Whether gravity was subtracted from the specific force.
    has_no_gravity: bool,
}

/// A fault that was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// The fault.
    #[serde(flatten)]
    pub fault: Fault,
    /// Increase of the logarithm of the likelihood by the correction. `None` if there is no likelihood without it.
    pub gain: Option<f64>,
    /// Faults that explain the recording about as well.
    pub alternatives: Vec<Fault>,
    /// The evidence: what was measured without and with the correction.
    pub evidence: String,
}

/// The result of a diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// Probable faults, the most probable first. Each is judged with the earlier ones corrected.
    pub findings: Vec<Finding>,
    /// Readings of the IMU that a working sensor does not give.
    pub damage: Vec<Damage>,
    /// Number of pairs of images that were compared.
    pub pairs: usize,
    /// Number of points in all pairs.
    pub points: usize,
    /// Median distance of points from their epipolar lines, in pixels, with all corrections.
    pub residual: f64,
    /// Length of gravity, in m/s², with all corrections.
    pub gravity: f64,
    /// Whether the recording agrees with its calibration, with all corrections. If not, it has a fault without a
    /// correction.
    pub is_explained: bool,
}

/// The reason why a recording cannot be diagnosed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DiagnosisError {
    /// There are too few points to compare with the gyroscope.
    #[error(
        "expected at least {MIN_PAIRS} pairs of images with {} points in both and readings of the IMU between them, got {found}: \
         give a longer part of the recording",
        rotation::MIN_POINTS
    )]
    FewPairs {
        /// Number of such pairs.
        found: usize,
    },
    /// A sensor always has the same reading.
    #[error("all readings of the {sensor} are equal: the {sensor} did not measure, or its columns are wrong")]
    Constant {
        /// Gyroscope or accelerometer.
        sensor: &'static str,
    },
    /// The likelihood cannot be computed.
    #[error(
        "the likelihood of the recording is not finite: check `camera`, `body_from_camera` and `settings.gravity` for \
         numbers that are far too large or too small"
    )]
    NotFinite,
}

/// The likelihood of a recording.
#[derive(Debug, Clone)]
struct Fit {
    rotation: RotationFit,
    gravity: GravityFit,
}

/// A fault with its gain, and the fit of the corrected recording.
#[derive(Debug, Clone)]
struct Judged {
    gain: f64,
    fault: Fault,
    fit: Fit,
}

impl Fit {
    /// Fits every `stride`-th pair of images.
    fn new(recording: &Recording, stride: usize) -> Self {
        let rotation = rotation::fit(recording, &rotation::pairs(recording, stride), false);
        let gravity = gravity::fit(recording, &rotation.bias);
        Self { rotation, gravity }
    }

    fn check(&self) -> Result<(), DiagnosisError> {
        let is_finite = self.rotation.cost.is_finite()
            && self.rotation.median.is_finite()
            && self.gravity.cost.is_finite();
        if is_finite { Ok(()) } else { Err(DiagnosisError::NotFinite) }
    }

    /// Returns the gain from this fit to that of a corrected recording.
    fn gain(&self, fault: &Fault, corrected: &Self) -> f64 {
        // corrections of times change which pairs have readings
        let points = self.rotation.points.min(corrected.rotation.points) as f64;
        let mean = |fit: &Self| fit.rotation.cost / fit.rotation.points.max(1) as f64;
        let of_rotation = points * (mean(self) - mean(corrected));
        // the density of readings in a different unit
        let density = match fault {
            Fault::AccelerometerUnit { factor } => 3.0 * self.gravity.windows as f64 * factor.ln(),
            _ => 0.0,
        };
        of_rotation + self.gravity.cost - corrected.gravity.cost + density
    }

    fn evidence(&self, fault: &Fault, corrected: &Self) -> String {
        match fault.keeps_rotation() {
            true => format!(
                "gravity of {:.2} m/s² without, {:.2} m/s² with the correction",
                self.gravity.mean.norm(),
                corrected.gravity.mean.norm()
            ),
            false => format!(
                "median distance of points from their epipolar lines {:.2} px without, {:.2} px with the correction",
                self.rotation.median, corrected.rotation.median
            ),
        }
    }
}

/// Returns whether no fault of this kind was found before.
fn is_new(fault: &Fault, found_before: &[Finding]) -> bool {
    let kind = std::mem::discriminant(fault);
    found_before.iter().all(|finding| std::mem::discriminant(&finding.fault) != kind)
}

/// Returns whether a gain is so close to the largest one that the data does not decide.
fn is_alternative(largest: f64, gain: f64) -> bool {
    let [share, number] = ALTERNATIVE;
    largest - gain <= f64::min(share * largest, number)
}

impl Recording {
    /// Returns a recording. Images and readings are in the order of their times.
    pub fn new(
        readings: Vec<ImuReading>,
        images: Vec<Image>,
        camera: Camera,
        body_from_camera: Se3,
        gravity: f64,
    ) -> Self {
        Self { readings, images, camera, body_from_camera, gravity, distortion: 0.0, has_no_gravity: false }
    }

    /// Returns the viewing direction of a pixel in the camera's frame, with z = 1.
    fn ray(&self, pixel: Vector2<f64>) -> Vector3<f64> {
        let distorted = self.camera.ray(pixel).xy();
        let mut point = distorted;
        for _ in 0..5 {
            point = distorted / (1.0 + self.distortion * point.norm_squared());
        }
        point.push(1.0)
    }

    fn corrected(&self, fault: &Fault) -> Self {
        let mut corrected = self.clone();
        fault.correct(&mut corrected);
        corrected
    }

    /// Finds probable faults. There is none if the recording agrees with its calibration.
    ///
    /// # Errors
    /// If too few images can be compared with the gyroscope, a sensor always has the same reading, or numbers overflow.
    pub fn diagnose(&self) -> Result<Diagnosis, DiagnosisError> {
        self.check_sensors()?;
        let mut recording = self.clone();
        let mut findings = vec![];
        while findings.len() < MAX_FAULTS
            && let Some((fault, evidence)) = clocks::fault(&recording)
        {
            fault.correct(&mut recording);
            findings.push(Finding { fault, gain: None, evidence, alternatives: vec![] });
        }
        let pairs = rotation::pairs(&recording, 1).len();
        if pairs < MIN_PAIRS && findings.is_empty() {
            return Err(DiagnosisError::FewPairs { found: pairs });
        }
        let mut fit = Fit::new(&recording, 1);
        while pairs >= MIN_PAIRS && findings.len() < MAX_FAULTS {
            fit.check()?;
            let found =
                recording.most_probable(&fit, &findings).or_else(|| recording.behind(&fit, &findings));
            let Some(finding) = found else { break };
            finding.fault.correct(&mut recording);
            findings.push(finding);
            fit = Fit::new(&recording, 1);
        }
        fit.check()?;
        let Fit { rotation: RotationFit { median: residual, points, .. }, gravity } = fit;
        let is_explained = pairs >= MIN_PAIRS && residual <= MAX_RESIDUAL;
        let damage = find_damage(&self.readings, self.gravity);
        Ok(Diagnosis {
            findings,
            damage,
            pairs,
            points,
            residual,
            gravity: gravity.mean.norm(),
            is_explained,
        })
    }

    fn check_sensors(&self) -> Result<(), DiagnosisError> {
        let is_constant = |of: fn(&ImuReading) -> Vector3<f64>| {
            self.readings.len() > 1 && self.readings.windows(2).all(|two| of(&two[0]) == of(&two[1]))
        };
        if is_constant(|reading| reading.gyroscope) {
            return Err(DiagnosisError::Constant { sensor: "gyroscope" });
        }
        if is_constant(|reading| reading.accelerometer) {
            return Err(DiagnosisError::Constant { sensor: "accelerometer" });
        }
        Ok(())
    }

    /// Judges a fault with every `stride`-th pair of images. `null` is the fit without the correction.
    fn judge(&self, null: &Fit, stride: usize, fault: Fault) -> Judged {
        let corrected = self.corrected(&fault);
        let fit = match fault.keeps_rotation() {
            true => Fit {
                rotation: null.rotation.clone(),
                gravity: gravity::fit(&corrected, &null.rotation.bias),
            },
            false => Fit::new(&corrected, stride),
        };
        Judged { gain: null.gain(&fault, &fit), fault, fit }
    }

    /// Returns the most probable fault.
    fn most_probable(&self, null: &Fit, found_before: &[Finding]) -> Option<Finding> {
        let screened = Fit::new(self, STRIDE);
        let screen = |fault: Fault| self.judge(&screened, STRIDE, fault);
        let full = |judged: Judged| self.judge(null, 1, judged.fault);
        let is_new = |fault: &Fault| is_new(fault, found_before);
        let mut without_number: Vec<Judged> =
            Fault::all(self).into_iter().filter(is_new).map(screen).collect();
        let length = null.gravity.mean.norm();
        if (GRAVITIES[0]..GRAVITIES[1]).contains(&length)
            && (length - self.gravity).abs() > MIN_FACTOR * self.gravity
        {
            without_number.push(screen(Fault::Gravity { length }));
        }
        without_number.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        without_number.truncate(BEST);
        let offsets: Vec<f64> = (-25..=25).map(|i| 0.02 * f64::from(i)).collect();
        let offset = self.search(&offsets, &screened, null, |seconds| {
            (seconds.abs() > MIN_OFFSET).then_some(Fault::TimeOffset { seconds })
        });
        let factors: Vec<f64> = (-8..=8).map(|i| 4_f64.powf(f64::from(i) / 8.0)).collect();
        let factor = self.search(&factors, &screened, null, |factor| {
            ((factor - 1.0).abs() > MIN_FACTOR).then_some(Fault::FocalLength { factor })
        });
        let coefficients: Vec<f64> = (-6..=6).map(|i| 0.08 * f64::from(i)).collect();
        let distortion = self.search(&coefficients, &screened, null, |k| {
            (k.abs() > MIN_DISTORTION).then_some(Fault::Distortion { k })
        });
        let turn = rotation::fit(self, &rotation::pairs(self, 1), true).turn.log();
        let turn = (turn.norm() > MIN_TURN).then(|| screen(Fault::Mounting { turn: turn.into() }));
        let least = MIN_GAIN.max(MIN_SHARE * (null.rotation.cost + null.gravity.cost));
        let probable = |judged: Vec<Judged>| -> Vec<Judged> {
            judged.into_iter().map(full).filter(|judged| judged.gain >= least).collect()
        };
        let with_number = [offset, factor, distortion, turn].into_iter().flatten();
        let with_number = probable(with_number.filter(|judged| is_new(&judged.fault)).collect());
        let mut without_number = probable(without_number);
        // a fault without a number is simpler
        let most = |judged: &[Judged]| judged.iter().fold(0.0, |most, judged| f64::max(most, judged.gain));
        if most(&without_number) < SIMPLER * most(&with_number) {
            without_number = with_number;
        }
        let most = most(&without_number);
        without_number.retain(|judged| is_alternative(most, judged.gain));
        // a mirrored image differs from a camera that is turned only by the points behind it
        if without_number.len() > 1 && !without_number.iter().any(|judged| judged.fault.keeps_rotation()) {
            for judged in &mut without_number {
                let corrected = self.corrected(&judged.fault);
                let pairs = rotation::pairs(&corrected, 1);
                judged.gain -= gravity::behind(&corrected, &pairs, &judged.fit.rotation).cost;
            }
        }
        without_number.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let found = without_number.first()?;
        if matches!(found.fault, Fault::AccelerometerAxes { .. })
            && let Some(finding) = self.behind(null, found_before)
        {
            return Some(finding);
        }
        let alternatives =
            without_number[1..].iter().filter(|other| is_alternative(most, most + other.gain - found.gain));
        Some(Finding {
            fault: found.fault.clone(),
            gain: Some(null.gain(&found.fault, &found.fit)),
            evidence: null.evidence(&found.fault, &found.fit),
            alternatives: alternatives.map(|other| other.fault.clone()).collect(),
        })
    }

    /// Returns the most probable fault of those that show as points behind the camera.
    fn behind(&self, null: &Fit, found_before: &[Finding]) -> Option<Finding> {
        let pairs = rotation::pairs(self, 1);
        let behind = gravity::behind(self, &pairs, &null.rotation);
        let moves = |fault: &Fault| {
            matches!(
                fault,
                Fault::AccelerometerSign | Fault::AccelerometerAxes { .. } | Fault::MountingInMillimetres
            )
        };
        let judge = |fault: Fault| self.judge(null, 1, fault);
        // the right axes fit a constant gravity better too; one of many others brings points before the camera by chance, if
        // the velocity is not known well
        let fits_gravity = |judged: &Judged| {
            !matches!(judged.fault, Fault::AccelerometerAxes { .. }) || judged.gain > MIN_AXES_GAIN
        };
        let with_points = |judged: Judged| {
            let corrected = gravity::behind(&self.corrected(&judged.fault), &pairs, &null.rotation);
            (judged.gain + behind.cost - corrected.cost, judged.fault, corrected.points)
        };
        let is_probable = |(gain, fault, _): &(f64, Fault, usize)| match fault {
            Fault::MountingInMillimetres => *gain >= MIN_GAIN,
            _ => *gain >= MIN_BEHIND * behind.cost,
        };
        let is_new = |fault: &Fault| is_new(fault, found_before);
        let judged =
            Fault::all(self).into_iter().filter(moves).filter(is_new).map(judge).filter(fits_gravity);
        let probable: Vec<(f64, Fault, usize)> = judged.map(with_points).filter(is_probable).collect();
        let most = probable.iter().fold(0.0, |most, (gain, ..)| f64::max(most, *gain));
        // the first ones are the simplest
        let best = probable.iter().position(|(gain, fault, _)| match fault {
            Fault::AccelerometerAxes { .. } => *gain >= most,
            _ => *gain >= SIMPLER * most,
        })?;
        let others =
            probable.iter().enumerate().filter(|(i, other)| *i != best && is_alternative(most, other.0));
        let alternatives = others.map(|(_, (_, fault, _))| fault.clone()).collect();
        let (gain, fault, points) = &probable[best];
        let evidence = format!(
            "{} of {} points are behind the camera without, {points} with the correction",
            behind.points, null.rotation.points
        );
        Some(Finding { fault: fault.clone(), gain: Some(*gain), evidence, alternatives })
    }

    /// Searches the number of a fault: among `values`, then between the neighbours of the best one, at last with all
    /// pairs of images.
    fn search(
        &self,
        values: &[f64],
        screened: &Fit,
        null: &Fit,
        fault: impl Fn(f64) -> Option<Fault>,
    ) -> Option<Judged> {
        let coarse = |value: f64| fault(value).map(|fault| self.judge(screened, STRIDE, fault));
        let fine = |value: f64| fault(value).map(|fault| self.judge(null, 1, fault));
        let judged: Vec<_> = values.iter().map(|value| coarse(*value)).collect();
        let best = (0..values.len()).max_by(|a, b| gain(&judged[*a]).total_cmp(&gain(&judged[*b])))?;
        let neighbour = if best == 0 { 1 } else { best - 1 };
        let step = 0.5 * (values.get(neighbour)? - values[best]).abs();
        let (at, found) = refine(coarse, values[best], step, 3);
        if gain(&found) < MIN_GAIN / (2 * STRIDE) as f64 {
            return None;
        }
        refine(fine, at, step / 4.0, 6).1
    }
}

fn gain(judged: &Option<Judged>) -> f64 {
    judged.as_ref().map_or(0.0, |judged| judged.gain)
}

/// Halves a step, and takes it while the gain grows. Returns the best value.
fn refine(
    judge: impl Fn(f64) -> Option<Judged>,
    mut at: f64,
    mut step: f64,
    halvings: usize,
) -> (f64, Option<Judged>) {
    let mut found = judge(at);
    for _ in 0..halvings {
        for next in [at - step, at + step] {
            let candidate = judge(next);
            if gain(&candidate) > gain(&found) {
                (at, found) = (next, candidate);
                break;
            }
        }
        step *= 0.5;
    }
    (at, found)
}
