//! The map that is built frame by frame, with arbitrary numbers.
use super::{assert_alike, is_finite, temporary, third};
use manifactor::config::{Document, Format};
use manifactor::geometry::{Se3, So3};
use manifactor::graph::checked::Positive;
use manifactor::nalgebra::Vector3;
use manifactor::quadric::BoundingBox;
use manifactor::slam::camera::Cameras;
use manifactor::slam::measurement::{DepthMeasurement, Quantities};
use manifactor::slam::online::Mapper;
use manifactor::slam::output::map_of;
use manifactor::slam::prior_map::PriorMap;
use manifactor::slam::run_document::RunDocument;
use manifactor::slam::sequence::{
    Acceleration, ClassScores, Detection, Frame, ObjectId, Observation, SequenceHeader,
};
use manifactor::slam::settings::RunSettings;
use manifactor::smoother::Smoother;
use std::sync::{Arc, LazyLock};

/// Longer streams are truncated, so that each input is fast.
const LONGEST: usize = 60;

/// Settings, selected by a number in the first line.
const SETTINGS: [&str; 5] = [
    "",
    "association = { type = \"likelihood\" }",
    "association = { type = \"likelihood\", twin_iou = 0.5 }\nonline = { window = { poses = 3 }, relinearize_every = 1 }",
    "association = { type = \"likelihood\", lasting = 1.0 }\nonline = { window = { seconds = 0.5 }, outliers = {} }",
    "gravity = { type = \"accelerometer\" }\nsemantics = \"table_one\"",
];

/// Maps frames with boxes. A refused frame has no effect, all estimates are finite, and the map at the end
/// is read back.
///
/// A line is `frame TIME TX TY TZ RX RY RZ`, `box OBJECT XMIN YMIN XMAX YMAX SCORE CLASS DEPTH`, or `feel
/// TIME X Y Z`.
pub fn mapper(data: &[u8]) {
    static READ: LazyLock<Vec<RunSettings>> = LazyLock::new(|| SETTINGS.map(settings).to_vec());
    let text = String::from_utf8_lossy(data);
    let number = text.split_whitespace().next().and_then(|word| word.parse::<usize>().ok());
    let settings = &READ[number.unwrap_or_default() % SETTINGS.len()];
    let opening = SequenceHeader::new(super::stream::camera());
    let new = || Mapper::new(opening.clone(), settings);
    // the second one gets only the frames that the first one accepts
    let (mut mapper, mut clean) = (new(), new());
    let mut sequence = opening.clone().into_sequence();
    for observation in observations(&text) {
        let taken = mapper.add_frame(&observation);
        is_finite(&mapper.smoother().estimates());
        if let Ok(report) = taken {
            let number = |x: &f64| x.is_finite();
            assert!(report.pose.translation.iter().all(number), "a pose is not finite");
            let again =
                clean.add_frame(&observation).unwrap_or_else(|e| panic!("a refused frame left a trace: {e}"));
            assert_eq!(report.box_objects, again.box_objects);
            sequence.push(observation);
        }
        assert_eq!(mapper.live_poses(), clean.live_poses(), "a refused frame left a trace");
    }
    mapper.finish_association();
    is_finite(&mapper.smoother().estimates());
    clean.finish_association();
    assert_eq!(estimates(mapper.smoother()), estimates(clean.smoother()), "a refused frame left a trace");
    let saved = mapper.smoother().save().unwrap_or_else(|e| panic!("{e}"));
    let loaded = Smoother::load(&saved).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.save().unwrap_or_else(|e| panic!("{e}")), saved);
    assert_eq!(estimates(&loaded), estimates(mapper.smoother()));
    let Ok(estimate) = mapper.finish(Arc::new(sequence), &mut third()) else { return };
    is_finite(&estimate.solution.values);
    let Ok(map) = map_of(&estimate, settings) else { return };
    let (folder, text) = (temporary(), serde_json::to_string(&map).unwrap_or_else(|e| panic!("{e}")));
    let path = folder.path().join("map.json");
    std::fs::write(&path, &text).unwrap_or_else(|e| panic!("{e}"));
    let again = PriorMap::read(&path).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let json = |map: &PriorMap| serde_json::to_value(map).unwrap_or_else(|e| panic!("{e}"));
    assert_alike(&json(&map), &json(&again));
}

fn settings(text: &str) -> RunSettings {
    let text = format!("source = {{ type = \"simulated\" }}\n{text}");
    let run = Document::parse("run.toml", text, Format::Toml);
    let run = run.and_then(|document| RunDocument::read(&document)).unwrap_or_else(|e| panic!("{e}"));
    run.variants[0].settings.clone()
}

fn estimates(session: &Smoother) -> Vec<(String, String)> {
    let text = |value| serde_json::to_string(value).unwrap_or_else(|e| panic!("{e}"));
    session.estimates().iter().map(|(key, value)| (key.to_string(), text(value))).collect()
}

fn observations(text: &str) -> Vec<Observation> {
    let mut all: Vec<Observation> = vec![];
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = |place: usize| words.get(place).and_then(|word| word.parse().ok()).unwrap_or_default();
        let vector = |from: usize| Vector3::from_fn(|i, _| number(from + i));
        let word = |place: usize| words.get(place).copied().unwrap_or_default();
        let frames = all.len();
        match (word(0), all.last_mut()) {
            ("frame", _) if frames < LONGEST => {
                all.push(Observation::new(Frame::new(number(1), Se3::new(So3::exp(&vector(5)), vector(2)))));
            }
            ("box", Some(last)) if last.detections.len() < LONGEST => {
                let [xmin, ymin, xmax, ymax] = std::array::from_fn(|i| number(2 + i));
                let camera = Cameras::new(super::stream::camera()).first().clone();
                let bounding_box = BoundingBox { xmin, ymin, xmax, ymax };
                last.detections.push(Detection {
                    object: word(1).parse().ok().map(ObjectId),
                    quantities: word(8)
                        .parse()
                        .ok()
                        .and_then(|depth| Positive::new(depth).ok())
                        .map_or(Quantities::NONE, |depth| Quantities::one(DepthMeasurement(depth))),
                    ..Detection::new(camera, bounding_box, ClassScores::single(word(7), number(6)))
                });
            }
            ("feel", Some(last)) => {
                last.accelerometer.push(Acceleration { timestamp: number(1), acceleration: vector(2) });
            }
            _ => {}
        }
    }
    all
}
