//! Interface of camera models: a model is one file that implements [`CameraModel`] and ends with
//! `register_camera!`.
use crate::{Camera, CameraView, Point3};
use manifactor_graph::{Block, Dimension, Jet, JetOf, Lift, Manifold, Matrix, Scalar, Vector};
use nalgebra::{Matrix2x3, U2, U3, Vector2, Vector3};
use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Debug;

/// A calibrated camera: maps points to pixels and pixels to directions.
///
/// Points are in the camera's frame: x right, y down, z forward.
pub trait CameraModel:
    Clone + Debug + PartialEq + Serialize + DeserializeOwned + JsonSchema + Send + Sync + 'static
{
    /// A camera in the inline TOML form used inside a factor; an example for the catalogue.
    const EXAMPLE: &'static str;

    /// Returns the pixel of a point that the camera [sees](Self::sees).
    fn project<T: Scalar>(&self, point: &Vector3<T>) -> Vector2<T>;

    /// Returns a direction that projects to the pixel, of any length, or `None` if the model has none.
    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>>;

    /// Returns whether a point is in the domain of [`project`](Self::project), inside the image or outside.
    fn sees(&self, point: &Vector3<f64>) -> bool;

    /// Returns the pinhole camera of the rectified image: same focal lengths, principal point and size.
    fn pinhole(&self) -> Camera;

    /// Returns the derivative of [`project`](Self::project) with respect to the point. The default uses dual
    /// numbers; a model can override it.
    #[inline]
    fn derivative(&self, point: &Vector3<f64>) -> Matrix2x3<f64> {
        let pixel = self.project(&Point3::new(*point).seed());
        let mut derivative = Matrix2x3::zeros();
        for (i, coordinate) in pixel.iter().enumerate() {
            if let Some(gradient) = JetOf::<U3>::gradient(coordinate) {
                derivative.row_mut(i).copy_from_slice(gradient);
            }
        }
        derivative
    }
}

/// A [`CameraModel`] whose intrinsics can be a variable, [`Intrinsics`](crate::Intrinsics).
pub trait UncalibratedModel: CameraModel {
    /// Number of intrinsics that can be estimated.
    type Dim: Dimension;

    /// Names of these intrinsics, in the order of [`intrinsics`](Self::intrinsics).
    const INTRINSICS: &'static [&'static str];

    /// Returns the intrinsics that can be estimated: focal lengths, principal point, then the lens.
    fn intrinsics(&self) -> Vector<Self::Dim>;

    /// Returns the same camera with other intrinsics. A camera with [invalid](Self::is_valid) ones sees nothing.
    #[must_use]
    fn with_intrinsics(&self, intrinsics: &Vector<Self::Dim>) -> Self;

    /// Returns whether the intrinsics are those of a camera: for example, focal lengths above zero.
    fn is_valid(&self) -> bool;

    /// Returns the pixel of a point that the camera sees, with other intrinsics.
    fn project_with<T: Scalar>(&self, intrinsics: &Vector<Self::Dim, T>, point: &Vector3<T>) -> Vector2<T>;

    /// Returns the intrinsics as constants.
    #[inline(always)]
    fn lifted<T: Scalar>(&self) -> Vector<Self::Dim, T> {
        let intrinsics = self.intrinsics();
        Self::Dim::vector(|i| T::from(intrinsics.as_ref()[i]))
    }

    /// Returns the derivative of `project` with respect to the intrinsics. The default uses dual
    /// numbers; a model can override it.
    #[inline]
    fn derivative_by_intrinsics(&self, point: &Vector3<f64>) -> Matrix<U2, Self::Dim> {
        let intrinsics = self.intrinsics();
        let unit = |i: usize| Self::Dim::vector(|k| if k == i { 1.0 } else { 0.0 });
        let jet = |i: usize| JetOf::<Self::Dim>::with_gradient(intrinsics.as_ref()[i], unit(i).as_ref());
        let pixel = self.project_with(&Self::Dim::vector(jet), &point.lift());
        let mut derivative = Matrix::<U2, Self::Dim>::zeros();
        for (row, coordinate) in pixel.iter().enumerate() {
            let entries = derivative.as_mut_slice().iter_mut().skip(row).step_by(2);
            entries.zip(coordinate.gradient().unwrap_or_default()).for_each(|(entry, slope)| *entry = *slope);
        }
        derivative
    }
}

/// A [`CameraModel`] that a document selects by its `type`. Implemented by
/// [`register_camera!`](crate::register_camera).
#[typetag::serialize(tag = "type")]
pub trait AnyCamera: Debug + Send + Sync {
    /// Returns the pinhole camera of the rectified image.
    fn pinhole(&self) -> Camera;

    /// Returns the direction of a pixel in the frame of the camera, of any length; `None` if the model has none.
    fn ray(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>>;

    /// Returns the pinhole camera that agrees with this camera around a pixel; `None` if the pixel has no direction.
    fn view(&self, pixel: &Vector2<f64>) -> Option<CameraView>;

    /// Maps a pixel of the original image to the rectified image; `None` beyond 70° from the optical axis.
    fn rectify(&self, pixel: &Vector2<f64>) -> Option<Vector2<f64>> {
        project_ahead(&self.pinhole(), &self.ray(pixel)?)
    }
}

manifactor_graph::kind!(dyn AnyCamera, "camera");

/// Names of a model in documents. Implemented by [`register_camera!`](crate::register_camera).
#[doc(hidden)]
pub trait CameraNames {
    /// Name of the model, as a camera and as a variable.
    const MODEL: &'static str;
    /// Name of its [`Projection`](crate::Projection) factor.
    const PROJECTION: &'static str;
}

/// Name of an [`UncalibratedModel`] in documents. Implemented by [`register_camera!`](crate::register_camera).
#[doc(hidden)]
pub trait UncalibratedName {
    /// Name of its [`UncalibratedProjection`](crate::UncalibratedProjection) factor.
    const UNCALIBRATED: &'static str;
}

/// Cosine of the largest angle to the optical axis in the rectified image, 70°. There, a pixel of a fisheye camera
/// is stretched 8 times, and the noise of a box with it.
const MIN_COSINE: f64 = 0.342;

/// Returns the pixel of a direction; `None` beyond 70° from the optical axis.
pub(super) fn project_ahead(camera: &Camera, direction: &Vector3<f64>) -> Option<Vector2<f64>> {
    (direction.z > MIN_COSINE * direction.norm()).then(|| camera.project(direction))
}

/// Defines the document of a camera: the numbers of its pinhole camera without skew, then those of its lens.
macro_rules! camera_document {
    ($name:literal, $($(#[$text:meta])* $field:ident: $type:ty),+) => {
        #[derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields)]
        #[schemars(rename = $name)]
        struct Document {
            /// Focal length along x, in pixels.
            fx: f64,
            /// Focal length along y, in pixels.
            fy: f64,
            /// Principal point, in pixels.
            cx: f64,
            /// Principal point, in pixels.
            cy: f64,
            /// Size of the image, in pixels.
            width: u32,
            /// Size of the image, in pixels.
            height: u32,
            $($(#[$text])* $field: $type),+
        }

        impl Document {
            fn of(camera: crate::Camera, $($field: $type),+) -> Self {
                let crate::Camera { fx, fy, cx, cy, width, height, .. } = camera;
                Self { fx, fy, cx, cy, width, height, $($field),+ }
            }

            fn pinhole(&self) -> Result<crate::Camera, crate::CameraError> {
                crate::Camera::new([self.fx, self.fy, self.cx, self.cy], self.width, self.height)
            }
        }
    };
}
pub(crate) use camera_document;

/// Registers a [`CameraModel`](crate::CameraModel) as a camera for sources, and its point projection as a
/// factor: `register_camera!("double_sphere", "projection_double_sphere", DoubleSphere);`
///
/// An [`UncalibratedModel`](crate::UncalibratedModel) has a further name, of the projection with unknown intrinsics, and
/// is a type of variables, too: `register_camera!("radial", "projection_radial", "uncalibrated_radial", Radial);`
#[macro_export]
macro_rules! register_camera {
    ($name:literal, $projection:literal, $uncalibrated:literal, $type:ty) => {
        $crate::register_camera!($name, $projection, $type);
        impl $crate::__private::UncalibratedName for $type {
            const UNCALIBRATED: &'static str = $uncalibrated;
        }
        $crate::__private::manifactor_graph::register_manifold!($name, $crate::Intrinsics<$type>);
        $crate::__private::manifactor_graph::register_factor!(
            $uncalibrated,
            $crate::UncalibratedProjection<$type>
        );
    };
    ($name:literal, $projection:literal, $type:ty) => {
        impl $crate::__private::CameraNames for $type {
            const MODEL: &'static str = $name;
            const PROJECTION: &'static str = $projection;
        }
        const _: () = {
            use $crate::__private::manifactor_graph::__private::typetag;
            #[typetag::serialize(name = $name)]
            impl $crate::AnyCamera for $type {
                fn pinhole(&self) -> $crate::Camera {
                    $crate::CameraModel::pinhole(self)
                }
                fn ray(
                    &self,
                    pixel: &$crate::__private::Vector2<f64>,
                ) -> ::std::option::Option<$crate::__private::Vector3<f64>> {
                    $crate::CameraModel::unproject(self, pixel)
                }
                fn view(
                    &self,
                    pixel: &$crate::__private::Vector2<f64>,
                ) -> ::std::option::Option<$crate::CameraView> {
                    $crate::CameraView::new(self, pixel)
                }
            }
            $crate::__private::manifactor_graph::register!(dyn $crate::AnyCamera, $name, $type);
        };
        $crate::__private::manifactor_graph::register_factor!($projection, $crate::Projection<$type>);
    };
}
