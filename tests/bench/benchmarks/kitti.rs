//! Converts a sequence of KITTI tracking to a recording: poses, boxes of a detector, and the numbers of
//! static objects.
//!
//! `measure kitti FOLDER SEQUENCE OUT`: FOLDER has `orbslam3_poses` (3 × 4, by frame), `label_02` and
//! `pointrcnn_car`. A box gets the number of the track whose box it overlaps most, if the overlap is at
//! least one half and the object stays within 2 m of one place in 10 frames or more; otherwise it gets
//! none.
use super::{Arguments, BenchmarkResult};
use manifactor_geometry::{Se3, So3};
use manifactor_graph::checked::Positive;
use manifactor_quadric::{BoundingBox, Camera};
use manifactor_slam::measurement::{DepthMeasurement, Quantities};
use manifactor_slam::recording;
use manifactor_slam::sequence::{ClassScores, Detection, Frame, ObjectId, SequenceHeader};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use std::path::Path;

/// Camera of the sequences from 26 September 2011.
const CAMERA: Camera =
    Camera { fx: 721.5377, fy: 721.5377, cx: 609.5593, cy: 172.854, skew: 0.0, width: 1242, height: 375 };
/// Time between two images. Unit: seconds.
const INTERVAL: f64 = 0.1;
/// Largest apparent motion of a static object in metres, and smallest number of its frames.
const STILL: (f64, usize) = (2.0, 10);

/// A labelled object.
struct Label {
    track: u32,
    bounding_box: BoundingBox,
    place: Vector3<f64>,
}

fn numbers<'a>(fields: impl Iterator<Item = &'a str>) -> Vec<f64> {
    fields.map(|field| field.trim().parse().unwrap_or(f64::NAN)).collect()
}

fn poses(text: &str) -> Vec<Se3> {
    let pose = |line: &str| {
        let n = numbers(line.split_whitespace());
        let rotation = Matrix3::from_fn(|r, c| n[4 * r + c]);
        Se3::new(So3::from_matrix(&rotation), Vector3::new(n[3], n[7], n[11]))
    };
    text.lines().map(pose).collect()
}

fn labels(text: &str) -> BTreeMap<usize, Vec<Label>> {
    let mut all: BTreeMap<usize, Vec<Label>> = BTreeMap::new();
    for line in text.lines() {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let (Ok(frame), Ok(track)) = (fields[0].parse(), fields[1].parse()) else { continue };
        let n = numbers(fields[6..].iter().copied());
        let bounding_box = BoundingBox::new([n[0], n[1], n[2], n[3]]).unwrap();
        let place = Vector3::new(n[7], n[8], n[9]);
        all.entry(frame).or_default().push(Label { track, bounding_box, place });
    }
    all
}

/// Returns the tracks of static objects.
fn still(labels: &BTreeMap<usize, Vec<Label>>, poses: &[Se3]) -> Vec<u32> {
    let mut places: BTreeMap<u32, Vec<Vector3<f64>>> = BTreeMap::new();
    for (frame, labels) in labels {
        for label in labels {
            places.entry(label.track).or_default().push(poses[*frame].act(&label.place));
        }
    }
    let is_still = |places: &Vec<Vector3<f64>>| {
        let median = Vector3::from_fn(|i, _| {
            let mut along: Vec<f64> = places.iter().map(|place| place[i]).collect();
            along.sort_by(f64::total_cmp);
            along[along.len() / 2]
        });
        places.len() >= STILL.1 && places.iter().all(|place| (place - median).norm() <= STILL.0)
    };
    places.into_iter().filter(|(_, places)| is_still(places)).map(|(track, _)| track).collect()
}

pub(super) fn run(arguments: Arguments) -> BenchmarkResult {
    let arguments: Vec<String> = arguments.collect();
    let [folder, sequence, out] = arguments.as_slice() else { panic!("kitti FOLDER SEQUENCE OUT") };
    let read = |kind: &str| {
        std::fs::read_to_string(Path::new(folder).join(kind).join(format!("{sequence}.txt"))).unwrap()
    };
    let (poses, labels) = (poses(&read("orbslam3_poses")), labels(&read("label_02")));
    let still = still(&labels, &poses);
    let mut recorded = SequenceHeader::new(CAMERA).into_sequence();
    let camera = recorded.cameras.first().clone();
    let frame = |(i, pose): (usize, &Se3)| Frame::new(i as f64 * INTERVAL, *pose);
    recorded.frames = poses.iter().enumerate().map(frame).collect();
    let mut named = 0;
    for line in read("pointrcnn_car").lines() {
        let n = numbers(line.split(','));
        let frame = n[0] as usize;
        // the network predicts boxes beyond the image, and unbounded scores
        let inside = [n[2].max(0.0), n[3].max(0.0), n[4].min(1242.0), n[5].min(375.0)];
        let Ok(bounding_box) = BoundingBox::new(inside) else { continue };
        let scores = ClassScores::single("car", 1.0 / (1.0 + (-n[6]).exp()));
        let near = labels.get(&frame).into_iter().flatten();
        let near = near.map(|label| (label.bounding_box.iou(&bounding_box), label.track));
        let best = near.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(iou, _)| *iou >= 0.5);
        let object = best.filter(|(_, track)| still.contains(track)).map(|(_, track)| ObjectId(track + 1));
        named += usize::from(object.is_some());
        recorded.detections.push(Detection {
            frame,
            object,
            quantities: Positive::new(n[12])
                .map_or(Quantities::NONE, |z| Quantities::one(DepthMeasurement(z))),
            ..Detection::new(camera.clone(), bounding_box, scores)
        });
    }
    recorded.detections.sort_by_key(|detection| detection.frame);
    recording::write(&recorded, Path::new(out)).unwrap();
    println!(
        "{} frames, {} boxes, {named} of {} objects that stand still",
        poses.len(),
        recorded.detections.len(),
        still.len()
    );
    Ok(())
}
