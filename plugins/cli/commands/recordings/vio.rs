//! `manifactor vio`: estimates the motion of a camera with an IMU.
use crate::failure::Failure;
use crate::input::document;
use crate::input::kind;
use crate::interrupt;
use crate::output;
use crate::output::text::count;
use crate::output::watch::Watch;
use crate::status::Status;
use clap::Args;
use manifactor::config::{Document, Errors, Format};
use manifactor::formats::inertial::{Tracks, read_imu, read_states, read_tracks};
use manifactor::formats::read_text;
use manifactor::formats::tum::{self, StampedPose};
use manifactor::geometry::{Camera, CameraModel};
use manifactor::graph::checked::Positive;
use manifactor::inertial::diagnosis::Image;
use manifactor::inertial::visual::{
    InertialState, VisualInertial, VisualInertialDocument, VisualInertialEstimate,
};
use manifactor::inertial::{ImuDensities, ImuReading, find_damage};
use manifactor::slam::metrics::{Alignment, MetricsError, absolute_error, align, associate};
use manifactor::slam::output::{OutputFolder, write_whole};
use manifactor::solve::{AllObservers, Interrupt, Observer};
use serde::Deserialize;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Estimate the motion of a camera with an IMU, from its readings and from tracked points.
///
/// The smoother adds every n-th image as a keyframe; at the end, all keyframes are solved as one batch. The
/// folder has trajectory.txt (the batch), trajectory_online.txt (each keyframe as of its own update), both in
/// the TUM format, and states.csv with velocities and biases.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor vio examples/flight/vio.toml --out out/flight")]
pub(crate) struct Vio {
    /// The document: files, camera and settings.
    config: PathBuf,
    /// Set a value of the document, such as `settings.every=5`.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The folder for the results. Default: the one in the document.
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into a folder that holds other files, and overwrite files with the same names.
    #[arg(long)]
    force: bool,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Vio {
    pub(crate) fn run(&self, verbose: u8) -> Result<Status, Failure> {
        let document = read(&self.config, &self.set)?;
        let folder = self.config.parent().unwrap_or(Path::new("."));
        let readings = read_imu(folder.join(&document.imu))?;
        let tracks = read_tracks(folder.join(&document.tracks))?;
        let truth = document.ground_truth.as_ref().map(|path| read_truth(&folder.join(path))).transpose()?;
        let out = self.out.as_ref().unwrap_or(&document.output);
        let _claimed = OutputFolder::claim(out, "vio", &self.config, self.force)?;
        let every = document.settings.every.get();
        let keyframes: Vec<Image> = images(&tracks, &document.camera).into_iter().step_by(every).collect();
        let mut interrupt = interrupt::on_ctrl_c();
        let clock = Instant::now();
        let estimation = estimate(&document, &keyframes, &readings, verbose, &mut interrupt)?;
        let seconds = clock.elapsed().as_secs_f64();
        let mut watch = Watch::new(verbose, "solving");
        let mut observer = AllObservers(vec![&mut watch, &mut interrupt]);
        let estimate = estimation.finish(&mut observer).map_err(Failure::input)?;
        drop(watch);
        let online = estimation.causal_states();
        write_whole(&out.join("trajectory.txt"), tum::format(&trajectory(&estimate.states)))?;
        write_whole(&out.join("trajectory_online.txt"), tum::format(&trajectory(online)))?;
        write_whole(&out.join("states.csv"), states(&estimate.states))?;
        let errors = truth
            .map(|truth| Ok::<_, MetricsError>([error(&truth, online)?, error(&truth, &estimate.states)?]));
        let errors = errors.transpose().map_err(Failure::input)?;
        let warnings = warnings(&readings, document.settings.gravity.get(), &estimate);
        self.print(&estimate, seconds, errors, &warnings, out);
        let found = if warnings.is_empty() { Status::Done } else { Status::FaultsFound };
        Ok(found.max(Status::from(&estimate.outcome.termination)))
    }

    fn print(
        &self,
        estimate: &VisualInertialEstimate,
        seconds: f64,
        errors: Option<[(f64, usize); 2]>,
        warnings: &[String],
        out: &Path,
    ) {
        let VisualInertialEstimate { states, outcome, landmarks, short_tracks } = estimate;
        let milliseconds = 1e3 * seconds / states.len().max(1) as f64;
        if self.json {
            output::print_json(&json!({
                "keyframes": states.len(),
                "landmarks": landmarks,
                "short_tracks": short_tracks,
                "milliseconds_per_keyframe": milliseconds,
                "termination": outcome.termination,
                "final_cost": outcome.final_cost,
                "online_ate": errors.map(|[(online, _), _]| online),
                "ate": errors.map(|[_, (ate, _)]| ate),
                "keyframes_with_truth": errors.map(|[_, (_, pairs)]| pairs),
                "warnings": warnings,
            }));
            return;
        }
        let mut text = format!(
            "{}, {}, {} without a landmark\n{milliseconds:.1} ms per keyframe\nbatch: {}\n",
            count(states.len(), "keyframe"),
            count(*landmarks, "landmark"),
            count(*short_tracks, "track"),
            outcome.termination
        );
        if let Some([(online, _), (whole, pairs)]) = errors {
            text += &format!("ATE {:.2} cm online, {:.2} cm for the batch", 100.0 * online, 100.0 * whole);
            text += &match pairs == states.len() {
                true => "\n".to_owned(),
                false => format!(", of the {pairs} of {} keyframes with a true pose\n", states.len()),
            };
        }
        warnings.iter().for_each(|warning| text += &format!("warning: {warning}\n"));
        output::print(&(text + &format!("Written to {}\n", out.display())));
    }
}

/// Returns reasons to doubt an estimate that converged.
fn warnings(readings: &[ImuReading], gravity: f64, estimate: &VisualInertialEstimate) -> Vec<String> {
    /// Largest share of tracks that become no landmark. Points at the border and on wrong tracks are a minority.
    const MAX_SHORT: f64 = 0.5;
    let mut warnings: Vec<String> = find_damage(readings, gravity).iter().map(ToString::to_string).collect();
    let VisualInertialEstimate { landmarks, short_tracks, .. } = estimate;
    let tracks = landmarks + short_tracks;
    if *short_tracks as f64 > MAX_SHORT * tracks as f64 {
        warnings.push(format!(
            "{short_tracks} of {tracks} tracks give no landmark, so that the IMU alone determines much of the motion: check that a \
             track keeps its number from image to image, and `body_from_camera` with `manifactor doctor`"
        ));
    }
    warnings
}

/// Reads a document, with values that replace its own.
pub(super) fn read(path: &Path, set: &[String]) -> Result<VisualInertialDocument, Failure> {
    let mut document = document::open(path, kind::VIO)?;
    document.set(set)?;
    let errors = Errors::new();
    let read = document.section(&errors).and_then(|section| section.rest());
    let mut document: VisualInertialDocument = errors.finish(read)?;
    if let Some(file) = &document.imu_noise {
        if document.settings.noise != ImuDensities::default() {
            return Err(Failure::with_help(
                "`imu_noise` and `settings.noise` both give the noise of the IMU",
                "leave one of them out",
            ));
        }
        document.settings.noise = read_noise(&path.parent().unwrap_or(Path::new(".")).join(file))?;
    }
    Ok(document)
}

/// The noise of an IMU as Kalibr names it. Other fields of its file are not used.
#[derive(Deserialize)]
struct KalibrImu {
    gyroscope_noise_density: Positive,
    gyroscope_random_walk: Positive,
    accelerometer_noise_density: Positive,
    accelerometer_random_walk: Positive,
}

/// Reads the noise densities of a file of Kalibr, of its first IMU.
fn read_noise(file: &Path) -> Result<ImuDensities, Failure> {
    let document = Document::parse(file.display().to_string(), read_text(file)?, Format::Yaml)?;
    let (root, errors) = (document.root(), Errors::new());
    let read = root.field("imu0").unwrap_or(root).read::<KalibrImu>(&errors);
    let imu = errors.finish(read)?;
    Ok(ImuDensities {
        gyroscope: imu.gyroscope_noise_density,
        gyroscope_walk: imu.gyroscope_random_walk,
        accelerometer: imu.accelerometer_noise_density,
        accelerometer_walk: imu.accelerometer_random_walk,
    })
}

/// Reads true poses, from CSV as in EuRoC or in the TUM format.
fn read_truth(path: &Path) -> Result<Vec<StampedPose>, Failure> {
    let is_csv = path.extension().is_some_and(|extension| extension == "csv");
    if is_csv {
        return Ok(read_states(path)?);
    }
    let truth = tum::read(path)?;
    for note in truth.notes() {
        output::print_note(&format!("{}: {note}", path.display()));
    }
    Ok(truth.poses)
}

/// Returns all images, with pixels.
pub(super) fn images(tracks: &Tracks, camera: &Camera) -> Vec<Image> {
    let mut images: Vec<Image> = vec![];
    for row in &tracks.rows {
        let pixel = match tracks.is_normalized {
            true => camera.project(&row.point.push(1.0)),
            false => row.point,
        };
        match images.last_mut().filter(|(timestamp, _)| *timestamp == row.timestamp) {
            Some((_, points)) => points.push((row.landmark, pixel)),
            None => images.push((row.timestamp, vec![(row.landmark, pixel)])),
        }
    }
    images
}

/// Adds keyframes to the smoother, all or until an interrupt.
fn estimate(
    document: &VisualInertialDocument,
    keyframes: &[Image],
    readings: &[ImuReading],
    verbose: u8,
    interrupt: &mut Interrupt,
) -> Result<VisualInertial, Failure> {
    let VisualInertialDocument { settings, camera, body_from_camera, .. } = document;
    // the first image with readings before it
    let begins = readings.first().map_or(f64::INFINITY, |reading| reading.timestamp);
    let early = keyframes.iter().take_while(|(timestamp, _)| *timestamp < begins).count();
    if early > 0 {
        output::print_note(&format!(
            "{} before the first reading of the IMU: not used",
            count(early, "keyframe")
        ));
    }
    let mut keyframes = keyframes.iter().skip(early);
    let Some((timestamp, points)) = keyframes.next() else {
        return Err(Failure::with_help(
            "no image lies within the readings of the IMU",
            "check that both files use the same clock, and the same unit of time",
        ));
    };
    let (settings, camera, mounting) = (settings.clone(), *camera, *body_from_camera);
    let mut estimation = VisualInertial::begin(settings, camera, mounting, *timestamp, points, readings)
        .map_err(Failure::input)?;
    let mut watch = Watch::new(verbose, "keyframes");
    for (timestamp, points) in keyframes {
        if interrupt.poll().is_break() {
            break;
        }
        watch.show(&format!("{timestamp:.2} s"));
        estimation.add_keyframe(*timestamp, points, readings).map_err(Failure::input)?;
    }
    Ok(estimation)
}

fn trajectory(states: &[InertialState]) -> Vec<StampedPose> {
    states.iter().map(|state| StampedPose { timestamp: state.timestamp, pose: state.pose }).collect()
}

/// Returns velocities and biases as CSV.
fn states(states: &[InertialState]) -> String {
    let mut text = String::from("timestamp,vx,vy,vz,bgx,bgy,bgz,bax,bay,baz\n");
    for state in states {
        let numbers = state.velocity.iter().chain(state.bias.iter()).map(|x| format!(",{x}"));
        text += &format!("{}{}\n", state.timestamp, numbers.collect::<String>());
    }
    text
}

/// Returns the absolute trajectory error after alignment by a rigid motion, in metres, and the number of poses that it
/// covers.
fn error(truth: &[StampedPose], states: &[InertialState]) -> Result<(f64, usize), MetricsError> {
    /// Largest time difference between two matched poses, in seconds.
    const WITHIN: f64 = 0.02;
    let pairs = associate(truth, &trajectory(states), WITHIN)?;
    let (_, pairs) = align(&pairs, Alignment::Se3)?;
    Ok((absolute_error(&pairs)?.rmse, pairs.len()))
}
