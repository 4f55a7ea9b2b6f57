//! Variables to hold so that the position, orientation and scale of a reconstruction from images are fixed.
use crate::pose_graph::anchor::ConnectedSets;
use manifactor_geometry::{BalCamera, Se3};
use manifactor_graph::{Fixed, Graph, Key, Manifold, Values};

/// Holds, in each connected part, the pose of the first camera and one direction of the camera farthest from
/// it: the local axis along which that camera would move most if the scale changed.
pub(super) fn fix_gauge(graph: &mut Graph, values: &Values) -> Vec<Key> {
    let mut parts = ConnectedSets::connected(graph, values);
    let is_free = |key: &Key| graph.fixed().get(key) != Some(&Fixed::Whole(true));
    let mut cameras: Vec<(usize, &Key, &BalCamera)> = vec![];
    for (key, camera) in values.all::<BalCamera>().filter(|(key, _)| is_free(key)) {
        cameras.extend(values.position(key.as_str()).map(|i| (parts.root(i), key, camera)));
    }
    cameras.sort_by_key(|(part, ..)| *part);
    let mut held = vec![];
    for part in cameras.chunk_by(|a, b| a.0 == b.0) {
        let [(_, first, origin), others @ ..] = part else { continue };
        graph.fix_directions(*first, Se3::TANGENT);
        held.push((*first).clone());
        let away = |camera: &BalCamera| {
            let camera = &camera.world_from_camera;
            camera.rotation.inverse().act(&(camera.translation - origin.world_from_camera.translation))
        };
        let farthest = others.iter().max_by(|a, b| away(a.2).norm().total_cmp(&away(b.2).norm()));
        let Some((_, key, camera)) = farthest.filter(|(.., camera)| away(camera).norm() > 0.0) else {
            continue;
        };
        let axis = ["x", "y", "z"].into_iter().nth(away(camera).iamax());
        graph.fix_directions(*key, axis.as_slice());
        held.push((*key).clone());
    }
    held
}
