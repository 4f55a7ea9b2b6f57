//! A detector's errors last: boxes of an object that follow each other are off by the same few pixels.
use crate::factors::BoundingBoxFactor;
use crate::shapes::{DualQuadric, Ellipsoid};
use manifactor_geometry::{Point4, Se3};
use manifactor_graph::prelude::*;
use nalgebra::Matrix4;

/// The box around an object's outline, shifted by an offset, is the one that was drawn: r = β(x, q) + o - b, in pixels.
///
/// Variables: the pose of the camera, the object, and the offset of each side. Rows and β are those of `bounding_box`, and so is where it
/// is defined. Several boxes share an offset: it stands for what their errors have in common. A side that the border cuts has an offset as
/// well. The boxes alone cannot tell an offset from a larger object: a prior on the offset has to.
///
/// ```toml
/// [[factors]]
/// keys   = ["x0", "q0", "o0"]
/// factor = { type = "bounding_box_offset", box = [120.0, 80.0, 260.0, 310.0], camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 } }
/// noise  = { sigma = 2.0 }
///
/// [[factors]]
/// keys   = ["o0"]
/// factor = { type = "prior_point4", value = { position = [0.0, 0.0, 0.0, 0.0] } }
/// noise  = { sigma = 5.0 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct BoundingBoxOffset(pub BoundingBoxFactor);

impl Residual for BoundingBoxOffset {
    type Variables = (Se3, DualQuadric, Point4);
    type Dim = U4;
    const ROWS: &'static [&'static str] = BoundingBoxFactor::ROWS;

    #[inline]
    fn residual<T: Scalar>(&self, (camera, quadric, offset): Lifted<Self::Variables, T>) -> Vector4<T> {
        let sides = self.0.sides(&Ellipsoid::seen(&camera, &quadric));
        sides.map_or_else(Vector4::zeros, |sides| self.0.error(&sides) + offset)
    }

    #[inline]
    fn is_defined(&self, (camera, quadric, _): Refs<'_, Self::Variables>) -> bool {
        self.0.is_defined((camera, quadric))
    }

    fn linearize(
        &self,
        (camera, quadric, offset): Refs<'_, Self::Variables>,
        _free: &[bool],
        (by_pose, by_quadric, by_offset): &mut Jacobians<Self>,
    ) -> Vector4<f64> {
        let error = self.0.derive((camera, quadric), by_pose, by_quadric);
        *by_offset = if error.is_some() { Matrix4::identity() } else { Matrix4::zeros() };
        error.map_or_else(Vector4::zeros, |error| error + offset.0)
    }
}

register_factor!("bounding_box_offset", BoundingBoxOffset);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::any_view;
    use crate::{BoundingBox, BoxModel, Camera};
    use manifactor_geometry::testing::any_point;
    use manifactor_graph::Factor;
    use manifactor_testing::{JacobianLaw, check};
    use nalgebra::Vector4;

    fn factor(camera: Camera, model: BoxModel) -> BoundingBoxOffset {
        let bounding_box = BoundingBox::new([100.0, 80.0, 300.0, 200.0]).unwrap();
        BoundingBoxOffset(BoundingBoxFactor { bounding_box, camera, model })
    }

    #[test]
    fn the_jacobian_is_right() {
        check((any_view(), any_point::<4>()), |((camera, pose, quadric), offset)| {
            for model in [BoxModel::Standard, BoxModel::Truncated] {
                // differences are a matter of `bounding_box`: the derivative by the residual's own scalar is exact
                let law = JacobianLaw { numeric: f64::INFINITY, ..JacobianLaw::default() };
                law.check(&factor(camera, model), &[&pose, &quadric, &offset])?;
            }
            Ok(())
        });
    }

    #[test]
    fn a_box_that_is_off_by_the_offset_has_no_error() {
        check((any_view(), any_point::<4>()), |((camera, pose, quadric), offset)| {
            let plain = factor(camera, BoxModel::Standard).0.residual::<f64>((pose, quadric));
            let shifted = factor(camera, BoxModel::Standard).residual::<f64>((pose, quadric, offset.0));
            assert!((shifted - plain - offset.0).norm() <= 1e-9 * (1.0 + plain.norm()));
            Ok(())
        });
    }

    #[test]
    fn an_object_behind_the_camera_has_no_error() {
        let quadric = DualQuadric {
            pose: Se3::new(manifactor_geometry::So3::identity(), [0.0, 0.0, -3.0].into()),
            semi_axes: [0.2; 3].into(),
        };
        let factor = factor(Camera::new([525.0, 525.0, 320.0, 240.0], 640, 480).unwrap(), BoxModel::Standard);
        let offset = Point4::new(Vector4::repeat(5.0));
        let l = Factor::erased(&factor).linearize(&[&Se3::identity(), &quadric, &offset]).unwrap();
        assert!(l.residual.iter().chain(l.jacobians.iter().flatten()).all(|x| *x == 0.0));
    }

    #[test]
    fn it_reads_back_as_a_box() {
        let factor =
            factor(Camera::new([525.0, 525.0, 320.0, 240.0], 640, 480).unwrap(), BoxModel::Truncated);
        let text = serde_json::to_string(&factor).unwrap();
        assert_eq!(text, serde_json::to_string(&factor.0).unwrap());
        assert_eq!(serde_json::from_str::<BoundingBoxOffset>(&text).unwrap(), factor);
    }
}
