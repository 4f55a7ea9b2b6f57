//! Scores
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]
use manifactor_geometry::Se3;
use manifactor_quadric::DualQuadric;
use manifactor_slam::association::{Association, Image, Likelihood, Map, Names};
use manifactor_slam::class::Aliases;
use manifactor_slam::metrics::identity;
use manifactor_slam::sequence::{ObjectId, Sequence};
use manifactor_slam::source::{Folders, Source, TumRgbd};
use std::collections::BTreeMap;

struct Fixed<'a>(&'a Sequence);
impl Map for Fixed<'_> {
    fn pose(&self, frame: usize) -> Option<Se3> {
        Some(self.0.frames.get(frame)?.world_from_camera)
    }
    fn object(&self, _: ObjectId) -> Option<DualQuadric> {
        None
    }
}

fn main() {
    let mut settings = serde_json::to_value(Likelihood::default()).unwrap();
    let (mut files, mut verbose, mut oracle) = (vec![], false, false);
    for argument in std::env::args().skip(1) {
        match argument.split_once('=') {
            Some((k, v)) => settings[k] = serde_json::from_str(v).unwrap(),
            None if argument == "-v" => verbose = true,
            None if argument == "-o" => oracle = true,
            None => files.push(argument),
        }
    }
    let settings: Likelihood = serde_json::from_value(settings).unwrap();
    let folders = Folders { data: std::env::var("MANIFACTOR_DATA").ok().map(Into::into), ..Folders::default() };
    let mut f1s = vec![];
    for file in files {
        let source: Box<dyn Source> = if let Some((sequence, odometry)) = file.split_once(':') { Box::new(serde_json::from_value::<TumRgbd>(serde_json::json!({"sequence": format!("rgbd_dataset_freiburg{sequence}"), "odometry": format!("trajectories/{odometry}")})).unwrap()) } else {
            let n: u64 = file.parse().unwrap();
            let class: Vec<&str> = match n / 100 { 0 => vec![], 1 => vec!["bottle"], _ => vec!["bottle", "book", "cup"] };
            let mut v = serde_json::json!({"seed": n, "scene": {"objects": 12, "seed": n}, "trajectory": {"frames": 300, "seed": n}, "detector": {"missed": 0.1, "occluded": 0.15, "sigma_px": 4.0, "misclassified": 0.05, "confused": 0.1}});
            if !class.is_empty() { v["scene"]["gap"] = serde_json::json!(0.05); v["scene"]["area"] = serde_json::json!([1.4, 1.2]); v["scene"]["classes"] = serde_json::json!(class); }
            Box::new(serde_json::from_value::<manifactor_slam::simulator::Simulated>(v).unwrap())
        };
        let sequence = source.load(&folders).unwrap();
        let clock = std::time::Instant::now();
        let mut associator = settings.begin(sequence.camera, &Aliases::default());
        let (mut truth, mut then, mut now) = (vec![], vec![], vec![]);
        let mut into = Names::default();
        let mut longest: f64 = 0.0;
        for (i, o) in sequence.observations().enumerate() {
            let c = std::time::Instant::now();
            let image = Image { frame: i, timestamp: o.frame.timestamp, detections: &o.detections };
            let names = associator.associate(&image, &Fixed(&sequence));
            let taught: Vec<_> = if oracle { o.detections.iter().map(|d| d.object).collect() } else { names.clone() };
            let merged = associator.learn(&image, &taught, &Fixed(&sequence));
            longest = longest.max(c.elapsed().as_secs_f64());
            merged.into_iter().for_each(|m| into.merge(m));
            for (d, id) in o.detections.iter().zip(names) {
                if let Some(object) = d.object {
                    truth.push((object, d.scores.best().unwrap().0.to_owned()));
                    then.push(id);
                }
            }
        }
        for id in &then {
            now.push(id.map(|id| into.now(id)));
        }
        let known: std::collections::BTreeSet<_> = now.iter().flatten().copied().collect();
        let mut again = vec![];
        let mut at = 0;
        for (i, o) in sequence.observations().enumerate() {
            let image = Image { frame: i, timestamp: o.frame.timestamp, detections: &o.detections };
            let names = associator.associate(&image, &Fixed(&sequence));
            for (d, id) in o.detections.iter().zip(names) {
                if d.object.is_some() {
                    again.push(id.filter(|id| known.contains(id)).or(now[at]));
                    at += 1;
                }
            }
        }
        let c = identity(truth.iter().map(|t| t.0).zip(again.iter().copied()));
        let t = clock.elapsed().as_secs_f64();
        let a = identity(truth.iter().map(|t| t.0).zip(then.iter().copied()));
        let b = identity(truth.iter().map(|t| t.0).zip(now.iter().copied()));
        f1s.push(b.f1);
        println!(
            "{file}: again P {:.3} R {:.3} F1 {:.3} objects {} switches {}; then F1 {:.3}; now P {:.3} R {:.3} F1 {:.3} hom {:.3} com {:.3} idf1 {:.3} switches {} objects {} of {} in {t:.2} s, longest {:.1} ms, {} merges",
            c.precision, c.recall, c.f1, c.objects, c.switches, a.f1, b.precision, b.recall, b.f1, b.homogeneity, b.completeness, b.identity_f1, b.switches, b.objects, b.true_objects, longest * 1e3, into.given_up()
        );
        if verbose {
            let mut by: BTreeMap<ObjectId, BTreeMap<Option<ObjectId>, (usize, BTreeMap<String, usize>)>> = BTreeMap::new();
            for (t, n) in truth.iter().zip(&now) {
                let e = by.entry(t.0).or_default().entry(*n).or_default();
                e.0 += 1;
                *e.1.entry(t.1.clone()).or_default() += 1;
            }
            for (t, n) in by {
                print!("  {t}:");
                let mut n: Vec<_> = n.into_iter().collect();
                n.sort_by_key(|x| std::cmp::Reverse(x.1.0));
                for (p, (c, classes)) in n.iter().take(7) {
                    print!("  {} x{c} {:?}", p.map_or(0, |p| p.0), classes);
                }
                println!();
            }
        }
    }
    println!("mean {:.4}", f1s.iter().sum::<f64>() / f1s.len() as f64);
}
