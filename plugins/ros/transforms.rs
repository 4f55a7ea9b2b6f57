//! Transforms between frames, with interpolation in time.
use crate::messages::TransformList;
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use std::collections::BTreeMap;

/// Largest number of frames between a frame and the root.
const MAX_CHAIN: usize = 64;

/// Transforms of a recording: a tree of frames.
#[derive(Debug, Default)]
pub struct Transforms {
    /// By the name of the frame.
    frames: BTreeMap<String, Link>,
}

/// Pose of a frame in its parent.
#[derive(Debug)]
struct Link {
    parent: String,
    /// Sorted by time; a single one if the pose is constant.
    poses: Vec<StampedPose>,
    is_constant: bool,
}

/// Reason why the pose of a frame in another is not known.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TransformError {
    /// No transform has this frame.
    #[error("no transform has the frame `{frame}`; there are {}", list(known))]
    Unknown {
        /// The frame.
        frame: String,
        /// All frames.
        known: Vec<String>,
    },
    /// The frames have different roots.
    #[error("no chain of transforms connects `{from}` (below `{from_root}`) and `{to}` (below `{to_root}`)")]
    NotConnected {
        /// A frame.
        from: String,
        /// Its root.
        from_root: String,
        /// The other frame.
        to: String,
        /// Its root.
        to_root: String,
    },
    /// A transform on the way is not known at this time.
    #[error(
        "the transform from `{parent}` to `{child}` is not known at {timestamp} s, only from {first} s to {last} s"
    )]
    Time {
        /// Parent frame.
        parent: String,
        /// Frame.
        child: String,
        /// Requested time. Unit: seconds.
        timestamp: f64,
        /// Time of the first transform. Unit: seconds.
        first: f64,
        /// Time of the last transform. Unit: seconds.
        last: f64,
    },
}

fn list(names: &[String]) -> String {
    let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    if names.is_empty() { "none".into() } else { names.join(", ") }
}

/// Returns the name without the leading slash that old releases had.
fn plain(name: &str) -> &str {
    name.strip_prefix('/').unwrap_or(name)
}

impl Transforms {
    /// Adds the transforms of a message. Returns the number of those without a rotation, which are left out.
    pub fn add(&mut self, message: &TransformList, is_constant: bool) -> usize {
        let mut faults = 0;
        for transform in &message.transforms {
            let Ok(pose) = transform.transform.to_se3() else {
                faults += 1;
                continue;
            };
            let (parent, child) = (plain(&transform.header.frame_id), plain(&transform.child_frame_id));
            let new = || Link { parent: parent.to_owned(), poses: vec![], is_constant };
            let link = self.frames.entry(child.to_owned()).or_insert_with(new);
            let stamped = StampedPose { timestamp: transform.header.stamp.seconds(), pose };
            if is_constant {
                link.poses = vec![stamped];
                continue;
            }
            let place = link.poses.partition_point(|before| before.timestamp < stamped.timestamp);
            if link.poses.get(place).is_none_or(|at| at.timestamp != stamped.timestamp) {
                link.poses.insert(place, stamped);
            }
        }
        faults
    }

    /// Returns the pose of `frame` in the frame `parent` at a time in seconds.
    ///
    /// # Errors
    /// If a frame is unknown, the two are not connected, or a transform between them is not known at this time.
    pub fn pose(&self, parent: &str, frame: &str, timestamp: f64) -> Result<Se3, TransformError> {
        let [parent, frame] = [plain(parent), plain(frame)];
        if parent == frame {
            return Ok(Se3::identity());
        }
        let [up, down] = [self.chain(parent)?, self.chain(frame)?];
        let Some(common) = up.iter().find(|name| down.contains(name)) else {
            let root = |chain: &[&str]| chain.last().copied().unwrap_or_default().to_owned();
            return Err(TransformError::NotConnected {
                from: parent.to_owned(),
                from_root: root(&up),
                to: frame.to_owned(),
                to_root: root(&down),
            });
        };
        let from_common = |chain: &[&str]| {
            let links = chain.iter().take_while(|name| *name != common);
            links
                .map(|name| self.at(name, timestamp))
                .try_fold(Se3::identity(), |below, pose| Ok(pose?.compose(&below)))
        };
        Ok(from_common(&up)?.inverse().compose(&from_common(&down)?))
    }

    /// Returns the times of all transforms between two frames that change with time, sorted. Unit: seconds.
    pub fn times(&self, parent: &str, frame: &str) -> Result<Vec<f64>, TransformError> {
        let [up, down] = [self.chain(plain(parent))?, self.chain(plain(frame))?];
        let is_between = |name: &&&str| up.contains(name) != down.contains(name);
        let between = up.iter().chain(&down).filter(is_between).filter_map(|name| self.frames.get(*name));
        let moving = between.filter(|link| !link.is_constant);
        let mut times: Vec<f64> =
            moving.flat_map(|link| link.poses.iter().map(|pose| pose.timestamp)).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        Ok(times)
    }

    /// Returns the frame and its ancestors.
    fn chain<'a>(&'a self, frame: &'a str) -> Result<Vec<&'a str>, TransformError> {
        let mut chain = vec![frame];
        while let Some(link) = chain.last().and_then(|name| self.frames.get(*name)) {
            if chain.contains(&link.parent.as_str()) || chain.len() == MAX_CHAIN {
                break;
            }
            chain.push(&link.parent);
        }
        let is_parent = || self.frames.values().any(|link| link.parent == frame);
        if chain.len() == 1 && !is_parent() {
            let mut known: Vec<String> = self.frames.keys().cloned().collect();
            known.extend(self.frames.values().map(|link| link.parent.clone()));
            known.sort();
            known.dedup();
            return Err(TransformError::Unknown { frame: frame.to_owned(), known });
        }
        Ok(chain)
    }

    /// Returns the pose of a frame in its parent.
    fn at(&self, frame: &str, timestamp: f64) -> Result<Se3, TransformError> {
        let Some(Link { parent, poses, is_constant }) = self.frames.get(frame) else {
            return Ok(Se3::identity());
        };
        let after = poses.partition_point(|pose| pose.timestamp < timestamp);
        match (after.checked_sub(1).and_then(|before| poses.get(before)), poses.get(after)) {
            (_, Some(pose)) | (Some(pose), _) if *is_constant => Ok(pose.pose),
            (_, Some(pose)) if pose.timestamp == timestamp => Ok(pose.pose),
            (Some(from), Some(to)) => Ok(from.interpolate(to, timestamp)),
            (from, to) => {
                let ends = [poses.first(), poses.last()]
                    .map(|pose| pose.or(from).or(to).map_or(0.0, |p| p.timestamp));
                Err(TransformError::Time {
                    parent: parent.clone(),
                    child: frame.to_owned(),
                    timestamp,
                    first: ends[0],
                    last: ends[1],
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_graph::Manifold;
    use nalgebra::Vector6;
    use serde_json::json;

    fn message(parent: &str, child: &str, sec: i64, pose: &Se3) -> TransformList {
        let [x, y, z, w] = pose.rotation.quaternion_xyzw();
        let p = pose.translation;
        serde_json::from_value(json!({"transforms": [{
            "header": {"stamp": {"sec": sec, "nanosec": 0}, "frame_id": parent},
            "child_frame_id": child,
            "transform": {"translation": {"x": p.x, "y": p.y, "z": p.z}, "rotation": {"x": x, "y": y, "z": z, "w": w}},
        }]}))
        .unwrap()
    }

    fn pose(t: f64) -> Se3 {
        Se3::exp(&(t * Vector6::new(0.1, 0.0, 0.3, 1.0, 0.2, 0.0)))
    }

    fn tree() -> Transforms {
        let mut tree = Transforms::default();
        for sec in [2, 0, 1] {
            tree.add(&message("odom", "base_link", sec, &pose(sec as f64)), false);
        }
        tree.add(&message("/base_link", "mast", 0, &pose(3.0)), true);
        tree.add(&message("mast", "camera", 0, &pose(-5.0)), true);
        tree.add(&message("base_link", "lidar", 0, &pose(7.0)), true);
        tree.add(&message("marker", "tag", 0, &pose(7.0)), true);
        tree
    }

    #[test]
    fn chains_are_followed_and_moving_links_interpolated() {
        let close =
            |found: Se3, expected: Se3| assert!(found.local(&expected).norm() < 1e-12, "{found} {expected}");
        let tree = tree();
        close(tree.pose("base_link", "camera", 99.0).unwrap(), pose(-2.0));
        close(tree.pose("camera", "lidar", 99.0).unwrap(), pose(9.0));
        close(tree.pose("odom", "camera", 1.25).unwrap(), pose(-0.75));
        close(tree.pose("odom", "odom", 1.25).unwrap(), Se3::identity());
        assert_eq!(tree.times("odom", "camera").unwrap(), [0.0, 1.0, 2.0]);
        assert!(tree.times("camera", "lidar").unwrap().is_empty());
    }

    #[test]
    fn what_is_missing_is_named() {
        let tree = tree();
        let error = |parent: &str, frame: &str| tree.pose(parent, frame, 2.5).unwrap_err().to_string();
        assert!(error("base_link", "cam").contains("`cam`; there are `base_link`, `camera`"));
        assert!(error("odom", "tag").contains("(below `odom`) and `tag` (below `marker`)"));
        assert!(error("odom", "camera").contains("not known at 2.5 s, only from 0 s to 2 s"));
        let mut circle = Transforms::default();
        circle.add(&message("a", "b", 0, &pose(1.0)), true);
        circle.add(&message("b", "a", 0, &pose(1.0)), true);
        assert!(circle.pose("a", "c", 0.0).is_err() && circle.pose("a", "b", 0.0).is_ok());
    }
}
