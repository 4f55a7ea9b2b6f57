//! Position and size of an object from the planes of its boxes, each by linear least squares.
use super::{InitialiseError, ObjectView};
use crate::shapes::DualQuadric;
use crate::shapes::SemiAxes;
use manifactor_geometry::{Se3, So3};
use nalgebra::{Matrix3, Vector3};

/// Weight of the pull towards a ball, relative to the planes. Views from one side do not determine the extent
/// along the line of sight.
const BALL_WEIGHT: f64 = 0.01;
/// Minimum semi-axis, relative to the mean of the three.
const MIN_RELATIVE_AXIS: f64 = 0.1;

/// Returns the point closest to all planes through a camera and the centre of its box: n·(x - c) = 0.
///
/// Centre lines are used instead of sides, because a box that is cut on one side still has the centre line of
/// one axis.
pub(super) fn centroid(views: &[ObjectView]) -> Result<Vector3<f64>, InitialiseError> {
    let (mut h, mut g, mut planes) = (Matrix3::zeros(), Vector3::zeros(), 0);
    for view in views {
        for line in view.middle_lines() {
            let n = view.normal(&line);
            h += n * n.transpose();
            g += n * n.dot(&view.world_from_camera.translation);
            planes += 1;
        }
    }
    if planes < 3 {
        return Err(InitialiseError::TooFewSides { found: 2 * planes, needed: 6 });
    }
    let eigen = h.symmetric_eigenvalues();
    if eigen.min() <= 1e-12 * eigen.max() {
        return Err(InitialiseError::Undetermined);
    }
    let x = h.cholesky().map(|h| h.solve(&g));
    x.filter(|x| x.iter().all(|x| x.is_finite())).ok_or(InitialiseError::Undetermined)
}

/// Returns the ellipsoid at `centroid`, with axes along the world axes, that best touches the planes of all
/// sides.
///
/// A plane with unit normal n at distance h touches the ellipsoid if nᵀAn = h², which is linear in A =
/// diag(a², b², c²).
pub(super) fn ellipsoid(
    views: &[ObjectView],
    centroid: Vector3<f64>,
) -> Result<DualQuadric, InitialiseError> {
    let mut planes = vec![];
    for view in views {
        let from_camera = centroid - view.world_from_camera.translation;
        planes.extend(view.lines().map(|line| {
            let n = view.normal(&line);
            (n.component_mul(&n), n.dot(&from_camera).powi(2))
        }));
    }
    if planes.is_empty() {
        return Err(InitialiseError::TooFewSides { found: 0, needed: 1 });
    }
    let count = planes.len() as f64;
    let ball = planes.iter().map(|(_, h2)| h2).sum::<f64>() / count;
    let weight = BALL_WEIGHT * count;
    let (mut h, mut g) = (Matrix3::from_diagonal_element(weight), Vector3::repeat(weight * ball));
    for (n2, h2) in &planes {
        h += n2 * n2.transpose();
        g += n2 * *h2;
    }
    let squares = h.cholesky().map(|h| h.solve(&g)).ok_or(InitialiseError::Undetermined)?;
    let semi_axes = squares.map(|s| s.max(ball * MIN_RELATIVE_AXIS * MIN_RELATIVE_AXIS).sqrt());
    let semi_axes = SemiAxes::new(semi_axes).map_err(crate::EllipsoidError::from)?.vector();
    Ok(DualQuadric { pose: Se3::new(So3::identity(), centroid), semi_axes })
}
