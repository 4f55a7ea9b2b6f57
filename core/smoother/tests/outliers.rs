//! Outlier tests of factors that may be wrong.
use crate::toy::{Apart, Plane};
use manifactor_graph::checked::NotNegative;
use manifactor_graph::{Graph, Noise, Values};
use manifactor_smoother::{FactorId, Outliers, Smoother, SmootherSettings, UpdateReport};
use manifactor_solve::{LevenbergMarquardt, Silent};

fn with(outliers: Outliers) -> Smoother {
    Smoother::new(SmootherSettings { outliers: Some(outliers), ..SmootherSettings::default() })
}

/// Creates a smoother that accepts a loop closure without confirmation.
fn smoother() -> Smoother {
    with(Outliers { max_information_gain: NotNegative::literal(100.0), ..Outliers::default() })
}

/// Adds a plane 1 m ahead, and loop closures from it. Each closure has the number of a plane and its measured
/// relative position.
fn step(smoother: &mut Smoother, i: usize, closures: &[(usize, [f64; 2])]) -> (UpdateReport, Vec<FactorId>) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert(format!("p{i}"), Plane { x: i as f64, y: 0.0 });
    match i {
        0 => graph.fix("p0"),
        _ => {
            let last = format!("p{}", i - 1);
            graph.add([last, format!("p{i}")], Apart { by: [1.0, 0.0] }).noise(Noise::sigma(0.1).unwrap());
        }
    }
    for (to, by) in closures {
        let keys = [format!("p{i}"), format!("p{to}")];
        graph.add(keys, Apart { by: *by }).noise(Noise::sigma(0.05).unwrap());
    }
    let ids = smoother.push(&graph, &values).unwrap();
    (smoother.update().unwrap(), ids.into_iter().skip(usize::from(i > 0)).collect())
}

#[test]
fn a_false_closure_stays_out_and_a_true_one_counts() {
    let mut smoother = smoother();
    (0..9).for_each(|i| _ = step(&mut smoother, i, &[]));
    let (report, ids) = step(&mut smoother, 9, &[(0, [0.0, 5.0]), (3, [-6.1, 0.0])]);
    assert_eq!((&report.rejected[..], report.readmitted.len()), (&ids[..1], 0), "{report:?}");
    let [out] = smoother.rejections()[..] else { panic!("{:?}", smoother.rejections()) };
    assert_eq!((out.factor, out.since), (ids[0], 10));
    // 9 m and 5 m off, with a σ of 5 cm
    assert!(out.cost.unwrap() > 1e4, "{out:?}");
    assert!(!smoother.graph().1.contains(&ids[0]) && smoother.graph().1.contains(&ids[1]));
    let finished = smoother.finish(&LevenbergMarquardt::default(), &mut Silent).unwrap();
    assert!(finished.outcome.final_cost < 1.0 && !finished.factors.contains(&ids[0]));
    // the accepted closure has moved the pose
    assert!(smoother.get::<Plane>("p9").unwrap().x > 9.05);
}

#[test]
fn what_was_rejected_comes_back_when_the_estimate_has_moved_there() {
    let mut smoother = smoother();
    (0..9).for_each(|i| _ = step(&mut smoother, i, &[]));
    // odometry was 1.3 m short, and only this closure indicates it so far
    let (_, out) = step(&mut smoother, 9, &[(0, [-10.3, 0.0])]);
    assert_eq!(smoother.rejections()[0].factor, out[0]);
    let mut back = vec![];
    for first in [0, 3, 6] {
        let mut graph = Graph::new();
        let keys = [format!("p{first}"), format!("p{}", first + 3)];
        graph.add(keys, Apart { by: [3.43, 0.0] }).noise(Noise::sigma(0.01).unwrap());
        smoother.push(&graph, &Values::new()).unwrap();
        let report = smoother.update().unwrap();
        assert!(report.rejected.is_empty());
        back.extend(report.readmitted);
    }
    assert_eq!(back, out);
    assert!(smoother.rejections().is_empty(), "{:?}", smoother.rejections());
    assert!((smoother.get::<Plane>("p9").unwrap().x - 10.3).abs() < 0.05);
}

#[test]
fn a_false_closure_that_came_first_is_outvoted() {
    let mut smoother = smoother();
    (0..20).for_each(|i| _ = step(&mut smoother, i, &[]));
    // odometry leaves this open, so the closure counts: σ is 0.45 m by now
    let (report, wrong) = step(&mut smoother, 20, &[(0, [-20.0, 1.2])]);
    assert!(report.rejected.is_empty(), "{report:?}");
    assert!(smoother.get::<Plane>("p20").unwrap().y < -1.1);
    let (_, first) = step(&mut smoother, 21, &[(1, [-20.0, 0.0])]);
    assert_eq!(smoother.rejections().len(), 1, "one word against another");
    let (_, second) = step(&mut smoother, 22, &[(2, [-20.0, 0.0])]);
    let out: Vec<FactorId> = smoother.rejections().iter().map(|r| r.factor).collect();
    assert_eq!(out, wrong, "the true ones are {first:?} and {second:?}");
    assert!(smoother.get::<Plane>("p20").unwrap().y.abs() < 0.05);
}

#[test]
fn what_nothing_is_known_of_contradicts_nothing() {
    let mut smoother = smoother();
    step(&mut smoother, 0, &[]);
    let (mut graph, mut values) = (Graph::new(), Values::new());
    // two variables that only a candidate ties to the map; they are not consecutive
    values.insert("q", Plane { x: 3.0, y: 3.0 });
    graph.add(["p0", "q"], Apart { by: [7.0, 0.0] });
    values.insert("r", Plane { x: 5.0, y: 5.0 });
    graph.add(["p0", "r"], Apart { by: [9.0, 1.0] });
    smoother.push(&graph, &values).unwrap();
    let report = smoother.update().unwrap();
    assert!(report.undetermined_variables.is_empty() && report.rejected.is_empty(), "{report:?}");
    assert!((smoother.get::<Plane>("r").unwrap().x - 9.0).abs() < 1e-12);
}

#[test]
fn a_rejected_factor_can_be_replaced_weighed_and_removed() {
    let mut smoother = smoother();
    (0..9).for_each(|i| _ = step(&mut smoother, i, &[]));
    let (_, ids) = step(&mut smoother, 9, &[(0, [0.0, 5.0])]);
    smoother.set_weight(ids[0], 0.5).unwrap();
    smoother.update().unwrap();
    assert_eq!(smoother.weight(ids[0]), Some(0.5));
    let mut entry = smoother.entry(ids[0]).unwrap().clone();
    entry.noise(Noise::sigma(100.0).unwrap());
    smoother.replace(ids[0], entry).unwrap();
    assert!(smoother.update().unwrap().rejected.is_empty());
    assert!(smoother.rejections().is_empty(), "with that noise it says nothing");
    smoother.remove(&ids).unwrap();
    smoother.update().unwrap();
    assert!(smoother.entry(ids[0]).is_none());
}

#[test]
fn a_variable_that_leaves_takes_its_rejected_factors_along() {
    let mut smoother = smoother();
    (0..9).for_each(|i| _ = step(&mut smoother, i, &[]));
    let (_, ids) = step(&mut smoother, 9, &[(0, [0.0, 5.0])]);
    smoother.marginalize(&["p0"]).unwrap();
    assert_eq!(smoother.update().unwrap().dropped, ids);
    assert!(smoother.rejections().is_empty());
}

#[test]
fn a_closure_that_says_much_waits_for_another_that_bears_it_out() {
    let mut smoother = with(Outliers::default());
    (0..20).for_each(|i| _ = step(&mut smoother, i, &[]));
    // σ is 0.45 m by now, and 0.05 m with the closure
    let (report, first) = step(&mut smoother, 20, &[(0, [-20.2, 0.0])]);
    assert_eq!(report.rejected, first);
    let (_, wrong) = step(&mut smoother, 21, &[(5, [-16.0, 3.0])]);
    let (report, second) = step(&mut smoother, 22, &[(2, [-20.2, 0.0])]);
    assert_eq!((report.trials, &report.readmitted[..]), (1, &first[..]), "{report:?} {second:?}");
    let out: Vec<FactorId> = smoother.rejections().iter().map(|r| r.factor).collect();
    assert_eq!(out, wrong);
    // a factor with little information is tested by the estimate alone, and needs no confirmation
    let (report, _) = step(&mut smoother, 23, &[(3, [-20.2, 0.0])]);
    assert!(report.rejected.is_empty() && report.trials == 0, "{report:?}");
}

/// Adds a plane 1 m ahead, with a wrong second factor before or after the right one.
fn twice(smoother: &mut Smoother, i: usize, wrong_first: bool) -> [FactorId; 2] {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert(format!("p{i}"), Plane { x: i as f64, y: 0.0 });
    let mut by = [([1.0, 0.0], 0.1), ([1.0, 4.0], 0.05)];
    if wrong_first {
        by.reverse();
    }
    for (by, sigma) in by {
        let keys = [format!("p{}", i - 1), format!("p{i}")];
        graph.add(keys, Apart { by }).noise(Noise::sigma(sigma).unwrap());
    }
    let ids = smoother.push(&graph, &values).unwrap();
    smoother.update().unwrap();
    let right = usize::from(wrong_first);
    [ids[right], ids[1 - right]]
}

#[test]
fn of_two_factors_between_neighbours_none_is_trusted_for_its_place() {
    for wrong_first in [false, true] {
        let mut smoother = with(Outliers::default());
        (0..5).for_each(|i| _ = step(&mut smoother, i, &[]));
        let [right, wrong] = twice(&mut smoother, 5, wrong_first);
        let mut closures = vec![];
        for (i, to) in [(6, 1), (7, 2), (8, 0), (9, 3)] {
            closures.extend(step(&mut smoother, i, &[(to, [to as f64 - i as f64, 0.0])]).1);
        }
        smoother.update().unwrap();
        let rejected: Vec<FactorId> = smoother.rejections().iter().map(|one| one.factor).collect();
        assert_eq!(rejected, [wrong], "right: {right:?}, closures: {closures:?}, {wrong_first}");
    }
}

#[test]
fn a_factor_that_replaces_a_candidate_at_once_is_judged_anew() {
    let mut smoother = with(Outliers::default());
    (0..3).for_each(|i| _ = step(&mut smoother, i, &[]));
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p3", Plane { x: 3.0, y: 0.0 });
    graph.add(["p2", "p3"], Apart { by: [1.0, 0.0] });
    let first = smoother.push(&graph, &values).unwrap();
    let mut second = Graph::new();
    second.add(["p2", "p3"], Apart { by: [1.5, 0.0] });
    let replaced = smoother.push(&second, &Values::new()).unwrap();
    smoother.remove(&first).unwrap();
    let entry = second.factors()[0].clone();
    smoother.replace(replaced[0], entry).unwrap();
    smoother.update().unwrap();
    assert!((smoother.get::<Plane>("p3").unwrap().x - 3.5).abs() < 1e-9);
    // it counts once, wherever it is linearized
    (0..5).for_each(|_| _ = smoother.update().unwrap());
    assert!((smoother.get::<Plane>("p3").unwrap().x - 3.5).abs() < 1e-9);
    assert!(smoother.rejections().is_empty());
}
