//! Landmarks from tracks of points.
use manifactor_geometry::{Camera, CameraModel, Se3};
use nalgebra::{Matrix3, Vector2, Vector3};

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
/// or if the point does not fit them. `views` are poses of the camera, with the pixels there.
pub(super) fn triangulate(
    views: &[(Se3, Vector2<f64>)],
    camera: &Camera,
    sigma: f64,
) -> Option<Vector3<f64>> {
    if views.len() < MIN_POINTS {
        return None;
    }
    let ray = |(pose, pixel): &(Se3, Vector2<f64>)| pose.rotation.act(&camera.ray(*pixel)).normalize();
    let rays: Vec<Vector3<f64>> = views.iter().map(ray).collect();
    let (first, last) = (rays.first()?, rays.last()?);
    let parallax = rays.iter().map(|ray| ray.cross(first).norm().max(ray.cross(last).norm()));
    if parallax.fold(0.0, f64::max) < MIN_PARALLAX {
        return None;
    }
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for ((pose, _), ray) in views.iter().zip(&rays) {
        let across = Matrix3::identity() - ray * ray.transpose();
        normal += across;
        right += across * pose.translation;
    }
    let point = normal.cholesky()?.solve(&right);
    let mut errors = vec![];
    for (pose, pixel) in views {
        let seen = pose.inverse_act(&point);
        if !camera.sees(&seen) {
            return None;
        }
        errors.push((camera.project(&seen) - pixel).norm());
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
        let view = |pose: Se3| (pose, camera.project(&pose.inverse_act(&point)));
        let views: Vec<_> = (0..5).map(|k| view(pose(k))).collect();
        let found = triangulate(&views, &camera, 1.0).unwrap();
        assert!((found - point).norm() < 1e-9);
        assert_eq!(triangulate(&views[..2], &camera, 1.0), None, "too few");
        let still: Vec<_> = (0..5).map(|_| view(pose(0))).collect();
        assert_eq!(triangulate(&still, &camera, 1.0), None, "parallel rays");
    }
}
