//! Trajectory errors agree with those of `evo` to 1e-6 on published trajectories. `evo/figures.py` computed
//! the reference values.
use manifactor_formats::tum;
use manifactor_slam::metrics::{
    Alignment, Pairing, Statistics, absolute_error, align, associate, relative_error,
};
use std::path::PathBuf;

const FIGURES: &str = include_str!("evo/figures.csv");

fn measure(folder: &str, trajectory: &str, alignment: &str, measure: &str) -> Statistics {
    let folder = PathBuf::from(folder).join("tum");
    let sequence = trajectory.split('/').next().unwrap();
    let truth = tum::read(folder.join(sequence).join("groundtruth.txt")).unwrap();
    let estimate = tum::read(folder.join(trajectory)).unwrap();
    let pairs = associate(&truth.poses, &estimate.poses, 0.02).unwrap();
    let alignment = match alignment {
        "se3" => Alignment::Se3,
        "sim3" => Alignment::Sim3,
        "first_pose" => Alignment::FirstPose,
        _ => Alignment::None,
    };
    let (_, aligned) = align(&pairs, alignment).unwrap();
    let words: Vec<&str> = measure.split(' ').collect();
    match words[..] {
        ["rpe", delta, pairing, part] => {
            let pairing = if pairing == "all" { Pairing::All } else { Pairing::Consecutive };
            let error = relative_error(&aligned, delta.parse().unwrap(), pairing).unwrap();
            if part == "rotation" { error.rotation } else { error.translation }
        }
        _ => absolute_error(&aligned).unwrap(),
    }
}

#[test]
fn errors_agree_with_evo() {
    let Ok(folder) = std::env::var("MANIFACTOR_DATA") else {
        eprintln!("skipped: MANIFACTOR_DATA does not name a folder with published data");
        return;
    };
    let (mut failures, mut compared, mut worst) = (vec![], 0, 0.0_f64);
    for line in FIGURES.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let expected: Vec<f64> = fields[3..].iter().map(|x| x.parse().unwrap()).collect();
        let s = measure(&folder, fields[0], fields[1], fields[2]);
        let found = [s.count as f64, s.rmse, s.mean, s.median, s.std, s.min, s.max];
        let difference = expected.iter().zip(found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        compared += 1;
        worst = worst.max(difference);
        if difference > 1e-6 {
            failures.push(format!("{line}\n  found {found:?}"));
        }
    }
    println!("{compared} summaries compared; largest difference {worst:e}");
    assert!(compared == 160 && failures.is_empty(), "{}", failures.join("\n"));
}
