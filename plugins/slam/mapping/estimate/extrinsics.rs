//! Errors in the poses of further cameras on the body, from their boxes.
//!
//! The poses of the frames are held. For each camera, one Gauss-Newton step estimates its pose on the body jointly with
//! the objects, which are eliminated by their Schur complement.
use super::Estimate;
use manifactor_geometry::OnBody;
use manifactor_graph::batch::FactorState;
use manifactor_graph::{FactorEntry, Key};
use manifactor_quadric::BoundingBoxFactor;
use manifactor_recording::camera::MountedCamera;
use nalgebra::{Cholesky, DVector, Matrix6, SMatrix, SVector, Vector6};
use std::collections::BTreeMap;

/// The pose of a camera on the body that fits its boxes better.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtrinsicsError {
    /// Name of the camera.
    pub camera: String,
    /// Angle between the given and the better rotation. Unit: radians.
    pub rotation: f64,
    /// Standard deviation of the rotation about its axis. Unit: radians.
    pub rotation_sigma: f64,
}

/// Smallest rotation that is reported, in radians: 1°.
const MIN_ROTATION: f64 = 0.017;
/// Smallest rotation that is reported, in standard deviations. Errors of a detector persist over many frames and look
/// like rotations.
const MIN_ROTATION_SIGMAS: f64 = 10.0;

/// Number of sides of a box.
const SIDES: usize = 4;

/// Normal equations of a camera's pose, with those of one object.
#[derive(Clone)]
struct ObjectEquations {
    by_camera: SMatrix<f64, 6, 9>,
    of_object: SMatrix<f64, 9, 9>,
}

/// A box of a camera, whitened.
struct WhitenedBox<'a> {
    object: &'a Key,
    residual: SVector<f64, SIDES>,
    /// By the pose of the camera.
    by_camera: SMatrix<f64, SIDES, 6>,
    by_object: SMatrix<f64, SIDES, 9>,
    /// True if it is a box of the camera in question.
    is_own: bool,
}

impl Estimate {
    /// Returns the further cameras whose boxes contradict their pose on the body.
    pub fn extrinsics_errors(&self) -> Vec<ExtrinsicsError> {
        self.sequence.cameras.iter().skip(1).filter_map(|camera| self.extrinsics_error(camera)).collect()
    }

    fn extrinsics_error(&self, camera: &MountedCamera) -> Option<ExtrinsicsError> {
        let (mut information, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
        let mut objects: BTreeMap<&Key, ObjectEquations> = BTreeMap::new();
        let none = ObjectEquations { by_camera: SMatrix::zeros(), of_object: SMatrix::zeros() };
        for state in self.solution.factors.iter().filter(|state| state.defined) {
            let Some(entry) = self.mapping.graph.factors().get(state.entry) else { continue };
            let Some(seen) = self.whitened_box(entry, state, camera) else { continue };
            let equations = objects.entry(seen.object).or_insert_with(|| none.clone());
            equations.of_object += seen.by_object.tr_mul(&seen.by_object);
            if seen.is_own {
                equations.by_camera += seen.by_camera.tr_mul(&seen.by_object);
                information += seen.by_camera.tr_mul(&seen.by_camera);
                gradient += seen.by_camera.tr_mul(&seen.residual);
            }
        }
        for ObjectEquations { by_camera, mut of_object } in objects.into_values() {
            // directions that the boxes of an object leave open are no information about the camera
            let scale = of_object.trace();
            of_object += SMatrix::<f64, 9, 9>::identity() * (scale * f64::EPSILON.sqrt());
            if let Some(inverse) = Cholesky::new(of_object).map(|factor| factor.inverse()) {
                information -= by_camera * inverse * by_camera.transpose();
            }
        }
        let factor = Cholesky::new(information)?;
        let (step, covariance) = (-factor.solve(&gradient), factor.inverse());
        let rotation = step.fixed_rows::<3>(0).into_owned();
        let axis = rotation.try_normalize(0.0)?;
        let sigma = axis.dot(&(covariance.fixed_view::<3, 3>(0, 0) * axis)).max(0.0).sqrt();
        let (rotation, rotation_sigma) = (rotation.norm(), sigma);
        tracing::info!(
            camera = camera.name,
            "its boxes turn it by {:.2}° ± {:.2}°",
            rotation.to_degrees(),
            rotation_sigma.to_degrees()
        );
        let is_wrong = rotation > MIN_ROTATION && rotation > MIN_ROTATION_SIGMAS * rotation_sigma;
        is_wrong.then(|| ExtrinsicsError { camera: camera.name.clone(), rotation, rotation_sigma })
    }

    /// Returns a box at the estimate; `None` for other factors.
    fn whitened_box<'a>(
        &self,
        entry: &'a FactorEntry,
        state: &FactorState,
        camera: &MountedCamera,
    ) -> Option<WhitenedBox<'a>> {
        let (factor, first_from) = OnBody::unwrapped(&*entry.factor);
        factor.erased().as_any().downcast_ref::<BoundingBoxFactor>()?;
        let [pose, object] = &entry.keys[..] else { return None };
        let variables = [pose, object].map(|key| self.solution.values.variable(key.as_str()));
        let linear = entry.factor.erased().linearize(&[variables[0]?, variables[1]?])?;
        let [by_first, by_object] = &linear.jacobians[..] else { return None };
        let first_from_camera = camera.first_from_camera?;
        let whitening = entry.noise.whitener(SIDES).ok()?.matrix(SIDES) * state.weight.sqrt();
        let residual = DVector::from_column_slice(&state.whitened) * state.weight.sqrt();
        // F exp(δ) E = F E exp(Ad(E⁻¹) δ), with the pose F of the first camera and the pose E of this one on it
        let by_camera = by_first * first_from_camera.adjoint();
        Some(WhitenedBox {
            object,
            residual: residual.fixed_rows::<SIDES>(0).into_owned(),
            by_camera: (&whitening * by_camera).fixed_view::<SIDES, 6>(0, 0).into_owned(),
            by_object: (&whitening * by_object).fixed_view::<SIDES, 9>(0, 0).into_owned(),
            is_own: first_from == Some(&first_from_camera.inverse()),
        })
    }
}
