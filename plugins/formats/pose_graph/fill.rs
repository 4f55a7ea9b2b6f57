//! Values for vertices that only edges name: along a spanning tree, breadth first.
use super::record::{Measurement, Vertex, VertexType};
use manifactor_geometry::{Point2, Point3, Se2, Se3};
use manifactor_graph::Manifold;
use nalgebra::{Vector2, Vector3, Vector6};
use std::collections::{BTreeMap, HashMap, VecDeque};

/// What one vertex says of another.
pub(crate) struct Link {
    pub(crate) from: u64,
    pub(crate) to: u64,
    pub(crate) measurement: Measurement,
}

/// The vertices in `missing` from those that are known, nearest first, edges in the file's order. A
/// part of the graph where nothing is known starts with its first pose at the identity.
pub(crate) fn fill(
    known: &[(u64, Vertex)],
    missing: &BTreeMap<u64, VertexType>,
    links: &[Link],
) -> BTreeMap<u64, Vertex> {
    let mut around: HashMap<u64, Vec<&Link>> = HashMap::new();
    if !missing.is_empty() {
        for link in links {
            around.entry(link.from).or_default().push(link);
            around.entry(link.to).or_default().push(link);
        }
    }
    let mut reached: HashMap<u64, Vertex> = known.iter().copied().collect();
    let mut queue: VecDeque<u64> = known.iter().map(|(id, _)| *id).collect();
    let (poses, points): (Vec<_>, Vec<_>) = missing.iter().partition(|(_, t)| t.is_pose());
    let mut filled = BTreeMap::new();
    for (root, vertex_type) in poses.into_iter().chain(points) {
        loop {
            while let Some(id) = queue.pop_front() {
                let Some(here) = reached.get(&id).copied() else { continue };
                for link in around.get(&id).into_iter().flatten() {
                    let other = if link.from == id { link.to } else { link.from };
                    if let (false, Some(there)) = (reached.contains_key(&other), across(link, id, &here)) {
                        reached.insert(other, there);
                        filled.insert(other, there);
                        queue.push_back(other);
                    }
                }
            }
            if reached.contains_key(root) {
                break;
            }
            reached.insert(*root, origin(*vertex_type));
            filled.insert(*root, origin(*vertex_type));
            queue.push_back(*root);
        }
    }
    filled
}

/// The vertex at the other end of a link; `None` where it does not follow, as a pose from a point.
fn across(link: &Link, id: u64, here: &Vertex) -> Option<Vertex> {
    let forward = link.from == id;
    Some(match (here, link.measurement) {
        (Vertex::Se2(x), Measurement::Se2(z)) => {
            Vertex::Se2(x.compose(&if forward { z } else { z.inverse() }))
        }
        (Vertex::Se3(x), Measurement::Se3(z)) => {
            // retract normalises: rounding does not add up along the tree
            Vertex::Se3(x.compose(&if forward { z } else { z.inverse() }).retract(&Vector6::zeros()))
        }
        (Vertex::Se2(x), Measurement::Point2(z)) => Vertex::Point2(Point2::new(x.act(&z))),
        (Vertex::Se3(x), Measurement::Point3 { position, .. }) => {
            Vertex::Point3(Point3::new(x.act(&position)))
        }
        _ => return None,
    })
}

fn origin(vertex_type: VertexType) -> Vertex {
    match vertex_type {
        VertexType::Se2 => Vertex::Se2(Se2::identity()),
        VertexType::Se3 => Vertex::Se3(Se3::identity()),
        VertexType::Point2 => Vertex::Point2(Point2::new(Vector2::zeros())),
        VertexType::Point3 => Vertex::Point3(Point3::new(Vector3::zeros())),
    }
}
