//! Published pose graphs through the smoother, pose by pose, compared with batch solves.
use manifactor_formats::pose_graph::{self, PoseGraph, PoseGraphOptions};
use manifactor_formats::replay::GraphReplay;
use manifactor_geometry::{Between, Point2, Range, Se2, Se3};
use manifactor_graph::checked::{NotNegative, Positive};
use manifactor_graph::loss::Cauchy;
use manifactor_graph::{Graph, Key, Manifold, Noise, Values};
use manifactor_smoother::{Smoother, SmootherSettings, Span, UpdateReport, Window};
use manifactor_solve::{LevenbergMarquardt, Problem, Silent, solve};
use nalgebra::{Vector2, Vector3};
use std::num::NonZeroUsize;
use std::path::PathBuf;

fn data(path: &str) -> Option<PathBuf> {
    let file = std::env::var_os("MANIFACTOR_DATA").map(|root| PathBuf::from(root).join(path));
    let file = file.filter(|file| file.exists());
    if file.is_none() {
        eprintln!("skipped: MANIFACTOR_DATA does not name a folder with {path}");
    }
    file
}

/// Runs at most this number of steps, and returns the smoother and its last report.
fn replay(graph: &Graph, most: usize) -> (Smoother, UpdateReport) {
    let mut session = Smoother::new(SmootherSettings::default());
    let (mut steps, mut report) = (GraphReplay::of(graph, &Values::new()), UpdateReport::default());
    for _ in 0..most {
        let Some(step) = steps.step(|key| session.estimate(key)).unwrap() else { break };
        session.push(&step.factors, &step.values).unwrap();
        report = session.update().unwrap();
    }
    (session, report)
}

#[test]
fn the_estimate_is_close_to_the_optimum_and_finish_is_there() {
    // Largest relative excess of the running estimate over the optimum.
    for (name, most, above) in
        [("intel", 600, 1e-3), ("parking-garage", 700, 0.05), ("input_M3500_g2o", 600, 2e-3)]
    {
        let Some(path) = data(&format!("g2o/{name}.g2o")) else { return };
        let graph = pose_graph::read(path, &PoseGraphOptions::default()).unwrap().graph;
        let (mut session, report) = replay(&graph, most);
        assert!(
            report.undetermined_variables.is_empty() && report.undetermined_directions.is_empty(),
            "{name}: {report:?}"
        );
        let finished = session.finish(&LevenbergMarquardt::default(), &mut Silent).unwrap();
        let (cost, best) = (session.cost(), finished.outcome.final_cost);
        assert!(cost <= best * (1.0 + above), "{name}: {cost}, the optimum is {best}");
        let batch = solve(&session.graph().0, &finished.values, &LevenbergMarquardt::default(), &mut Silent);
        let batch = batch.unwrap().outcome.final_cost;
        assert!((best - batch).abs() <= 1e-6 * batch, "{name}: {best}, batch {batch}");
    }
}

#[test]
fn a_covariance_from_the_fronts_is_that_of_a_batch() {
    let Some(path) = data("g2o/intel.g2o") else { return };
    let graph = pose_graph::read(path, &PoseGraphOptions::default()).unwrap().graph;
    let (session, _) = replay(&graph, 300);
    let keys = ["x299", "x17"];
    let mut problem = Problem::compile(&session.graph().0, &session.estimates()).unwrap();
    let expected = problem.joint_covariance(&keys).unwrap();
    // Linearization points differ slightly from the estimate.
    let found = session.covariance(&keys).unwrap();
    assert!((&found - &expected).norm() < 1e-2 * expected.norm(), "{found} {expected}");
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let Some(path) = data("g2o/parking-garage.g2o") else { return };
    let graph = pose_graph::read(path, &PoseGraphOptions::default()).unwrap().graph;
    let bits = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let session = pool.install(|| replay(&graph, 250).0);
        let local = |pose: &Se3| Se3::identity().local(pose).map(f64::to_bits);
        session.estimates().all::<Se3>().map(|(_, pose)| local(pose)).collect::<Vec<_>>()
    };
    let alone = bits(1);
    assert!(bits(2) == alone && bits(4) == alone);
}

#[test]
fn a_replay_goes_on_after_a_restart_bit_for_bit() {
    for name in ["intel", "parking-garage", "input_M3500_g2o"] {
        let Some(path) = data(&format!("g2o/{name}.g2o")) else { return };
        let PoseGraph { graph, values, .. } = pose_graph::read(path, &PoseGraphOptions::default()).unwrap();
        let (mut steps, mut session) =
            (GraphReplay::of(&graph, &values), Smoother::new(SmootherSettings::default()));
        let mut other = None;
        for n in 0..400 {
            let Some(step) = steps.step(|key| session.estimate(key)).unwrap() else { break };
            let next = |session: &mut Smoother| {
                session.push(&step.factors, &step.values).unwrap();
                session.update().unwrap()
            };
            let report = next(&mut session);
            if let Some(other) = &mut other {
                assert_eq!(next(other), report, "{name}, pose {n}");
            }
            if n == 237 {
                other = Some(Smoother::load(&session.save().unwrap()).unwrap());
            }
        }
        let (text, other) = (session.save().unwrap(), other.unwrap());
        assert!(other.save().unwrap() == text, "{name}");
        assert_eq!(session.covariance(&["x300", "x17"]), other.covariance(&["x300", "x17"]), "{name}");
    }
}

#[test]
fn a_budget_bounds_what_an_update_takes_and_the_estimate_gets_there_later() {
    let Some(path) = data("g2o/input_M3500_g2o.g2o") else { return };
    let PoseGraph { graph, values, .. } = pose_graph::read(path, &PoseGraphOptions::default()).unwrap();
    let run = |budget: Option<f64>| {
        let budget = budget.map(NotNegative::literal);
        let mut session = Smoother::new(SmootherSettings { budget, ..SmootherSettings::default() });
        let (mut steps, mut reports) = (GraphReplay::of(&graph, &values), vec![]);
        for _ in 0..1000 {
            let step = steps.step(|key| session.estimate(key)).unwrap().unwrap();
            session.push(&step.factors, &step.values).unwrap();
            reports.push(session.update().unwrap());
        }
        (session, reports)
    };
    let (mut free, of_free) = run(None);
    let budget = 2e4;
    let (mut bounded, of_bounded) = run(Some(budget));
    let most = |reports: &[UpdateReport]| {
        // The budget covers neither the work for new factors nor steps that had to be shortened.
        let relinearizing = reports.iter().filter(|r| r.relinearized > 0 && r.halved + r.damped == 0);
        relinearizing.map(|r| r.operations).fold(0.0, f64::max)
    };
    let (without, with) = (most(&of_free), most(&of_bounded));
    assert!(
        without > 10.0 * budget && with < 1.5 * budget,
        "{without} without, {with} with a budget of {budget}"
    );
    assert!(of_bounded.iter().any(|r| r.postponed > 0) && of_free.iter().all(|r| r.postponed == 0));
    let mut empty = 0;
    while bounded.update().unwrap().postponed > 0 || empty < 20 {
        empty += 1;
        assert!(empty < 3000, "variables wait for ever");
    }
    (0..20).for_each(|_| drop(free.update().unwrap()));
    let (cost, expected) = (bounded.cost(), free.cost());
    assert!((cost - expected).abs() < 1e-3 * expected, "{cost}, without a budget {expected}");
}

#[test]
fn a_window_that_holds_all_closures_is_as_good_as_all() {
    let Some(path) = data("g2o/sphere2500.g2o") else { return };
    let PoseGraph { graph, values, .. } = pose_graph::read(path, &PoseGraphOptions::default()).unwrap();
    let window = Some(Window::from(Span::Poses(NonZeroUsize::new(120).unwrap())));
    let mut narrow = Smoother::new(SmootherSettings { window, ..SmootherSettings::default() });
    let (mut all, mut steps) = (Smoother::new(SmootherSettings::default()), GraphReplay::of(&graph, &values));
    let mut bytes = vec![];
    for n in 0..500 {
        let step = steps.step(|key| all.estimate(key)).unwrap().unwrap();
        for session in [&mut narrow, &mut all] {
            session.push(&step.factors, &step.values).unwrap();
            session.update().unwrap();
        }
        if n % 100 == 99 {
            bytes.push(narrow.bytes());
        }
    }
    // a window is longer by up to an eighth
    assert!((120..=135).contains(&narrow.variables()), "{} variables", narrow.variables());
    assert_eq!(all.variables(), 500);
    let [one, other] = [&narrow, &all].map(|session| session.covariance(&["x499"]).unwrap());
    assert!((&one - &other).norm() < 0.02 * other.norm(), "{one} {other}");
    let [one, batch]: [Se3; 2] = [&narrow, &all].map(|session| session.get("x499").unwrap());
    let apart = batch.local(&one).component_div(&other.diagonal().map(f64::sqrt).fixed_rows::<6>(0));
    assert!(apart.amax() < 0.5, "{apart} standard deviations");
    assert!(bytes[4] < 2 * bytes[2], "{bytes:?}");
    println!("{apart} {bytes:?} {}", all.bytes());
}

/// Rows of a table of numbers, without comments.
fn rows(path: PathBuf) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines.map(|line| line.split_whitespace().map(|field| field.parse().unwrap()).collect()).collect()
}

#[test]
fn antennas_wait_for_a_second_range() {
    let (Some(odometry), Some(ranges)) =
        (data("online/range_only/Plaza2_DR.txt"), data("online/range_only/Plaza2_TD.txt"))
    else {
        return;
    };
    let (odometry, ranges) = (rows(odometry), rows(ranges));
    let mut session = Smoother::new(SmootherSettings::default());
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("x0", Se2::identity());
    graph.fix("x0");
    session.push(&graph, &values).unwrap();
    let (mut first, mut waited, mut pose) = (0, 0, Se2::identity());
    for (i, row) in ranges.iter().take(600).enumerate() {
        let (mut graph, mut values) = (Graph::new(), Values::new());
        let (here, antenna) = (Key::indexed("x", i + 1), Key::indexed("l", row[2]));
        let mut relative = Se2::identity();
        while first < odometry.len() && odometry[first][0] <= row[0] {
            relative = Se2::compose(
                &relative,
                &Se2::exp(&Vector3::new(odometry[first][1], 0.0, odometry[first][2])),
            );
            first += 1;
        }
        pose = Se2::compose(&pose, &relative);
        values.insert(here.clone(), pose);
        graph
            .add([Key::indexed("x", i), here.clone()], Between { relative })
            .noise(Noise::sigmas(&[0.05, 0.01, 0.02]).unwrap());
        if session.estimate(antenna.as_str()).is_none() {
            // Somewhere ahead, as a single range determines no more.
            values.insert(antenna.clone(), Point2::new(pose.act(&Vector2::new(row[3], 1.0))));
        }
        let range = Range::<Se2, Point2>::new(Positive::new(row[3]).unwrap());
        graph.add([here.clone(), antenna], range).noise(Noise::sigma(0.5).unwrap()).loss(Cauchy::default());
        session.push(&graph, &values).unwrap();
        let report = session.update().unwrap();
        assert!(
            report.undetermined_variables.iter().all(|key| key.as_str().starts_with('l')),
            "{:?}",
            report.undetermined_variables
        );
        waited += report.undetermined_variables.len();
        pose = session.get(here.as_str()).unwrap();
    }
    assert!(waited > 0, "an antenna that is heard once is not known");
    let (cost, estimates) = (session.cost(), session.estimates());
    assert!(cost.is_finite() && estimates.iter().all(|(_, value)| value.erased().is_finite()));
    let best = session.finish(&LevenbergMarquardt::default(), &mut Silent).unwrap().outcome.final_cost;
    assert!(cost < 1.1 * best, "{cost}, the optimum is {best}");
}
