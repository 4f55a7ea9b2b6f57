//! Objects that are moved during the simulation.
use super::SimulationError;
use super::scene::{SceneObject, SceneSettings};
use manifactor_geometry::{Se3, So3};
use manifactor_quadric::Box3;
use manifactor_recording::sequence::{ObjectId, TrueObject};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Objects and their moves.
pub(super) struct Scene {
    /// Objects before their moves.
    pub(super) objects: Vec<SceneObject>,
    /// Moved objects after their moves, by index.
    moved: BTreeMap<usize, SceneObject>,
    moved_at_s: f64,
}

impl Scene {
    /// Returns an object after its move, if it has been moved by this time.
    pub(super) fn moved_object(&self, object: usize, time: f64) -> Option<&SceneObject> {
        self.moved.get(&object).filter(|_| time >= self.moved_at_s)
    }

    /// Returns an object as it is at a time.
    pub(super) fn object_at(&self, object: usize, time: f64) -> &SceneObject {
        self.moved_object(object, time).unwrap_or(&self.objects[object])
    }

    /// Returns the true objects that exist between time 0 and `last`, sorted by number.
    pub(super) fn true_objects(self, last: f64) -> Vec<TrueObject> {
        let Self { objects, moved, moved_at_s } = self;
        let is_there = |i: &usize| moved_at_s > 0.0 || !moved.contains_key(i);
        let stay = objects.into_iter().enumerate().filter(|(i, _)| is_there(i)).map(|(_, object)| object);
        let mut truth: Vec<TrueObject> = stay.map(|object| object.truth).collect();
        truth.extend(moved.into_values().filter(|_| moved_at_s <= last).map(|object| object.truth));
        truth.sort_by_key(|object| object.id);
        truth
    }
}

impl SceneSettings {
    /// Returns the objects and their moves. Equal settings give equal scenes.
    pub(super) fn scene(&self) -> Result<Scene, SimulationError> {
        let mut rng = Pcg64::seed_from_u64(self.seed);
        let objects = self.objects(&mut rng)?;
        let mut rng = Pcg64::from_rng(&mut rng);
        let mut placed: Vec<_> = objects.iter().map(footprint).collect();
        let (mut left, mut moved): (Vec<usize>, _) = ((0..objects.len()).collect(), BTreeMap::new());
        for id in objects.len()..objects.len() + (*self.moved * objects.len() as f64).round() as usize {
            let object = left.swap_remove(rng.random_range(0..left.len()));
            let elsewhere = self.move_object(&objects[object], id, &placed, &mut rng)?;
            placed[object] = footprint(&elsewhere);
            moved.insert(object, elsewhere);
        }
        Ok(Scene { objects, moved, moved_at_s: *self.moved_at_s })
    }

    /// Returns the object with a new number, at a place apart from all objects and from its own place, turned
    /// about the vertical.
    fn move_object(
        &self,
        object: &SceneObject,
        id: usize,
        placed: &[(Vector3<f64>, f64)],
        rng: &mut Pcg64,
    ) -> Result<SceneObject, SimulationError> {
        let no_room = SimulationError::NoRoom { object: id };
        let turn = So3::exp(&(Vector3::z() * (rng.random::<f64>() * TAU)));
        let (_, radius) = footprint(object);
        let place = self.free_place(radius, placed, rng).ok_or_else(|| no_room.clone())?;
        let before = &object.truth.world_from_object;
        let translation = place + Vector3::z() * before.translation.z;
        let world_from_object = Se3::new(turn.compose(&before.rotation), translation);
        let around = Box3::enclosing(object.solid.corners().map(|corner| world_from_object.act(corner)));
        let mut moved = object.clone();
        moved.truth.id = ObjectId(id as u32 + 1);
        moved.truth.world_from_object = world_from_object;
        moved.truth.bounding_box = around.ok_or(no_room)?;
        Ok(moved)
    }
}

/// Returns the circle around an object seen from above: centre and radius.
fn footprint(object: &SceneObject) -> (Vector3<f64>, f64) {
    let Se3 { rotation, translation, .. } = &object.truth.world_from_object;
    let reach = object.solid.corners().map(|corner| rotation.act(corner).xy().norm());
    (Vector3::new(translation.x, translation.y, 0.0), reach.fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::super::SimulatedSource;
    use super::*;
    use manifactor_graph::checked::{NotNegative, Share};
    use manifactor_recording::sequence::{Detection, Sequence};

    /// Returns settings that move a third of the objects after 10 of 20 seconds.
    fn moving() -> SimulatedSource {
        let mut settings = SimulatedSource::default();
        settings.scene.area = [NotNegative::literal(3.0), NotNegative::literal(2.4)];
        settings.scene.moved = Share::literal(1.0 / 3.0);
        settings.scene.moved_at_s = NotNegative::literal(10.0);
        settings.detector.depth_error = Some(manifactor_graph::checked::Positive::literal(0.02));
        settings.detector.noise_lasts_s = NotNegative::literal(0.5);
        settings
    }

    fn still(settings: &SimulatedSource) -> SimulatedSource {
        let mut settings = settings.clone();
        settings.scene.moved = Share::literal(0.0);
        settings
    }

    fn truth(sequence: &Sequence) -> Vec<TrueObject> {
        sequence.ground_truth.clone().unwrap().objects
    }

    #[test]
    fn a_share_is_put_where_nothing_is() {
        for seed in 1..=20 {
            let settings = SceneSettings {
                seed,
                moved: Share::literal(0.4),
                area: [NotNegative::literal(3.0), NotNegative::literal(2.4)],
                ..SceneSettings::default()
            };
            let scene = settings.scene().unwrap();
            assert_eq!(scene.moved.len(), 6);
            let apart = |a: &SceneObject, b: &SceneObject| {
                let [(a, r), (b, s)] = [a, b].map(footprint);
                (a - b).norm() - r - s > *settings.gap - 1e-9
            };
            let all: Vec<_> = (0..15).map(|i| scene.object_at(i, 0.0)).collect();
            for (i, object) in all.iter().enumerate() {
                assert!(all[..i].iter().all(|other| apart(object, other)), "{seed}");
                let (place, _) = footprint(object);
                assert!(place.x.abs() <= 1.5 && place.y.abs() <= 1.2);
            }
            for (i, moved) in &scene.moved {
                assert!(apart(moved, &scene.objects[*i]));
                let before = &scene.objects[*i];
                assert_eq!((&moved.truth.class, &moved.solid), (&before.truth.class, &before.solid));
                let [up, was] = [moved, before].map(|o| o.truth.world_from_object.rotation.inverse());
                assert!((up.act(&Vector3::z()) - was.act(&Vector3::z())).norm() < 1e-9);
                assert!((moved.truth.bounding_box.min.z - *settings.height).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn no_box_changes_but_those_of_what_has_moved() {
        let settings = moving();
        let [moved, still] = [settings.clone(), still(&settings)].map(|s| s.simulate().unwrap());
        assert_eq!(moved.frames, still.frames);
        let (was, is) = (truth(&still), truth(&moved));
        assert_eq!((&is[..15], is.len()), (&was[..], 20));
        let before = |d: &&Detection| d.frame < 100;
        let of = |sequence: &Sequence, which: &dyn Fn(&&Detection) -> bool| -> Vec<Detection> {
            sequence.detections.iter().filter(which).cloned().collect()
        };
        assert_eq!(of(&moved, &before), of(&still, &before));
        let stays = |d: &&Detection| {
            let object = was.iter().find(|object| Some(object.id) == d.object);
            object
                .is_some_and(|object| !is[15..].iter().any(|moved| moved.half_extents == object.half_extents))
        };
        assert_eq!(of(&moved, &stays), of(&still, &stays));
        // a moved object appears only under its new number
        let after = of(&moved, &|d| d.frame >= 100 && !stays(d));
        assert!(after.len() > 300 && after.iter().all(|d| d.object.is_some_and(|id| id.0 > 15)));
        assert_eq!(moved.detections, settings.simulate().unwrap().detections);
    }

    #[test]
    fn the_truth_is_what_is_there_in_some_image() {
        let ids = |at: f64| {
            let mut settings = moving();
            settings.scene.moved_at_s = NotNegative::new(at).unwrap();
            truth(&settings.simulate().unwrap()).iter().map(|object| object.id.0).collect::<Vec<_>>()
        };
        let [first, middle, never] = [0.0, 19.9, 20.0].map(ids);
        assert_eq!((first.len(), middle.len(), never), (15, 20, (1..=15).collect()));
        assert_eq!(first.iter().filter(|id| **id > 15).count(), 5);
    }

    #[test]
    fn what_is_as_usual_is_not_written() {
        let text = serde_json::to_string(&SimulatedSource::default()).unwrap();
        assert!(!text.contains("moved"), "{text}");
        let text = serde_json::to_string(&moving()).unwrap();
        assert_eq!(serde_json::from_str::<SimulatedSource>(&text).unwrap(), moving());
    }
}
