//! Intrinsics of a camera as a variable.
use crate::UncalibratedModel;
use crate::bundle::camera_model::{CameraNames, UncalibratedName};
use manifactor_graph::{Dimension, Jet, JetOf, Manifold, Scalar, Vector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The intrinsics of a camera as a variable, which several images can share.
///
/// Tangent: [`UncalibratedModel::INTRINSICS`], each additive. The size of the image and what is not among the intrinsics,
/// such as a skew, are constants.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent, bound = "M: UncalibratedModel")]
#[schemars(bound = "M: UncalibratedModel + CameraNames + UncalibratedName", description = description::<M>())]
pub struct Intrinsics<M>(pub M);

fn description<M: UncalibratedModel + CameraNames + UncalibratedName>() -> String {
    let tangent = M::INTRINSICS.join(", ");
    let numbers = M::EXAMPLE.trim_start_matches('{');
    let (name, factor) = (M::MODEL, M::UNCALIBRATED);
    format!(
        "The intrinsics of a camera, for `{factor}`.\n\nTangent ({tangent}), each additive; the size of the image is a \
         constant. Several images can share them.\n\n```toml\n[values]\ncamera = {{ type = \"{name}\",{numbers}\n```"
    )
}

/// [`Intrinsics`] over a scalar: what residuals get.
#[derive(Debug, Clone, Copy)]
pub struct IntrinsicsOver<M: UncalibratedModel, T: Scalar> {
    camera: M,
    numbers: Vector<M::Dim, T>,
}

impl<M: UncalibratedModel, T: Scalar> IntrinsicsOver<M, T> {
    /// Returns the pixel of a point that the camera [sees](crate::CameraModel::sees).
    #[inline(always)]
    pub fn project(&self, point: &nalgebra::Vector3<T>) -> nalgebra::Vector2<T> {
        self.camera.project_with(&self.numbers, point)
    }
}

impl<M: UncalibratedModel> Manifold for Intrinsics<M> {
    type Dim = M::Dim;
    type Of<T: Scalar> = IntrinsicsOver<M, T>;
    const TANGENT: &'static [&'static str] = M::INTRINSICS;

    #[inline]
    fn lift<T: Scalar>(&self) -> IntrinsicsOver<M, T> {
        IntrinsicsOver { camera: self.0.clone(), numbers: self.0.lifted() }
    }

    #[inline]
    fn seed(&self) -> IntrinsicsOver<M, JetOf<M::Dim>> {
        let numbers = self.0.intrinsics();
        let unit = |i: usize| M::Dim::vector(|k| if k == i { 1.0 } else { 0.0 });
        let jet = |i: usize| JetOf::<M::Dim>::with_gradient(numbers.as_ref()[i], unit(i).as_ref());
        IntrinsicsOver { camera: self.0.clone(), numbers: M::Dim::vector(jet) }
    }

    fn retract(&self, delta: &Vector<M::Dim>) -> Self {
        let numbers = self.0.intrinsics();
        let moved = M::Dim::vector(|i| numbers.as_ref()[i] + delta.as_ref()[i]);
        Self(self.0.with_intrinsics(&moved))
    }

    fn local(&self, other: &Self) -> Vector<M::Dim> {
        let (from, to) = (self.0.intrinsics(), other.0.intrinsics());
        M::Dim::vector(|i| to.as_ref()[i] - from.as_ref()[i])
    }

    fn coordinate(&self, direction: usize) -> Option<f64> {
        self.0.intrinsics().as_ref().get(direction).copied()
    }

    fn is_finite(&self) -> bool {
        self.0.intrinsics().as_ref().iter().all(|x| x.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use crate::testing::*;
    use manifactor_testing::manifold_laws;
    use manifactor_testing::strategies::vector;

    manifold_laws! {
        pinhole: (any_pinhole(), any_pinhole(), vector::<4>(10.0));
        radial: (any_radial(), any_radial(), vector::<5>(10.0));
        radial_tangential: (any_radial_tangential(), any_radial_tangential(), vector::<8>(10.0));
        kannala_brandt: (any_kannala_brandt(), any_kannala_brandt(), vector::<8>(10.0))
    }
}
