//! Analytic Jacobians of bounds: the motion of a line that touches an outline, as the object moves.
use crate::shapes::Ellipsoid;
use crate::shapes::ellipse::Side;
use manifactor_geometry::Camera;
use nalgebra::{RowSVector, RowVector6, Vector3};

/// A line that touches an outline, as the plane through the line and the camera centre: n·x = 0 in the
/// camera's frame.
pub(crate) struct TangentLine(Vector3<f64>);

impl TangentLine {
    /// Returns the line at a side of a box; `axis` is 0 for xmin and xmax, 1 for ymin and ymax. `None` at the
    /// border of the image, which does not move.
    #[inline(always)]
    pub(crate) fn of(camera: &Camera, side: &Side<f64>, axis: usize) -> Option<Self> {
        let &Side::Touched { bound, across, slope } = side else { return None };
        let ([lx, ly], [x, y]) = match axis {
            0 => ([1.0, slope], [bound, across]),
            _ => ([slope, 1.0], [across, bound]),
        };
        // Kᵀl with K relative to the principal point, which is subtracted from the line to avoid cancellation
        // of large numbers.
        let offset = -lx * (x - camera.cx) - ly * (y - camera.cy);
        Some(Self(Vector3::new(lx * camera.fx, lx * camera.skew + ly * camera.fy, offset)))
    }

    /// Returns the derivatives of the line's offset β, l = (1, slope, -β), with respect to the camera pose
    /// (ω, v) and the object (ω, v, log s). The line also rotates about the outline, which changes β only to
    /// second order.
    ///
    /// The line touches: |Bᵀn|² = (n·p)² with the semi-axes as columns of B and the centroid p. With e = Bᵀn
    /// and h = n·p, its differential at constant slope is (e·b - h z) dβ = eᵀ dBᵀ n - h nᵀ dp, with b the
    /// last row of B and z the last entry of p.
    #[inline(always)]
    pub(crate) fn derivatives(
        &self,
        seen: &Ellipsoid,
        semi_axes: &Vector3<f64>,
    ) -> (RowVector6<f64>, RowSVector<f64, 9>) {
        let (n, axes, p) = (&self.0, &seen.axes, &seen.centroid);
        let e = axes.tr_mul(n);
        let h = n.dot(p);
        let contact = axes * e; // Be; its last entry is e·b
        let scale = 1.0 / (contact.z - h * p.z);
        let (en, hn) = (e * scale, n * (h * scale));

        // Camera: dB = -ω × B, dp = -ω × p - v.
        let turn = (p * h - contact).cross(n) * scale;
        let pose = RowVector6::new(turn.x, turn.y, turn.z, hn.x, hn.y, hn.z);

        // Object: dB = M [ω]× S, dp = M v, dB = B diag(dlog s), with B = M S.
        let q = e.component_div(semi_axes); // Mᵀn
        let turn = e.component_mul(semi_axes).cross(&q) * scale;
        let shift = q * (-h * scale);
        let grow = e.component_mul(&en);
        let object =
            RowSVector::from([turn.x, turn.y, turn.z, shift.x, shift.y, shift.z, grow.x, grow.y, grow.z]);
        (pose, object)
    }
}
