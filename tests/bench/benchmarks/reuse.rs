//! Reuse of a map: made from one part of a sequence, then relocalized in and extended by further parts.
//!
//! `measure reuse RUN.toml FROM..TO START[..END]… [KEY=VALUE…]`: frames FROM to TO make the map. Each
//! stream begins at frame START with an unknown pose, and ends at END or with the sequence;
//! `OTHER.toml:START` is a stream of a different document. For each stream, it prints the number of frames
//! before the relocalization, and the pose errors at that frame and at the end, against the ground truth in
//! the map's frame. The variant is the one called `ours`, or the last.
use super::{Arguments, BenchmarkResult};
use manifactor_config::Document;
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::Direction;
use manifactor_slam::metrics::{Alignment, align, associate};
use manifactor_slam::online::{FrameReport, Relocalization};
use manifactor_slam::output::map_of;
use manifactor_slam::output::write_whole;
use manifactor_slam::run::{MappedFrame, StreamEvent, StreamWatcher, online};
use manifactor_slam::run_document::RunDocument;
use manifactor_slam::sequence::Sequence;
use manifactor_slam::source::InputFolders;
use manifactor_solve::Silent;
use std::ops::{ControlFlow, Range};
use std::sync::Arc;

/// The frames of a part of a sequence. Its odometry begins at a different pose, as after a restart.
fn part(all: &Sequence, frames: Range<usize>) -> Sequence {
    let mut part = all.header().into_sequence();
    let observations = all.observations().skip(frames.start).take(frames.len());
    let first = all.frames[frames.start].world_from_camera;
    part.up = all.up.map(|up| Direction::new(first.rotation.inverse().act(&up)).unwrap());
    for mut observation in observations {
        observation.frame.world_from_camera = first.between(&observation.frame.world_from_camera);
        part.push(observation);
    }
    part
}

/// Transformation from the map's frame to the frame of the truth.
fn truth_from_map(sequence: &Sequence, trajectory: &[StampedPose]) -> Se3 {
    let truth = &sequence.ground_truth.as_ref().unwrap().trajectory;
    let pairs = associate(truth, trajectory, 0.02).unwrap();
    let found = align(&pairs, Alignment::Se3).unwrap().0;
    Se3::new(found.rotation, found.translation)
}

/// Errors of a pose in degrees and metres.
fn off(sequence: &Sequence, truth_from_map: &Se3, pose: &StampedPose) -> Option<[f64; 2]> {
    let truth = &sequence.ground_truth.as_ref().unwrap().trajectory;
    let pair = associate(truth, std::slice::from_ref(pose), 0.02).ok()?.pop()?;
    let error = pair.truth.between(&truth_from_map.compose(&pair.estimate));
    Some([error.rotation.log().norm().to_degrees(), error.translation.norm()])
}

/// Root mean squares of these errors over a trajectory.
fn rmse(sequence: &Sequence, truth_from_map: &Se3, trajectory: &[StampedPose]) -> [f64; 2] {
    let all: Vec<_> = trajectory.iter().filter_map(|pose| off(sequence, truth_from_map, pose)).collect();
    [0, 1].map(|i| (all.iter().map(|error| error[i] * error[i]).sum::<f64>() / all.len() as f64).sqrt())
}

/// Records the frame of the relocalization, and the poses estimated from then on.
#[derive(Default)]
struct Found {
    at: Option<(usize, Vec<StampedPose>, Relocalization)>,
    longest: f64,
}

impl StreamWatcher for Found {
    fn event(&mut self, event: StreamEvent<'_>) -> ControlFlow<()> {
        let StreamEvent::Frame(MappedFrame { report, seconds, .. }) = event else {
            return ControlFlow::Continue(());
        };
        self.longest = self.longest.max(seconds);
        if let Ok(FrameReport { frame, timestamp, pose, located: Some(located), .. }) = report {
            self.at =
                Some((*frame, vec![StampedPose { timestamp: *timestamp, pose: *pose }], located.clone()));
        } else if let (Ok(FrameReport { timestamp, pose, .. }), Some((_, poses, _))) = (report, &mut self.at)
        {
            poses.push(StampedPose { timestamp: *timestamp, pose: *pose });
        }
        ControlFlow::Continue(())
    }
}

fn range(text: &str, all: usize) -> Range<usize> {
    let (from, to) = text.split_once("..").unwrap_or((text, ""));
    from.parse().unwrap()..to.parse().unwrap_or(all)
}

pub(super) fn run(arguments: Arguments) -> BenchmarkResult {
    let arguments: Vec<String> = arguments.collect();
    let (sets, places): (Vec<_>, Vec<_>) =
        arguments.iter().skip(1).partition(|argument| argument.contains('='));
    // settings of the prior map apply only to runs that have one
    let (of_map, sets): (Vec<_>, Vec<_>) = sets.into_iter().partition(|set| set.starts_with("prior_map."));
    let mut document = Document::open(&arguments[0]).unwrap();
    document.set(&sets).unwrap();
    let run = RunDocument::read(&document).unwrap();
    let variant = run.variants.iter().find(|v| v.name == "ours").or(run.variants.last()).unwrap();
    let data = std::env::var("MANIFACTOR_DATA").ok().map(Into::into);
    let folders = InputFolders { data, document: run.folder.clone() };
    let sequence = variant.settings.source.load(&folders).unwrap();
    let settings = &variant.settings;

    let mapped = Arc::new(part(&sequence, range(places[0], sequence.frames.len())));
    let (estimate, _) = manifactor_slam::run::estimate("map", mapped, settings, &mut Silent).unwrap();
    let frame = truth_from_map(&sequence, &estimate.trajectory());
    let clock = std::time::Instant::now();
    let map = map_of(&estimate, settings).unwrap();
    println!("{} objects, in {:.2} s", map.objects.len(), clock.elapsed().as_secs_f64());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("map.json");
    write_whole(&file, serde_json::to_string(&map).unwrap()).unwrap();
    document.set(&[format!("prior_map.file={}", file.display())]).unwrap();
    document.set(&of_map).unwrap();
    let run = RunDocument::read(&document).unwrap();
    let variant = run.variants.iter().find(|v| v.name == "ours").or(run.variants.last()).unwrap();

    for place in &places[1..] {
        // a stream of a different document
        let other = place.split_once(':').map(|(other, _)| {
            let mut document = Document::open(other).unwrap();
            document.set(&sets).unwrap();
            RunDocument::read(&document).unwrap().variants[0].settings.source.load(&folders).unwrap()
        });
        let sequence = other.as_ref().unwrap_or(&sequence);
        let frames = place.rsplit(':').next().unwrap();
        let stream = Arc::new(part(sequence, range(frames, sequence.frames.len())));
        let (mut found, began) = (Found::default(), stream.frames[0].timestamp);
        let (estimate, report) = online(place, stream.into(), &variant.settings, &mut found).unwrap();
        let Some((at, poses, located)) = found.at else {
            println!("{place}: not found");
            continue;
        };
        let told =
            |error: Option<[f64; 2]>| error.map_or("?".to_owned(), |[deg, m]| format!("{deg:.1}° {m:.3} m"));
        let last = estimate.trajectory().iter().rev().find_map(|pose| off(sequence, &frame, pose));
        let prior = report.prior_map.unwrap();
        let same = located.matches.iter().filter(|(a, b)| a == b).count();
        let [turn, shift] = rmse(sequence, &frame, &estimate.trajectory());
        println!(
            "{place}: after {at} frames, {:.1} s, off by {}, in the end {}; {} matches ({same} of one name), lead {:.1}, IoU {:.2}, {:.2} of what should be seen; longest frame {:.0} ms; seen {} of {}, gone {:?}, added {}; objects {}; rmse {:.1}° {:.3} m",
            poses[0].timestamp - began,
            // the truth has gaps
            told(poses.iter().find_map(|pose| off(sequence, &frame, pose))),
            told(last),
            located.matches.len(),
            located.lead,
            located.overlap,
            located.seen,
            found.longest * 1e3,
            prior.seen.len(),
            prior.objects,
            prior.gone,
            prior.added.len(),
            estimate.mapping.mapped().count(),
            turn,
            shift,
        );
    }
    Ok(())
}
