//! The graph of a model.
use super::lens::each_lens;
use super::{Image, ImagePoint, Model};
use crate::bundle::gauge::{fix_gauge, gauge_note};
use crate::graph_format::GraphRead;
use crate::text::words::{count, list};
use manifactor_geometry::{Coordinates, Intrinsics, Point3, UncalibratedModel, UncalibratedProjection};
use manifactor_graph::{Factor, Graph, Key, Values};
use std::collections::HashMap;

/// Keys of a model's variables.
pub(super) fn camera_key(id: u64) -> Key {
    Key::indexed("camera", id)
}
pub(super) fn image_key(id: u64) -> Key {
    Key::indexed("image", id)
}
pub(super) fn point_key(id: u64) -> Key {
    Key::indexed("point", id)
}

impl Model {
    /// Returns the graph of the model. If `anchor` is set, holds variables to fix the gauge.
    pub fn graph(&self, anchor: bool) -> GraphRead {
        let mut graph = Graph::new();
        let mut values = Values::new();
        let mut add_by_camera: HashMap<u64, AddProjection> = HashMap::new();
        for camera in &self.cameras {
            let key = camera_key(camera.id);
            each_lens!(camera.lens, lens => {
                values.insert(&key, Intrinsics(lens));
                add_by_camera.insert(camera.id, add_projection(&lens));
            });
            graph.fix_directions(key, camera.model.held());
        }
        for image in &self.images {
            values.insert(image_key(image.id), image.world_from_camera);
        }
        for point in &self.points {
            values.insert(point_key(point.id), Point3::new(point.position));
        }
        let mut seen: HashMap<u64, usize> = self.points.iter().map(|point| (point.id, 0)).collect();
        let mut unmatched = 0;
        for Image { id, camera, points, .. } in &self.images {
            let Some(add) = add_by_camera.get(camera) else { continue };
            let (image, camera) = (image_key(*id), camera_key(*camera));
            for ImagePoint { pixel, point } in points {
                let Some(point) = point else {
                    unmatched += 1;
                    continue;
                };
                *seen.entry(*point).or_default() += 1;
                add(&mut graph, [image.clone(), point_key(*point), camera.clone()], *pixel);
            }
        }
        let mut notes = vec![];
        let mut hold = |keys: Vec<Key>, why: &str| {
            if !keys.is_empty() {
                notes.push(format!("{why}: held {}", list(keys.iter())));
            }
            keys.into_iter().for_each(|key| graph.fix(key));
        };
        let has_points = |image: &&Image| image.points.iter().any(|point| point.point.is_some());
        let empty = self.images.iter().filter(|image| !has_points(image));
        hold(empty.map(|image| image_key(image.id)).collect(), "images without points in space");
        let used = |id: u64| self.images.iter().filter(has_points).any(|image| image.camera == id);
        let unused = self.cameras.iter().filter(|camera| !used(camera.id));
        hold(unused.map(|camera| camera_key(camera.id)).collect(), "cameras without such an image");
        let few = self.points.iter().filter(|point| seen.get(&point.id).is_none_or(|n| *n < 2));
        hold(few.map(|point| point_key(point.id)).collect(), "points with fewer than two image points");
        if unmatched > 0 {
            let points = count(unmatched, "image point");
            notes.push(format!("{points} without a point in space: not used"));
        }
        notes.push("principal points are held, as in COLMAP's bundle adjustment".to_owned());
        if anchor {
            let held = fix_gauge(&mut graph, &values);
            notes.extend(gauge_note(&held));
        }
        GraphRead { graph, values, notes }
    }
}

/// Adds the projection of a point into an image.
type AddProjection = fn(&mut Graph, [Key; 3], Coordinates<2>);

/// Returns the function for cameras of this type.
fn add_projection<M: UncalibratedModel>(_: &M) -> AddProjection
where
    UncalibratedProjection<M>: Factor,
{
    |graph, keys, pixel| {
        graph.add(keys, UncalibratedProjection::<M>::new(pixel));
    }
}
