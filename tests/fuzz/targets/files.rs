//! Files that runs write and later commands read: maps and records.
use super::{assert_alike, is_finite, temporary};
use manifactor::config::{Document, Format};
use manifactor::geometry::Se3;
use manifactor::slam::online::Mapper;
use manifactor::slam::prior_map::PriorMap;
use manifactor::slam::record::RunRecord;
use manifactor::slam::run_document::RunDocument;
use manifactor::slam::sequence::{Frame, Observation, SequenceHeader};
use manifactor::viz::{Theme, ply, run_pictures};
use std::path::Path;

/// Width of pictures, in pixels.
const WIDTH: f64 = 320.0;
/// Records with more frames, objects, or images are read, but not drawn.
const DRAWN: usize = 100;

/// Reads prior maps. A map is written and read back, and a run begins in it.
pub fn prior_map(data: &[u8]) {
    let folder = temporary();
    let path = folder.path().join("map.json");
    let Some(map) = map(&path, data) else { return };
    let text = serde_json::to_string(&map).unwrap_or_else(|e| panic!("{e}"));
    let again =
        self::map(&path, text.as_bytes()).unwrap_or_else(|| panic!("a map cannot be read back: {text}"));
    assert_alike(&to_json(&map), &to_json(&again));
    let text = r#"source = { type = "simulated" }
        prior_map = { file = "map.json", start = { translation = [0, 0, 0], rotation = [0, 0, 0, 1] } }"#;
    let name = folder.path().join("run.toml").display().to_string();
    let document = Document::parse(&name, text, Format::Toml).unwrap_or_else(|e| panic!("{e}"));
    let run = RunDocument::read(&document).unwrap_or_else(|e| panic!("{e}"));
    let settings = &run.variants[0].settings;
    let mut mapper = Mapper::new(SequenceHeader::new(super::stream::camera()), settings);
    for timestamp in [0.0, 1.0] {
        let frame = Frame::new(timestamp, Se3::identity());
        let observation = Observation::new(frame);
        // a map whose numbers overflow is refused with the first frame
        let _ = mapper.add_frame(&observation);
        is_finite(&mapper.smoother().estimates());
    }
}

fn map(path: &Path, bytes: &[u8]) -> Option<PriorMap> {
    std::fs::write(path, bytes).unwrap_or_else(|e| panic!("{e}"));
    PriorMap::read(path).ok()
}

/// Reads records of runs. A record is written and read back, and drawn with finite numbers.
pub fn record(data: &[u8]) {
    let folder = temporary();
    let Some(record) = run_record(folder.path(), data) else { return };
    let text = serde_json::to_string(&record).unwrap_or_else(|e| panic!("{e}"));
    let again = run_record(folder.path(), text.as_bytes())
        .unwrap_or_else(|| panic!("a record cannot be read back: {text}"));
    assert_alike(&to_json(&record), &to_json(&again));
    for variant in record.variants.iter().take(2) {
        if [variant.frames.len(), variant.objects.len(), variant.images].into_iter().any(|n| n > DRAWN) {
            continue;
        }
        for picture in run_pictures(&record, variant, WIDTH) {
            let svg = picture.svg(Theme::Light);
            for word in ["\"NaN", " NaN", "\"inf", " inf", "\"-inf", " -inf"] {
                assert!(!svg.contains(word), "{} has the number {word}", picture.name);
            }
        }
        let _ = ply(&record, variant);
    }
}

fn run_record(folder: &Path, bytes: &[u8]) -> Option<RunRecord> {
    std::fs::write(folder.join("record.json"), bytes).unwrap_or_else(|e| panic!("{e}"));
    RunRecord::read(folder).ok()
}

fn to_json(value: &impl serde::Serialize) -> serde_json::Value {
    serde_json::to_value(value).unwrap_or_else(|e| panic!("{e}"))
}
