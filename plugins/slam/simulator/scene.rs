//! Scenes of objects on a plane.
use super::SimulationError;
use super::catalogue::{KINDS, kind};
use super::solid::Solid;
use manifactor_geometry::{Se3, So3};
use manifactor_graph::checked::{Count, Finite, NotNegative, Share};
use manifactor_quadric::Box3;
use manifactor_recording::sequence::{ObjectId, TrueObject};
use nalgebra::Vector3;
use rand::RngExt;
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::ops::Deref;

/// Objects of the scene: random classes at random places of a rectangle, apart from each other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SceneSettings {
    /// Seed of the scene. It also changes the noise.
    pub seed: u64,
    /// Number of objects. At most 10 000, because each is placed apart from all others.
    pub objects: Count<0, 10_000>,
    /// Classes of the objects, in turn. Default: all known classes.
    pub classes: Vec<String>,
    /// Extents of the rectangle; its centre is the origin. Unit: metres.
    pub area: [NotNegative; 2],
    /// Height of the plane that objects rest on. Unit: metres.
    pub height: Finite,
    /// Smallest distance between the outlines of two objects, seen from above. Unit: metres.
    pub gap: NotNegative,
    /// Largest random change of an object's size, as a share of the size.
    pub size_variation: Share,
    /// Share of the objects that do not stand or lie as usual.
    pub tilted: Share,
    /// Smallest and largest tilt of these objects. Unit: degrees.
    pub tilt: [Finite; 2],
    /// Share of the objects that are moved, one after another: to a free place apart from their own, and
    /// turned about the vertical. A moved object gets a new number, because it is a new object for a static
    /// map. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub moved: Share,
    /// Time of the moves. The ground truth contains every place that an object has at the time of any image.
    /// Default: 0, before the first image. Unit: seconds.
    #[serde(skip_serializing_if = "is_zero")]
    pub moved_at_s: NotNegative,
}

/// Returns whether a setting is zero, the default, which is not written.
fn is_zero(number: &impl Deref<Target = f64>) -> bool {
    **number == 0.0
}

impl Default for SceneSettings {
    fn default() -> Self {
        Self {
            seed: 1,
            objects: Count::literal(15),
            classes: vec![],
            area: [NotNegative::literal(2.4), NotNegative::literal(1.6)],
            height: Finite::literal(0.0),
            gap: NotNegative::literal(0.05),
            size_variation: Share::literal(0.15),
            tilted: Share::literal(0.0),
            tilt: [Finite::literal(20.0), Finite::literal(90.0)],
            moved: Share::literal(0.0),
            moved_at_s: NotNegative::literal(0.0),
        }
    }
}

/// An object of a scene.
#[derive(Debug, Clone)]
pub(crate) struct SceneObject {
    /// Ground truth of the object.
    pub truth: TrueObject,
    /// Shape, in the frame of the truth's `world_from_object`.
    pub solid: Solid,
}

impl SceneSettings {
    /// Returns the objects. Equal settings give equal objects.
    ///
    /// # Errors
    /// An unknown class, or a rectangle that is too small.
    pub(crate) fn objects(&self, rng: &mut Pcg64) -> Result<Vec<SceneObject>, SimulationError> {
        let classes: Vec<&str> = match self.classes.is_empty() {
            true => KINDS.iter().map(|kind| kind.class).collect(),
            false => self.classes.iter().map(String::as_str).collect(),
        };
        // each turn contains all classes in random order: a small scene has many classes, and no class is
        // missing for long
        let mut order: Vec<&str> = vec![];
        let mut placed: Vec<(Vector3<f64>, f64)> = vec![];
        let mut objects = vec![];
        for id in 0..*self.objects {
            if order.is_empty() {
                order.clone_from(&classes);
            }
            let class = order.swap_remove(rng.random_range(0..order.len()));
            objects.push(self.object(id, class, &mut placed, rng)?);
        }
        Ok(objects)
    }

    fn object(
        &self,
        id: usize,
        class: &str,
        placed: &mut Vec<(Vector3<f64>, f64)>,
        rng: &mut Pcg64,
    ) -> Result<SceneObject, SimulationError> {
        let kind = kind(class).ok_or_else(|| SimulationError::UnknownClass {
            class: class.to_owned(),
            known: KINDS.iter().map(|kind| kind.class).collect(),
        })?;
        let vary = self.size_variation;
        let solid = (kind.solid)().scaled(1.0 + *vary * rng.random_range(-1.0..=1.0));
        let tilted = rng.random_bool(*self.tilted);
        let [least, most] = self.tilt;
        let tilt = if tilted { (*least + (*most - *least) * rng.random::<f64>()).to_radians() } else { 0.0 };
        let (yaw, towards) = (rng.random::<f64>() * TAU, rng.random::<f64>() * TAU);
        let lean = So3::exp(&(Vector3::new(towards.cos(), towards.sin(), 0.0) * tilt));
        let rotation = lean.compose(&So3::exp(&Vector3::new(0.0, 0.0, yaw)));
        let turned: Vec<_> = solid.corners().map(|corner| rotation.act(corner)).collect();
        let (lowest, radius) =
            turned.iter().fold((0.0_f64, 0.0_f64), |(z, r), p| (z.min(p.z), r.max(p.xy().norm())));
        let place = self.free_place(radius, placed, rng).ok_or(SimulationError::NoRoom { object: id })?;
        let translation = place + Vector3::z() * (*self.height - lowest);
        placed.push((place, radius));
        let world_from_object = Se3::new(rotation, translation);
        let around = Box3::enclosing(turned.iter().map(|corner| corner + translation));
        let truth = TrueObject {
            // 0 is "not associated" in files of detections
            id: ObjectId(id as u32 + 1),
            class: class.to_owned(),
            world_from_object,
            half_extents: solid.half_extents(),
            bounding_box: around.ok_or(SimulationError::NoRoom { object: id })?,
        };
        Ok(SceneObject { truth, solid })
    }

    /// Returns a free place for an object of this radius, apart from the placed objects.
    pub(super) fn free_place(
        &self,
        radius: f64,
        placed: &[(Vector3<f64>, f64)],
        rng: &mut Pcg64,
    ) -> Option<Vector3<f64>> {
        const MAX_PLACEMENT_TRIES: usize = 2000;
        let [x, y] = self.area.map(|extent| *extent / 2.0);
        let anywhere =
            |rng: &mut Pcg64| Vector3::new(rng.random_range(-x..=x), rng.random_range(-y..=y), 0.0);
        let free = |p: &Vector3<f64>| placed.iter().all(|(q, r)| (p - q).norm() >= radius + r + *self.gap);
        (0..MAX_PLACEMENT_TRIES).map(|_| anywhere(rng)).find(free)
    }
}
