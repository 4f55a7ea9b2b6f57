//! Camera models by COLMAP's names.
use manifactor_geometry::{
    AnyCamera, Camera, CameraError, CameraModel, Distortion, DistortionError, KannalaBrandt, Radial,
    RadialTangential, UncalibratedModel,
};
use std::sync::Arc;

/// A camera model of COLMAP that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// f, cx, cy.
    SimplePinhole,
    /// fx, fy, cx, cy.
    Pinhole,
    /// f, cx, cy, k₁.
    SimpleRadial,
    /// f, cx, cy, k₁, k₂.
    Radial,
    /// fx, fy, cx, cy, k₁, k₂, p₁, p₂.
    OpenCv,
    /// fx, fy, cx, cy, k₁, k₂, p₁, p₂, k₃, k₄, k₅, k₆.
    FullOpenCv,
    /// fx, fy, cx, cy, k₁, k₂, k₃, k₄.
    OpenCvFisheye,
}

/// Name, number of parameters, and the intrinsics that are held: principal points, as in COLMAP's own bundle adjustment,
/// and what the model does not have.
const MODELS: [(Model, &str, usize, &[&str]); 7] = [
    (Model::SimplePinhole, "SIMPLE_PINHOLE", 3, &["cx", "cy", "k1", "k2"]),
    (Model::Pinhole, "PINHOLE", 4, &["cx", "cy"]),
    (Model::SimpleRadial, "SIMPLE_RADIAL", 4, &["cx", "cy", "k2"]),
    (Model::Radial, "RADIAL", 5, &["cx", "cy"]),
    (Model::OpenCv, "OPENCV", 8, &["cx", "cy"]),
    (Model::FullOpenCv, "FULL_OPENCV", 12, &["cx", "cy"]),
    (Model::OpenCvFisheye, "OPENCV_FISHEYE", 8, &["cx", "cy"]),
];

impl Model {
    fn row(self) -> (&'static str, usize, &'static [&'static str]) {
        let row = MODELS.into_iter().find(|(model, ..)| *model == self);
        row.map_or(("", 0, &[]), |(_, name, count, held)| (name, count, held))
    }

    /// Returns COLMAP's name of the model.
    pub fn name(self) -> &'static str {
        self.row().0
    }

    /// Returns the intrinsics that are held.
    pub fn held(self) -> &'static [&'static str] {
        self.row().2
    }
}

/// A camera with one of the models of COLMAP.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lens {
    /// Without distortion.
    Pinhole(Camera),
    /// One focal length and radial distortion.
    Radial(Radial),
    /// Radial and tangential distortion.
    RadialTangential(RadialTangential),
    /// A fisheye camera by Kannala and Brandt.
    KannalaBrandt(KannalaBrandt),
}

/// Evaluates an expression with the camera of a [`Lens`], whatever its type.
macro_rules! each_lens {
    ($lens:expr, $camera:ident => $value:expr) => {
        match $lens {
            $crate::bundle::colmap::lens::Lens::Pinhole($camera) => $value,
            $crate::bundle::colmap::lens::Lens::Radial($camera) => $value,
            $crate::bundle::colmap::lens::Lens::RadialTangential($camera) => $value,
            $crate::bundle::colmap::lens::Lens::KannalaBrandt($camera) => $value,
        }
    };
}
pub(super) use each_lens;

/// Error of parameters that are no camera.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LensError {
    /// The model is unknown or not supported.
    #[error("expected one of the models {}, got {found}", MODELS.map(|(_, name, ..)| name).join(", "))]
    Model {
        /// The name found.
        found: String,
    },
    /// The model has another number of parameters.
    #[error("expected {expected} parameters of {model}, got {found}")]
    Count {
        /// Name of the model.
        model: &'static str,
        /// Its number of parameters.
        expected: usize,
        /// The number found.
        found: usize,
    },
    /// A parameter is not that of a camera.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// A coefficient is not finite.
    #[error(transparent)]
    Distortion(#[from] DistortionError),
}

impl Lens {
    /// Returns the camera with a model of COLMAP, with its parameters in COLMAP's order.
    ///
    /// # Errors
    /// If the model is not supported, has another number of parameters, or these are not those of a camera.
    pub fn new(
        model: &str,
        [width, height]: [u32; 2],
        parameters: &[f64],
    ) -> Result<(Self, Model), LensError> {
        let known = MODELS.into_iter().find(|(_, name, ..)| *name == model);
        let (model, name, expected, _) = known.ok_or_else(|| LensError::Model { found: model.to_owned() })?;
        let radial = |numbers| Radial::new(numbers, width, height).map(Self::Radial);
        let lens = match (model, parameters) {
            (Model::SimplePinhole, &[f, cx, cy]) => radial([f, cx, cy, 0.0, 0.0])?,
            (Model::SimpleRadial, &[f, cx, cy, k1]) => radial([f, cx, cy, k1, 0.0])?,
            (Model::Radial, &[f, cx, cy, k1, k2]) => radial([f, cx, cy, k1, k2])?,
            (_, &[fx, fy, cx, cy, ref lens @ ..]) if parameters.len() == expected => {
                let pinhole = Camera::new([fx, fy, cx, cy], width, height)?;
                match (model, lens) {
                    (Model::OpenCvFisheye, &[k1, k2, k3, k4]) => {
                        Self::KannalaBrandt(KannalaBrandt::new(pinhole, [k1, k2, k3, k4]))
                    }
                    (_, []) => Self::Pinhole(pinhole),
                    _ => {
                        let distortion = Distortion::try_from(lens.to_vec())?;
                        Self::RadialTangential(RadialTangential::new(pinhole, distortion))
                    }
                }
            }
            _ => return Err(LensError::Count { model: name, expected, found: parameters.len() }),
        };
        Ok((lens, model))
    }

    /// Returns the model with the fewest parameters that can express the camera.
    pub fn model(&self) -> Model {
        match self {
            Self::Pinhole(_) => Model::Pinhole,
            Self::Radial(_) => Model::Radial,
            Self::RadialTangential(camera) if camera.distortion().further() == [0.0; 4] => Model::OpenCv,
            Self::RadialTangential(_) => Model::FullOpenCv,
            Self::KannalaBrandt(_) => Model::OpenCvFisheye,
        }
    }

    /// Returns the parameters of a model, in COLMAP's order.
    pub fn parameters(&self, model: Model) -> Vec<f64> {
        let mut parameters = each_lens!(self, camera => camera.intrinsics().as_slice().to_vec());
        if let Self::RadialTangential(camera) = self {
            parameters.extend(camera.distortion().further());
        }
        parameters.truncate(model.row().1);
        parameters
    }

    /// Returns width and height of the image, in pixels.
    pub fn size(&self) -> [u32; 2] {
        let Camera { width, height, .. } = each_lens!(self, camera => CameraModel::pinhole(camera));
        [width, height]
    }

    /// Returns the camera for a source: a pinhole camera if nothing is distorted.
    pub fn camera(self) -> Arc<dyn AnyCamera> {
        let is_fisheye = matches!(self, Self::KannalaBrandt(_));
        let parameters = self.parameters(Model::FullOpenCv);
        let first = if matches!(self, Self::Radial(_)) { 3 } else { 4 };
        let is_plain = !is_fisheye && parameters.iter().skip(first).all(|k| *k == 0.0);
        each_lens!(self, camera => {
            if is_plain { Arc::new(CameraModel::pinhole(&camera)) } else { Arc::new(camera) }
        })
    }
}
