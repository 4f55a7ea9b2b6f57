//! How a line that touches an outline moves with the object: analytic Jacobians of bounds.
use crate::shapes::Ellipsoid;
use crate::shapes::ellipse::Side;
use manifactor_geometry::Camera;
use nalgebra::{RowSVector, RowVector6, Vector3};

/// A line that touches an outline, as the plane through it and the camera's centre: n·x = 0 in the
/// camera's frame.
pub(crate) struct TangentLine(Vector3<f64>);

impl TangentLine {
    /// The line at a side of a box; `axis` is 0 for xmin and xmax, 1 for ymin and ymax. `None` at the
    /// border of the image, which moves with nothing.
    #[inline(always)]
    pub(crate) fn of(camera: &Camera, side: &Side<f64>, axis: usize) -> Option<Self> {
        let &Side::Touched { bound, across, slope } = side else { return None };
        let ([lx, ly], [x, y]) = match axis {
            0 => ([1.0, slope], [bound, across]),
            _ => ([slope, 1.0], [across, bound]),
        };
        // Kᵀl with K less the principal point, which goes into the line: no large numbers to cancel
        let offset = -lx * (x - camera.cx) - ly * (y - camera.cy);
        Some(Self(Vector3::new(lx * camera.fx, lx * camera.skew + ly * camera.fy, offset)))
    }

    /// The derivatives of the line's offset β, l = (1, slope, -β), by the pose (ω, v) of the camera and
    /// by the object's (ω, v, log s); the line turns about the outline, which moves β in second order.
    ///
    /// The line touches: |Bᵀn|² = (n·p)² with the columns of B the semi-axes and p the centroid. With
    /// e = Bᵀn and h = n·p, the differential of that at constant slope is
    /// (e·b - h z) dβ = eᵀ dBᵀ n - h nᵀ dp, b the last row of B and z the last of p.
    #[inline(always)]
    pub(crate) fn derivatives(
        &self,
        seen: &Ellipsoid,
        semi_axes: &Vector3<f64>,
    ) -> (RowVector6<f64>, RowSVector<f64, 9>) {
        let (n, axes, p) = (&self.0, &seen.axes, &seen.centroid);
        let e = axes.tr_mul(n);
        let h = n.dot(p);
        let contact = axes * e; // Be; its last row is e·b
        let scale = 1.0 / (contact.z - h * p.z);
        let (en, hn) = (e * scale, n * (h * scale));

        // camera: dB = -ω × B, dp = -ω × p - v
        let turn = (p * h - contact).cross(n) * scale;
        let pose = RowVector6::new(turn.x, turn.y, turn.z, hn.x, hn.y, hn.z);

        // object: dB = M [ω]× S, dp = M v, dB = B diag(dlog s), where B = M S
        let q = e.component_div(semi_axes); // Mᵀn
        let turn = e.component_mul(semi_axes).cross(&q) * scale;
        let shift = q * (-h * scale);
        let grow = e.component_mul(&en);
        let object =
            RowSVector::from([turn.x, turn.y, turn.z, shift.x, shift.y, shift.z, grow.x, grow.y, grow.z]);
        (pose, object)
    }
}
