//! Data association alone, on the poses of the odometry. The settings of `likelihood` were chosen with it.
//!
//! `measure associate [SETTING=VALUE…] [-r] SEQUENCE…`. A sequence is a folder of TUM with its odometry,
//! `1_desk:dvo_vo.txt`, or the seed of a simulated desk: below 100 with objects of all classes, below 200 a
//! crowd of bottles, else a crowd of three classes. With -r, the mean is over the associations after a
//! final reconsideration of all frames.
use super::{Arguments, BenchmarkResult};
use manifactor_geometry::Se3;
use manifactor_quadric::DualQuadric;
use manifactor_slam::association::{
    Association, FrameDetections, LikelihoodAssociation, MapEstimate, ObjectIdChanges,
};
use manifactor_slam::class::ClassAliases;
use manifactor_slam::metrics::{IdentityScores, identity};
use manifactor_slam::sequence::{ObjectId, Sequence};
use manifactor_slam::simulator::SimulatedSource;
use manifactor_slam::source::{InputFolders, SequenceSource, TumRgbd};
use serde_json::{Value, from_str, from_value, json};

/// A map that has only the poses of the odometry.
struct Odometry<'a>(&'a Sequence);

impl MapEstimate for Odometry<'_> {
    fn pose(&self, frame: usize) -> Option<Se3> {
        Some(self.0.frames.get(frame)?.world_from_camera)
    }
    fn object(&self, _: ObjectId) -> Option<DualQuadric> {
        None
    }
}

fn load(name: &str) -> Sequence {
    let data = std::env::var("MANIFACTOR_DATA").ok().map(Into::into);
    let folders = InputFolders { data, ..InputFolders::default() };
    if let Some((sequence, odometry)) = name.split_once(':') {
        let (sequence, odometry) =
            (format!("rgbd_dataset_freiburg{sequence}"), format!("trajectories/{odometry}"));
        let source: TumRgbd = from_value(json!({ "sequence": sequence, "odometry": odometry })).unwrap();
        return source.load(&folders).unwrap();
    }
    let seed: u64 = name.parse().unwrap();
    let mut scene = json!({ "objects": 12, "seed": seed });
    if seed >= 100 {
        let classes: &[&str] = if seed < 200 { &["bottle"] } else { &["bottle", "book", "cup"] };
        (scene["classes"], scene["gap"], scene["area"]) = (json!(classes), json!(0.05), json!([1.4, 1.2]));
    }
    let source = json!({
        "seed": seed,
        "scene": scene,
        "trajectory": { "frames": 300, "seed": seed },
        "detector": { "missed": 0.1, "occluded": 0.15, "sigma_px": 4.0, "misclassified": 0.05, "confused": 0.1 },
    });
    from_value::<SimulatedSource>(source).unwrap().load(&folders).unwrap()
}

/// Scores of the associations at arrival, at the end, and after a final reconsideration.
fn scores(settings: &LikelihoodAssociation, sequence: &Sequence) -> [IdentityScores; 3] {
    let map = Odometry(sequence);
    let mut associator = settings.create_associator(&ClassAliases::default(), &[]);
    let (mut names, mut then) = (ObjectIdChanges::default(), vec![]);
    let frames: Vec<_> = sequence.observations().collect();
    let image = |frame: usize| {
        let (timestamp, detections) = (frames[frame].frame.timestamp, frames[frame].detections.as_slice());
        FrameDetections { frame, timestamp, detections }
    };
    for frame in 0..frames.len() {
        let put = associator.associate(&image(frame), &map);
        let learned = associator.learn_from_frame(&image(frame), &put, &map);
        learned.moved.iter().for_each(|moved| names.record_move(moved));
        learned.merged.into_iter().for_each(|merge| names.record_merge(merge));
        then.push(put);
    }
    let now_of = |frame: usize, put: &Vec<Option<ObjectId>>| -> Vec<Option<ObjectId>> {
        put.iter()
            .enumerate()
            .map(|(place, id)| id.map(|id| names.object_of_detection(id, frame, place)))
            .collect()
    };
    let now: Vec<Vec<_>> = then.iter().enumerate().map(|(frame, put)| now_of(frame, put)).collect();
    let again = now.iter().enumerate().map(|(i, put)| associator.reassociate(&image(i), put, &map)).collect();
    [then, now, again].map(|names: Vec<Vec<Option<ObjectId>>>| {
        let truth = sequence.detections.iter().map(|detection| detection.object);
        identity(truth.zip(names.into_iter().flatten()).filter_map(|(truth, put)| Some((truth?, put))))
    })
}

pub(super) fn run(arguments: Arguments) -> BenchmarkResult {
    let mut settings: Value = serde_json::to_value(LikelihoodAssociation::default()).unwrap();
    let (mut sequences, mut counts) = (vec![], 1);
    for argument in arguments {
        match argument.split_once('=') {
            Some((setting, value)) => settings[setting] = from_str(value).unwrap(),
            None if argument == "-r" => counts = 2,
            None => sequences.push(argument),
        }
    }
    let settings: LikelihoodAssociation = from_value(settings).unwrap();
    let mut sum = 0.0;
    for name in &sequences {
        let scores = scores(&settings, &load(name));
        let told = scores.map(|s| format!("P {:.3} R {:.3} F1 {:.3}", s.precision, s.recall, s.f1));
        let (objects, truth) = (scores[2].objects, scores[2].true_objects);
        println!(
            "{name}: then {}, now {}, again {}, {objects} objects of {truth}",
            told[0], told[1], told[2]
        );
        sum += scores[counts].f1;
    }
    println!("mean F1 {:.4}", sum / sequences.len() as f64);
    Ok(())
}
