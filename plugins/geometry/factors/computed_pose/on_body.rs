//! Factors on the pose of a body, for variables that are poses of a camera mounted on it.
use super::variable_names;
use crate::Se3;
use manifactor_graph::prelude::*;
use manifactor_graph::{
    AsVariable, Dynamic, DynamicBlocks, DynamicResidual, ErasedResidual, Factor, Variable, WrongRows,
    as_variable, register,
};
use nalgebra::{Matrix6, MatrixXx6};
use std::any::{Any, TypeId};
use std::borrow::Cow;
use std::sync::Arc;

/// A factor on the pose of a body, if the variable is the pose of a camera mounted on it.
///
/// The factor gets world_from_body = world_from_camera · body_from_camera⁻¹. An example is a position from a
/// satellite receiver, a loop closure between poses of a robot, or a box in the image of a second camera, which is then
/// the body. Rows and noise are those of `factor`. Without `body_from_camera`, that pose is a variable, the last one.
///
/// ```toml
/// [[factors]]
/// keys = ["x0", "x1"]
/// noise = { sigma = 0.1 }
///
/// [factors.factor]
/// type = "on_body"
/// body_from_camera = { translation = [0.2, 0.0, 0.5], rotation = [-0.5, 0.5, -0.5, 0.5] }
/// factor = { type = "between_se3", relative = { translation = [1.0, 0.0, 0.0], rotation = [0.0, 0.0, 0.0, 1.0] } }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Document", into = "Document")]
#[schemars(with = "Document")]
pub struct OnBody {
    document: Document,
    compiled: Dynamic<Compiled>,
}

#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "OnBody")]
struct Document {
    /// Factor with one or more variables of type `se3`.
    factor: Arc<dyn Factor>,
    /// Pose of the camera in the body frame. Default: it is a further variable of type `se3`, the last one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    body_from_camera: Option<Se3>,
    /// Variables that are poses of the camera, as indices into `keys` from 0. Default: all of type `se3`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    poses: Option<Vec<usize>>,
}

/// The reason why a factor cannot be used on a body.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OnBodyError {
    /// An index of `poses` is not that of a pose.
    #[error(
        "`poses` names variable {place}, but the factor has the variables {found}: expected indices of `se3`, from 0"
    )]
    NoPose {
        /// The index.
        place: usize,
        /// Types of the factor's variables.
        found: String,
    },
    /// The factor has no pose as a variable, or any number of variables.
    #[error("expected a factor with a fixed number of variables and a pose (`se3`) among them, got {found}")]
    NoPoses {
        /// Types of the factor's variables.
        found: String,
    },
    /// The factor has too many rows.
    #[error(transparent)]
    Rows(#[from] WrongRows),
}

impl OnBody {
    /// Creates a factor on poses of a camera from a factor on poses of a body. `body_from_camera` is the pose of the
    /// camera on the body; with `None`, it is the last variable. `poses` are the indices of the variables that are poses
    /// of the camera; `None` for all of type [`Se3`].
    ///
    /// # Errors
    /// If the factor has no such variables, has any number of variables, or has too many rows.
    pub fn new(
        factor: Arc<dyn Factor>,
        body_from_camera: impl Into<Option<Se3>>,
        poses: Option<Vec<usize>>,
    ) -> Result<Self, OnBodyError> {
        let signature = factor.erased().signature();
        let found = || variable_names(&signature);
        let mut types = signature.variables.clone();
        let is_pose = |place: &usize| types.get(*place) == Some(&TypeId::of::<Se3>());
        let places = match &poses {
            None => (0..types.len()).filter(is_pose).collect(),
            Some(places) => places.clone(),
        };
        if let Some(place) = places.iter().copied().find(|place| !is_pose(place)) {
            return Err(OnBodyError::NoPose { place, found: found() });
        }
        if signature.many || places.is_empty() {
            return Err(OnBodyError::NoPoses { found: found() });
        }
        let body_from_camera = body_from_camera.into();
        let moved = (0..types.len()).map(|place| places.contains(&place)).collect();
        if body_from_camera.is_none() {
            types.push(TypeId::of::<Se3>());
        }
        let casts: Vec<_> = types.iter().filter_map(|id| as_variable(*id)).collect();
        let compiled = Dynamic::new(Compiled {
            extrinsics: body_from_camera.as_ref().map(Extrinsics::new),
            moved,
            dimensions: casts.iter().map(|cast| cast.dimension).collect(),
            rows: signature.rows.unwrap_or(0),
            factor: factor.clone(),
            types,
            casts,
        })?;
        Ok(Self { document: Document { factor, body_from_camera, poses }, compiled })
    }

    /// Returns the innermost factor of an `on_body` factor, or the factor itself if it is of another type.
    pub fn unwrapped(mut factor: &dyn Factor) -> &dyn Factor {
        while let Some((inner, _)) = Self::content(factor) {
            factor = &**inner;
        }
        factor
    }

    /// Returns the factor that an `on_body` factor contains, with the pose of the camera on the body if it is constant.
    /// `None` for other types.
    pub fn content(factor: &dyn Factor) -> Option<(&Arc<dyn Factor>, Option<&Se3>)> {
        let compiled = factor.erased().as_any().downcast_ref::<Compiled>()?;
        Some((&compiled.factor, compiled.extrinsics.as_ref().map(|own| &own.body_from_camera)))
    }
}

impl TryFrom<Document> for OnBody {
    type Error = OnBodyError;
    fn try_from(document: Document) -> Result<Self, OnBodyError> {
        Self::new(document.factor, document.body_from_camera, document.poses)
    }
}

impl From<OnBody> for Document {
    fn from(factor: OnBody) -> Self {
        factor.document
    }
}

#[typetag::serialize(name = "on_body")]
impl Factor for OnBody {
    #[inline(never)]
    fn erased(&self) -> &dyn ErasedResidual {
        &self.compiled
    }
    fn with_up(&self, up: manifactor_graph::Direction) -> Option<Box<dyn Factor>> {
        let Document { factor, body_from_camera, poses } = &self.document;
        let filled = Self::new(factor.with_up(up)?.into(), *body_from_camera, poses.clone()).ok()?;
        Some(Box::new(filled))
    }
}
register!(dyn Factor, "on_body", OnBody);

/// The factor with its inputs looked up.
#[derive(Debug, Clone)]
struct Compiled {
    factor: Arc<dyn Factor>,
    /// `None` if the pose of the camera is the last variable.
    extrinsics: Option<Extrinsics>,
    /// For each variable of `factor`, whether it is a pose of the camera.
    moved: Vec<bool>,
    types: Vec<TypeId>,
    dimensions: Vec<usize>,
    casts: Vec<&'static AsVariable>,
    rows: usize,
}

/// Pose E of the camera in the body frame.
#[derive(Debug, Clone)]
struct Extrinsics {
    body_from_camera: Se3,
    camera_from_body: Se3,
    /// Step of the body for a step of the camera: X exp(δ) E⁻¹ = X E⁻¹ exp(Ad(E) δ).
    step: Matrix6<f64>,
}

impl Extrinsics {
    fn new(body_from_camera: &Se3) -> Self {
        let (camera_from_body, step) = (body_from_camera.inverse(), body_from_camera.adjoint());
        Self { body_from_camera: *body_from_camera, camera_from_body, step }
    }
}

impl Compiled {
    /// Returns the pose of the camera on the body, constant or from the variables.
    fn extrinsics(&self, variables: &[&dyn Any]) -> Option<Cow<'_, Extrinsics>> {
        match &self.extrinsics {
            Some(constant) => Some(Cow::Borrowed(constant)),
            None => Some(Cow::Owned(Extrinsics::new(variables.last()?.downcast_ref()?))),
        }
    }

    /// Returns what `run` returns for the variables with poses of the body.
    fn with_body<R>(
        &self,
        variables: &[&dyn Any],
        run: impl FnOnce(&dyn ErasedResidual, &[&dyn Variable]) -> Option<R>,
    ) -> Option<R> {
        let extrinsics = self.extrinsics(variables)?;
        let body = |(variable, moved): (&&dyn Any, &bool)| {
            let pose = variable.downcast_ref::<Se3>().filter(|_| *moved)?;
            Some(pose.compose(&extrinsics.camera_from_body))
        };
        let bodies: Vec<Option<Se3>> = variables.iter().zip(&self.moved).map(body).collect();
        let given = variables.iter().zip(&self.casts).map(|(x, to)| (to.cast)(*x));
        let inner: Vec<&dyn Variable> = given
            .zip(&bodies)
            .filter_map(|(given, body)| body.as_ref().map(|body| body as &dyn Variable).or(given))
            .collect();
        run(self.factor.erased(), &inner)
    }
}

impl DynamicResidual for Compiled {
    fn rows(&self) -> usize {
        self.rows
    }
    fn variables(&self) -> &[TypeId] {
        &self.types
    }
    fn dimensions(&self) -> &[usize] {
        &self.dimensions
    }
    fn is_defined(&self, variables: &[&dyn Any]) -> bool {
        self.with_body(variables, |factor, x| factor.is_defined(x)).unwrap_or(false)
    }
    fn residual(&self, variables: &[&dyn Any], residual: &mut [f64]) {
        if let Some(rows) = self.with_body(variables, |factor, x| factor.residual(x)) {
            residual.copy_from_slice(&rows);
        }
    }
    fn linearize(
        &self,
        variables: &[&dyn Any],
        free: &[bool],
        residual: &mut [f64],
        blocks: &mut DynamicBlocks,
    ) {
        let Some(linear) = self.with_body(variables, |factor, x| factor.linearize(x)) else { return };
        let Some(extrinsics) = self.extrinsics(variables) else { return };
        residual.copy_from_slice(&linear.residual);
        // X (E exp(δ))⁻¹ = X E⁻¹ exp(-Ad(E) δ)
        let mut by_extrinsics = MatrixXx6::zeros(self.rows);
        for (place, jacobian) in linear.jacobians.iter().enumerate() {
            let by_pose = self.moved[place].then(|| jacobian * extrinsics.step);
            if let Some(by_pose) = &by_pose {
                by_extrinsics -= by_pose;
            }
            if free[place] {
                let own = by_pose.as_ref().map_or(jacobian.as_slice(), MatrixXx6::as_slice);
                blocks.block_mut(place).copy_from_slice(own);
            }
        }
        let last = linear.jacobians.len();
        if self.extrinsics.is_none() && free[last] {
            blocks.block_mut(last).copy_from_slice(by_extrinsics.as_slice());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Between;
    use crate::testing::*;
    use manifactor_graph::Manifold;
    use manifactor_testing::{JacobianLaw, factor_laws};
    use nalgebra::{Vector3, Vector6};
    use proptest::prelude::*;

    factor_laws! { on_body }

    proptest! {
        #[test]
        fn it_is_the_factor_of_the_body(
            (a, b, e) in (any_se3(), any_se3(), any_se3()), d in se3_tangent(),
        ) {
            let inner = Between { relative: a.inverse().compose(&b).retract(&(0.3 * d)) };
            let outer = OnBody::new(Arc::new(inner.clone()), e, None).unwrap();
            let seen = outer.erased().residual(&[&a.compose(&e), &b.compose(&e)]).unwrap();
            let expected = inner.erased().residual(&[&a, &b]).unwrap();
            let difference = Vector6::from_vec(seen) - Vector6::from_column_slice(&expected);
            prop_assert!(difference.norm() < 1e-9, "{difference}");
            JacobianLaw::default().check(&outer, &[&a.compose(&e), &b.compose(&e)]).unwrap();
            let free = OnBody::new(Arc::new(inner), None, None).unwrap();
            let same = free.erased().residual(&[&a.compose(&e), &b.compose(&e), &e]).unwrap();
            prop_assert!((Vector6::from_vec(same) - Vector6::from_vec(expected)).norm() < 1e-9);
            JacobianLaw::default().check(&free, &[&a.compose(&e), &b.compose(&e), &e]).unwrap();
        }
    }

    #[test]
    fn variables_that_are_no_poses_of_the_camera_stay() {
        let lever = Se3::new(crate::So3::identity(), Vector3::new(0.0, 0.0, 0.5));
        let marker = Between { relative: Se3::identity() };
        let of_first = OnBody::new(Arc::new(marker), lever, Some(vec![0])).unwrap();
        let rows = of_first.erased().residual(&[&lever, &Se3::identity()]).unwrap();
        assert!(rows.iter().all(|row| row.abs() < 1e-12), "{rows:?}");
    }

    #[test]
    fn a_factor_without_a_pose_is_refused() {
        let read = |fields: &str| {
            let text = format!(
                r#"{{"body_from_camera": {{"translation": [0,0,0], "rotation": [0,0,0,1]}}, {fields}}}"#
            );
            serde_json::from_str::<OnBody>(&text)
        };
        let between = r#""factor": {"type": "between_se3", "relative": {"translation": [1,0,0], "rotation": [0,0,0,1]}}"#;
        let written = serde_json::to_string(&read(between).unwrap()).unwrap();
        assert_eq!(
            serde_json::to_string(&serde_json::from_str::<OnBody>(&written).unwrap()).unwrap(),
            written
        );
        let error = read(r#""factor": {"type": "between_point2", "relative": {"position": [1, 0]}}"#)
            .unwrap_err()
            .to_string();
        assert!(error.contains("point2, point2"), "{error}");
        let error = read(&format!(r#"{between}, "poses": [2]"#)).unwrap_err().to_string();
        assert!(error.contains("names variable 2"), "{error}");
    }
}
