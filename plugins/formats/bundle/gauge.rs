//! Variables to hold so that the position, orientation and scale of a reconstruction from images are fixed.
use crate::pose_graph::anchor::ConnectedSets;
use crate::text::words::list;
use manifactor_geometry::{BalCamera, Point3, Se3};
use manifactor_graph::{Fixed, Graph, Key, Manifold, Values, Variable};

/// Holds, in each connected part, the pose of the first camera and one direction of the camera farthest from
/// it: the local axis along which that camera would move most if the scale changed. Returns the cameras. Shared
/// intrinsics do not connect parts.
pub(crate) fn fix_gauge(graph: &mut Graph, values: &Values) -> Vec<Key> {
    let is_located = |key: &Key| {
        let variable = values.variable(key.as_str());
        variable.is_some_and(|x| pose_of(x).is_some() || x.erased().as_any().is::<Point3>())
    };
    let mut parts = ConnectedSets::connected(graph, values, is_located);
    let is_free = |key: &Key| graph.fixed().get(key) != Some(&Fixed::Whole(true));
    let mut cameras: Vec<(usize, &Key, &Se3)> = vec![];
    for (i, (key, variable)) in values.iter().enumerate() {
        if let Some(pose) = pose_of(variable).filter(|_| is_free(key)) {
            cameras.push((parts.root(i), key, pose));
        }
    }
    cameras.sort_by_key(|(part, ..)| *part);
    let mut held = vec![];
    for part in cameras.chunk_by(|a, b| a.0 == b.0) {
        let [(_, first, origin), others @ ..] = part else { continue };
        graph.fix_directions(*first, Se3::TANGENT);
        held.push((*first).clone());
        let away = |camera: &Se3| camera.rotation.inverse().act(&(camera.translation - origin.translation));
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

/// Returns a note about the cameras that [`fix_gauge`] holds, if there are any.
pub(crate) fn gauge_note(held: &[Key]) -> Option<String> {
    let keys = list(held.iter());
    let note = || format!("nothing fixes the gauge: held pose and scale by {keys} (--no-anchor does not)");
    (!held.is_empty()).then(note)
}

/// Returns the pose of a camera.
fn pose_of(variable: &dyn Variable) -> Option<&Se3> {
    let any = variable.erased().as_any();
    any.downcast_ref().or_else(|| any.downcast_ref().map(|camera: &BalCamera| &camera.world_from_camera))
}
