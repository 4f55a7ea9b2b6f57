//! Landmarks from tracks of points.
use manifactor_geometry::{Camera, CameraModel, Se3};
use nalgebra::{Matrix3, Vector2, Vector3};
use std::collections::BTreeMap;

/// Minimum number of keyframes that see a landmark.
const MIN_POINTS: usize = 3;
/// Minimum angle between two rays to a landmark, in radians.
const MIN_PARALLAX: f64 = 0.02;
/// Largest median error of a triangulated landmark, in standard deviations of a point.
const MAX_ERROR: f64 = 3.0;

/// The points of a landmark in keyframes.
#[derive(Debug, Clone, Default)]
pub(super) struct Track {
    /// Keyframe and pixel, in the order of keyframes.
    points: Vec<(usize, Vector2<f64>)>,
    /// Whether it is a landmark of the graph.
    pub is_mapped: bool,
}

impl Track {
    /// Adds the pixel in a keyframe.
    pub(super) fn push(&mut self, keyframe: usize, pixel: Vector2<f64>) {
        self.points.push((keyframe, pixel));
    }
    /// Returns the last keyframe.
    pub(super) fn last(&self) -> Option<usize> {
        self.points.last().map(|(keyframe, _)| *keyframe)
    }
    /// Returns the pixel in a keyframe, if that is the last one.
    pub(super) fn pixel_in(&self, keyframe: usize) -> Option<Vector2<f64>> {
        self.points.last().filter(|point| point.0 == keyframe).map(|point| point.1)
    }
    /// Returns keyframes and pixels, in the order of keyframes.
    pub(super) fn points(&self) -> &[(usize, Vector2<f64>)] {
        &self.points
    }
}

/// Returns the point that is closest to all rays. `None` if there are too few rays, if they are almost parallel,
/// or if the point does not fit them.
pub(super) fn triangulate(
    points: &[(usize, Vector2<f64>)],
    poses: &BTreeMap<usize, Se3>,
    camera: &Camera,
    sigma: f64,
) -> Option<Vector3<f64>> {
    if points.len() < MIN_POINTS {
        return None;
    }
    let rays: Vec<_> = points
        .iter()
        .filter_map(|(keyframe, pixel)| {
            let pose = poses.get(keyframe)?;
            Some((pose, pixel, pose.rotation.act(&camera.ray(*pixel)).normalize()))
        })
        .collect();
    let (first, last) = (rays.first()?, rays.last()?);
    let parallax = rays.iter().map(|ray| ray.2.cross(&first.2).norm().max(ray.2.cross(&last.2).norm()));
    if parallax.fold(0.0, f64::max) < MIN_PARALLAX {
        return None;
    }
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (pose, _, ray) in &rays {
        let across = Matrix3::identity() - ray * ray.transpose();
        normal += across;
        right += across * pose.translation;
    }
    let point = normal.cholesky()?.solve(&right);
    let mut errors = vec![];
    for (pose, pixel, _) in &rays {
        let seen = pose.inverse_act(&point);
        if !camera.sees(&seen) {
            return None;
        }
        errors.push((camera.project(&seen) - **pixel).norm());
    }
    errors.sort_by(f64::total_cmp);
    (errors[errors.len() / 2] <= MAX_ERROR * sigma).then_some(point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::So3;

    #[test]
    fn a_point_is_found_from_its_pixels() {
        let camera = Camera::new([450.0, 450.0, 320.0, 240.0], 640, 480).unwrap();
        let point = Vector3::new(0.3, -0.2, 4.0);
        let pose = |k: usize| {
            Se3::new(So3::exp(&Vector3::new(0.0, 0.01 * k as f64, 0.0)), Vector3::x() * (0.1 * k as f64))
        };
        let poses: BTreeMap<usize, Se3> = (0..5).map(|k| (k, pose(k))).collect();
        let pixel = |k: usize| (k, camera.project(&poses[&k].inverse_act(&point)));
        let points: Vec<_> = (0..5).map(pixel).collect();
        let found = triangulate(&points, &poses, &camera, 1.0).unwrap();
        assert!((found - point).norm() < 1e-9);
        assert_eq!(triangulate(&points[..2], &poses, &camera, 1.0), None, "too few");
        let still: BTreeMap<usize, Se3> = (0..5).map(|k| (k, pose(0))).collect();
        assert_eq!(triangulate(&points, &still, &camera, 1.0), None, "parallel rays");
    }
}
