//! Objects that are moved, between two runs or within one.
use crate::prior_map::{RelocalizationLog, begun, in_map, sequence, settings, warning_texts};
use manifactor_slam::estimate::Estimate;
use manifactor_slam::output::map_of;
use manifactor_slam::output::write_whole;
use manifactor_slam::report::VariantReport;
use manifactor_slam::run::{estimate, online};
use manifactor_slam::sequence::{ObjectId, Sequence, TrueObject};
use manifactor_slam::settings::RunSettings;
use manifactor_solve::Silent;
use nalgebra::Vector3;
use std::collections::BTreeSet;

/// A quarter of the objects: three of twelve.
const MOVED: &str = "source.scene.moved=0.25";

/// Returns the numbers of the true objects at these places.
fn objects_at(places: impl Iterator<Item = Vector3<f64>>, truth: &[TrueObject]) -> BTreeSet<ObjectId> {
    let distance =
        |place: &Vector3<f64>, object: &TrueObject| (object.world_from_object.translation - place).norm();
    let nearest = |place: Vector3<f64>| {
        let nearest = truth.iter().min_by(|a, b| distance(&place, a).total_cmp(&distance(&place, b)));
        nearest.filter(|object| distance(&place, object) < 0.1).map(|object| object.id)
    };
    places.filter_map(nearest).collect()
}

fn truth(sequence: &Sequence) -> Vec<TrueObject> {
    sequence.ground_truth.clone().unwrap().objects
}

#[test]
fn what_is_moved_between_two_runs_is_gone_and_added() {
    let (folder, given) = (tempfile::tempdir().unwrap(), "association.type=given");
    let first = settings(&[given]);
    let before = sequence(&first);
    let (made, _) = estimate("first", before.clone(), &first, &mut Silent).unwrap();
    let map = serde_json::to_string(&map_of(&made, &first).unwrap()).unwrap();
    write_whole(&folder.path().join("map.json"), map).unwrap();
    let start = sequence(&in_map(folder.path(), &[])).frames[0].world_from_camera;
    for association in [given, "association.type=likelihood"] {
        let settings = begun(folder.path(), &start, &[MOVED, association]);
        let second = sequence(&settings);
        let ids = |sequence: &Sequence| truth(sequence).iter().map(|o| o.id).collect::<BTreeSet<_>>();
        let (was, is) = (ids(&before), ids(&second));
        let (estimate, report) = estimate("second", second.clone(), &settings, &mut Silent).unwrap();
        let prior = warning_texts(&report);
        let gone: BTreeSet<_> = prior.gone.iter().copied().collect();
        let added = objects_at(prior.added.iter().filter_map(|id| place(&estimate, *id)), &truth(&second));
        let (left, new) = (was.difference(&is).copied().collect(), is.difference(&was).copied().collect());
        match association == given {
            true => assert_eq!((gone, added), (left, new)),
            // object 15 stands near the old place of 3 and is taken for it
            false => assert!(gone.len() >= 2 && gone.is_subset(&left) && added.is_subset(&new), "{prior:?}"),
        }
        assert_eq!(report.gone, prior.gone);
    }
}

fn place(estimate: &Estimate, id: ObjectId) -> Option<Vector3<f64>> {
    let all = estimate.landmarks();
    all.iter().find(|landmark| landmark.object.id == id).map(|landmark| landmark.quadric.centroid())
}

/// Two turns around the table; objects are moved after the first.
fn twice(more: &[&str]) -> RunSettings {
    let twice = ["source.trajectory.sweep=720", "source.trajectory.frames=400", "source.scene.moved_at_s=20"];
    settings(&[&twice[..], more].concat())
}

#[test]
fn what_is_moved_within_a_stream_is_reported_and_not_in_its_map() {
    for association in ["association.type=given", "association.type=likelihood"] {
        let settings = twice(&[MOVED, association]);
        let all = sequence(&settings);
        let truth = truth(&all);
        let moved: Vec<_> = truth.iter().filter(|object| object.id.0 > 12).collect();
        let old = truth
            .iter()
            .filter(|was| was.id.0 <= 12 && moved.iter().any(|is| is.half_extents == was.half_extents));
        let old: BTreeSet<_> = old.map(|object| object.id).collect();
        assert_eq!((truth.len(), old.len()), (15, 3));
        let is_right = |(estimate, report): (Estimate, VariantReport)| {
            let gone = report.gone.iter().filter_map(|id| place(&estimate, *id));
            assert_eq!(objects_at(gone, &truth), old, "{association} {:?}", report.gone);
            let map = map_of(&estimate, &settings).unwrap();
            let left = objects_at(map.objects.iter().map(|object| object.quadric.centroid()), &truth);
            assert!(left.is_disjoint(&old) && left.len() >= 11, "{association} {left:?}");
        };
        is_right(online("stream", all.clone().into(), &settings, &mut RelocalizationLog::default()).unwrap());
        is_right(estimate("batch", all, &settings, &mut Silent).unwrap());
    }
}

#[test]
fn what_stays_is_not_reported() {
    // nor are objects gone whose boxes are held out
    for more in [&[][..], &["evaluation.holdout.last=0.3"]] {
        let settings = twice(more);
        let (_, report) = estimate("still", sequence(&settings), &settings, &mut Silent).unwrap();
        assert!(report.gone.is_empty(), "{:?}", report.gone);
    }
}
