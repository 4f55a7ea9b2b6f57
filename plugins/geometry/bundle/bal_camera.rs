//! Camera of bundle adjustment in the large (BAL): a pose, a focal length and two coefficients of radial
//! distortion.
use crate::groups::Coordinates;
use crate::groups::Se3;
use crate::groups::Xyzw;
use manifactor_graph::Motion;
use manifactor_graph::prelude::*;
use nalgebra::SVector;

/// A camera of unknown pose, focal length and radial distortion, as in bundle adjustment in the large (BAL).
///
/// The camera looks along the negative z axis of its frame; x is right and y up in the image, with the origin
/// at the image centre. A point P in the camera's frame projects to f (1 + k1 ‖p‖² + k2 ‖p‖⁴) p with
/// p = -(Px, Py) / Pz, in pixels (Agarwal et al., Bundle Adjustment in the Large, ECCV 2010). The pose maps
/// points from the camera's frame to the world frame, as all poses in this library do; BAL files store its
/// inverse.
///
/// Tangent (rx, ry, rz, x, y, z, f, k1, k2). The pose steps by X·Exp(δ) in the camera's frame, so a rotation
/// turns the camera about its own centre; f, k1 and k2 are additive.
///
/// ```toml
/// [values]
/// c0 = { type = "bal_camera", translation = [0.0, 0.5, 6.0], rotation = [0.0, 0.0, 0.6, 0.8], focal_length = 800.0, k1 = -0.1, k2 = 0.02 }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "Document", into = "Document")]
#[serde(bound(serialize = "Self: Into<Document>", deserialize = "Self: From<Document>"))]
#[schemars(with = "Document", bound = "")]
pub struct BalCamera<T: Scalar = f64> {
    /// Maps points from the camera's frame to the world frame.
    pub world_from_camera: Se3<T>,
    /// Focal length, in pixels.
    pub focal_length: T,
    /// Radial distortion: the coefficients of the second and the fourth power of the distance from the
    /// centre.
    pub distortion: Vector2<T>,
}

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Document {
    /// Camera centre in the world frame, in the unit of the points.
    translation: Coordinates<3>,
    /// Unit quaternion (x, y, z, w) that rotates directions from the camera's frame to the world frame.
    rotation: Xyzw,
    /// Focal length, in pixels.
    focal_length: f64,
    /// Radial distortion: the coefficient of the second power of the distance from the centre.
    k1: f64,
    /// Radial distortion: the coefficient of the fourth power of the distance from the centre.
    k2: f64,
}

/// Smallest depth of a point in front of the camera, as a share of its distance.
const MIN_RELATIVE_DEPTH: f64 = 1e-6;

impl<T: Scalar> BalCamera<T> {
    /// 1 + k1 ρ + k2 ρ², ρ = ‖p‖².
    #[inline(always)]
    pub(crate) fn radial(&self, rho: T) -> T {
        T::one() + rho * (self.distortion.x + rho * self.distortion.y)
    }
    /// Projects a point in the camera's frame, in pixels. The result is meaningful only for a point in front
    /// of the camera.
    #[inline(always)]
    pub fn project(&self, point: &Vector3<T>) -> Vector2<T> {
        let p = point.xy() / -point.z;
        p * (self.focal_length * self.radial(p.norm_squared()))
    }
}

impl BalCamera {
    /// Returns whether a point in the camera's frame is in front of it: its depth is more than a millionth of
    /// its distance.
    #[inline(always)]
    pub fn is_in_front(point: &Vector3<f64>) -> bool {
        point.z < 0.0 && point.z * point.z > MIN_RELATIVE_DEPTH * MIN_RELATIVE_DEPTH * point.norm_squared()
    }
}

impl Manifold for BalCamera {
    type Dim = U9;
    type Of<T: Scalar> = BalCamera<T>;
    const TANGENT: &'static [&'static str] = &["rx", "ry", "rz", "x", "y", "z", "f", "k1", "k2"];

    fn lift<T: Scalar>(&self) -> BalCamera<T> {
        BalCamera {
            world_from_camera: self.world_from_camera.lift(),
            focal_length: self.focal_length.lift(),
            distortion: self.distortion.lift(),
        }
    }
    fn seed(&self) -> BalCamera<JetOf<U9>> {
        let jet = |value: f64, at: usize| {
            let mut gradient = [0.0; 9];
            gradient[at] = 1.0;
            Jet::with_gradient(value, &gradient)
        };
        BalCamera {
            world_from_camera: self.world_from_camera.seed_in(9, 0),
            focal_length: jet(self.focal_length, 6),
            distortion: Vector2::new(jet(self.distortion.x, 7), jet(self.distortion.y, 8)),
        }
    }
    fn retract(&self, delta: &SVector<f64, 9>) -> Self {
        Self {
            world_from_camera: self.world_from_camera.retract(&delta.fixed_rows::<6>(0).into_owned()),
            focal_length: self.focal_length + delta[6],
            distortion: self.distortion + delta.fixed_rows::<2>(7),
        }
    }
    fn local(&self, other: &Self) -> SVector<f64, 9> {
        let xi: Vector6<f64> = self.world_from_camera.local(&other.world_from_camera);
        let k = other.distortion - self.distortion;
        let f = other.focal_length - self.focal_length;
        SVector::from([xi[0], xi[1], xi[2], xi[3], xi[4], xi[5], f, k.x, k.y])
    }
    fn coordinate(&self, direction: usize) -> Option<f64> {
        match direction {
            6 => Some(self.focal_length),
            7 | 8 => self.distortion.get(direction - 7).copied(),
            _ => None,
        }
    }
    fn position(&self) -> Option<[f64; 3]> {
        Some(self.world_from_camera.translation.into())
    }
    fn moved(&self, motion: Motion) -> Option<SVector<f64, 9>> {
        Some(self.world_from_camera.moved(motion)?.fixed_resize::<9, 1>(0.0))
    }
    fn is_finite(&self) -> bool {
        let numbers = [self.focal_length, self.distortion.x, self.distortion.y];
        self.world_from_camera.is_finite() && numbers.iter().all(|x| x.is_finite())
    }
}
register_manifold!("bal_camera", BalCamera);

impl From<Document> for BalCamera {
    fn from(d: Document) -> Self {
        Self {
            world_from_camera: Se3::new(d.rotation.0, d.translation.vector()),
            focal_length: d.focal_length,
            distortion: Vector2::new(d.k1, d.k2),
        }
    }
}
impl From<BalCamera> for Document {
    fn from(c: BalCamera) -> Self {
        Self {
            translation: Coordinates::unchecked(c.world_from_camera.translation),
            rotation: Xyzw(c.world_from_camera.rotation),
            focal_length: c.focal_length,
            k1: c.distortion.x,
            k2: c.distortion.y,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_bal_camera, se3_tangent};
    use manifactor_testing::manifold_laws;
    use manifactor_testing::strategies::vector;
    use proptest::prelude::*;

    manifold_laws! {
        retract_and_local_are_inverse: (any_bal_camera(), any_bal_camera(), (se3_tangent(), vector::<3>(1.0)).prop_map(
            |(xi, v)| SVector::<f64, 9>::from_fn(|i, _| if i < 6 { xi[i] } else { v[i - 6] })
        ))
    }

    #[test]
    fn what_is_up_and_to_the_right_has_positive_coordinates() {
        let camera = BalCamera {
            world_from_camera: Se3::identity(),
            focal_length: 100.0,
            distortion: Vector2::new(0.5, 0.25),
        };
        // p = (1, 2), ρ = 5: 100 (1 + 2.5 + 6.25) p
        let pixel = camera.project(&Vector3::new(2.0, 4.0, -2.0));
        assert!((pixel - Vector2::new(975.0, 1950.0)).norm() < 1e-12);
    }

    #[test]
    fn a_step_turns_the_camera_about_its_own_centre() {
        let camera = BalCamera {
            world_from_camera: Se3::new(crate::So3::identity(), Vector3::new(1.0, 2.0, 3.0)),
            focal_length: 100.0,
            distortion: Vector2::zeros(),
        };
        let turned = camera.retract(&SVector::from([0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 5.0, 0.0, 0.0]));
        assert_eq!(turned.world_from_camera.translation, Vector3::new(1.0, 2.0, 3.0));
        assert_eq!(turned.focal_length, 105.0);
    }
}
