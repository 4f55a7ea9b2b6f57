use super::*;
use manifactor_geometry::So3;
use manifactor_recording::class::ClassAliases;
use manifactor_recording::prior_map::DetectionCounts;
use manifactor_recording::sequence::ClassScores;

/// Agreement without a missed object.
const AGREES: Agreement = Agreement { overlap: 1.0, seen: 1.0, missed: 0.0 };
const CLASSES: [&str; 3] = ["cup", "book", "bottle"];

fn object(id: u32, class: &str, centre: Vector3<f64>) -> Arc<PriorObject> {
    let mut classes = ClassFusion::default();
    for _ in 0..MIN_DETECTIONS {
        classes.add(&ClassScores::single(class, 0.8), &ClassAliases::default());
    }
    let quadric = DualQuadric { pose: Se3::new(So3::identity(), centre), semi_axes: Vector3::repeat(0.08) };
    let covariance = std::array::from_fn(|r| std::array::from_fn(|c| if r == c { 1e-4 } else { 0.0 }));
    Arc::new(PriorObject {
        id: ObjectId(id),
        classes,
        quadric,
        covariance,
        detection_counts: DetectionCounts::default(),
        least_px: None,
        flat: false,
    })
}

/// Objects on a table, with the classes in turn.
fn table(classes: &[&str], up: Option<Direction>) -> PriorMap {
    let places =
        [[0.0, 0.0], [0.7, 0.1], [1.5, -0.2], [0.3, 0.9], [1.1, 1.0], [-0.4, 0.6], [1.9, 0.8], [0.8, 1.7]];
    let all = places.iter().enumerate().map(|(i, [x, y])| {
        let height = 0.1 * (i % 3) as f64;
        object(10 + i as u32, classes[i % classes.len()], Vector3::new(*x, *y, height))
    });
    PriorMap::new(up, all.collect())
}

/// Returns the objects seen from a different pose, without the first `without` of them.
fn local_objects(
    map: &PriorMap,
    known_from_local: &Se3,
    without: usize,
) -> (Vec<LayoutObject>, Option<Direction>) {
    let local = known_from_local.inverse();
    let mark = |object: &Arc<PriorObject>| {
        let quadric = DualQuadric { pose: local.compose(&object.quadric.pose), ..object.quadric };
        LayoutObject::new(ObjectId(object.id.0 - 10), &quadric, 1e-4, &object.classes)
    };
    let up = map.up.map(|up| Direction::new(local.rotation.act(&up)).unwrap());
    (map.objects.iter().skip(without).map(mark).collect(), up)
}

/// A map of objects on a floor, with the given places and classes.
fn floor(objects: impl IntoIterator<Item = ([f64; 2], &'static str)>) -> PriorMap {
    let all = objects.into_iter().zip(10..);
    let all = all.map(|(([x, y], class), id)| object(id, class, Vector3::new(x, y, 0.0)));
    PriorMap::new(Some(Direction::Z), all.collect())
}

/// Six bottles in a regular hexagon.
fn ring() -> PriorMap {
    let angle = |i: u32| f64::from(i) * std::f64::consts::FRAC_PI_3;
    floor((0..6).map(|i| ([angle(i).cos(), angle(i).sin()], "bottle")))
}

/// Irregular places on a floor.
fn scattered(n: u32) -> impl Iterator<Item = [f64; 2]> {
    let part = |i: u32, step: f64| (f64::from(i + 1) * step).fract();
    (0..n).map(move |i| [8.0 * part(i * i, 0.618_033_988_7), 8.0 * part(i * i, 0.414_213_562_4)])
}

fn any_other_pose() -> Se3 {
    Se3::new(So3::exp(&Vector3::new(0.4, -0.7, 1.9)), Vector3::new(2.0, -1.0, 0.5))
}

#[test]
fn a_layout_is_found_again_with_and_without_up() {
    for up in [Some(Direction::Z), None] {
        let map = table(&CLASSES, up);
        let (marks, local_up) = local_objects(&map, &any_other_pose(), 2);
        let found = Layout::new(marks, local_up, &map, false).align(|_| AGREES).unwrap().0;
        let error = found.known_from_local.between(&any_other_pose());
        assert!(error.log().norm() < 1e-6, "{up:?} {error:?}");
        assert_eq!(found.matches.len(), 6);
        assert!(found.matches.iter().all(|(local, known)| local.0 + 10 == known.0), "{:?}", found.matches);
    }
}

#[test]
fn what_looks_the_same_from_two_sides_is_nowhere() {
    let map = ring();
    let (marks, up) = local_objects(&map, &any_other_pose(), 0);
    assert!(Layout::new(marks, up, &map, false).align(|_| AGREES).is_none());
    // ids resolve the symmetry
    let (mut marks, up) = local_objects(&map, &any_other_pose(), 0);
    marks.iter_mut().for_each(|mark| mark.id.0 += 10);
    let found = Layout::new(marks, up, &map, true).align(|_| AGREES).unwrap().0;
    assert!(found.known_from_local.between(&any_other_pose()).log().norm() < 1e-6);
}

#[test]
fn a_place_is_one_where_boxes_agree_with_it() {
    let map = ring();
    let (marks, up) = local_objects(&map, &any_other_pose(), 0);
    let layout = Layout::new(marks, up, &map, false);
    let is_right =
        |aligned: &AlignedLayout| aligned.known_from_local.between(&any_other_pose()).log().norm() < 0.1;
    let missed = |missed: f64| Agreement { missed, ..AGREES };
    let found = layout.align(|aligned| if is_right(aligned) { AGREES } else { missed(-40.0) }).unwrap().0;
    assert!(is_right(&found), "{found:?}");
    let mismatched = |aligned: &AlignedLayout| Agreement {
        overlap: 0.3,
        ..missed(if is_right(aligned) { 0.0 } else { -40.0 })
    };
    assert!(layout.align(mismatched).is_none());
    // one missed object is not enough to exclude the other poses
    assert!(layout.align(|aligned| if is_right(aligned) { AGREES } else { missed(-1.6) }).is_none());
    // objects are missing at each pose
    assert!(layout.align(|aligned| missed(if is_right(aligned) { -25.0 } else { -40.0 })).is_none());
}

#[test]
fn too_few_objects_or_others_are_nowhere() {
    let map = table(&CLASSES, Some(Direction::Z));
    let (marks, up) = local_objects(&map, &any_other_pose(), 4);
    assert!(Layout::new(marks, up, &map, false).align(|_| AGREES).is_none());
    let (marks, up) = local_objects(&table(&["laptop"], map.up), &any_other_pose(), 0);
    assert!(Layout::new(marks, up, &map, false).align(|_| AGREES).is_none());
    assert!(Layout::new(vec![], up, &map, false).align(|_| AGREES).is_none());
    let (marks, up) = local_objects(&map, &any_other_pose(), 0);
    assert!(Layout::new(marks, up, &PriorMap::default(), false).align(|_| AGREES).is_none());
}

#[test]
fn tilt_is_known_better_than_heading() {
    let map = table(&CLASSES, Some(Direction::Z));
    let (marks, up) = local_objects(&map, &any_other_pose(), 0);
    let found = Layout::new(marks, up, &map, false).align(|_| AGREES).unwrap().0;
    let level = Se3::new(any_other_pose().rotation.inverse(), Vector3::zeros());
    let information = found.noise(&level).unwrap().information_matrix(6).unwrap();
    assert!(information[(0, 0)] > 2.0 * information[(2, 2)], "{information}");
}

#[test]
fn the_next_best_place_is_that_of_a_room_that_is_nearly_the_same_from_two_sides() {
    // five pairs under a half turn, and two objects whose partners have different classes
    let half = [[1.9, 0.2], [1.2, 1.1], [0.4, 1.7], [1.7, -0.8], [0.8, 0.5]];
    let classes = ["cup", "book", "bottle", "laptop", "cup"];
    let both = half.iter().zip(classes).flat_map(|([x, y], class)| [([*x, *y], class), ([-x, -y], class)]);
    let map = floor(both.chain([([0.9, -1.5], "laptop"), ([-0.9, 1.5], "book")]));
    let (marks, up) = local_objects(&map, &any_other_pose(), 0);
    let layout = Layout::new(marks, up, &map, false);
    let ranked = layout.ranked_poses();
    let half_turn = Se3::new(So3::exp(&Vector3::new(0.0, 0.0, std::f64::consts::PI)), Vector3::zeros());
    let [first, second] = [&ranked[0], &ranked[1]];
    assert!(first.1.between(&any_other_pose()).log().norm() < 1e-6, "{first:?}");
    assert!(second.1.between(&half_turn.compose(&any_other_pose())).log().norm() < 1e-6, "{second:?}");
    assert_eq!((first.2.len(), second.2.len()), (12, 10));
    // two more matches, and two marks without a match
    let gain = layout.gain(&first.1, &first.2[0]).unwrap();
    assert!(
        (first.0 - second.0 - 2.0 * (gain - CHANGED_SHARE.ln())).abs() < 2.0,
        "{} {gain}",
        first.0 - second.0
    );
}

#[test]
fn many_objects_of_one_class_are_found_again() {
    let map = floor(scattered(70).map(|place| (place, "bottle")));
    for without in [0, 50] {
        let (marks, up) = local_objects(&map, &any_other_pose(), without);
        let found = Layout::new(marks, up, &map, false).align(|_| AGREES).unwrap().0;
        assert!(found.known_from_local.between(&any_other_pose()).log().norm() < 1e-6, "{found:?}");
        assert_eq!(found.matches.len(), 70 - without);
    }
}

#[test]
fn what_has_no_class_may_be_anything() {
    let map = table(&CLASSES, Some(Direction::Z));
    let (mut marks, up) = local_objects(&map, &any_other_pose(), 0);
    marks.iter_mut().for_each(|mark| mark.classes = ClassFusion::default());
    let found = Layout::new(marks, up, &map, false).ranked_poses().remove(0);
    assert!(found.1.between(&any_other_pose()).log().norm() < 1e-6, "{found:?}");
    assert_eq!(found.2.len(), 8);
}

#[test]
fn one_pair_or_none_is_no_place() {
    let map = table(&CLASSES, Some(Direction::Z));
    for up in [map.up, None] {
        let map = PriorMap::new(up, map.objects.clone());
        let (marks, up) = local_objects(&map, &any_other_pose(), 0);
        let layout = Layout::new(marks, up, &map, false);
        assert!(layout.fit_pose(&[]).is_none() && layout.fit_pose(&layout.pairs[..1]).is_none());
    }
}

#[test]
fn matches_are_within_reach_of_the_position_that_is_reported_with_them() {
    // marks with larger errors than assumed, so that matches come and go
    let map = table(&["cup"], Some(Direction::Z));
    let mut compared = 0;
    for draw in 0..40 {
        let (mut marks, up) = local_objects(&map, &any_other_pose(), 0);
        for (mark, [x, y]) in marks.iter_mut().zip(scattered(8 * (draw + 1)).skip(8 * draw as usize)) {
            mark.centre += 9.0 * mark.sigma * Vector3::new(x / 8.0 - 0.5, y / 8.0 - 0.5, 0.0);
        }
        let layout = Layout::new(marks, up, &map, false);
        for (_, place, matches) in layout.ranked_poses() {
            compared += 1;
            assert!(matches.iter().all(|pair| layout.gain(&place, pair).is_some()));
        }
    }
    assert!(compared > 100, "{compared}");
}
