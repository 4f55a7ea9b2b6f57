//! The dual quadric that touches the planes of all box sides, from a singular value decomposition.
use super::{InitialiseError, Initialiser, ObjectView, check_parallax, check_views, check_visible, shape};
use crate::shapes::DualQuadric;
use crate::shapes::OnHyperboloid;
use manifactor_graph::checked::NotNegative;
use manifactor_graph::register;
use nalgebra::{DMatrix, Dyn, Matrix4, SVD, Vector3, Vector4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Number of planes that determine the ten entries of Q* up to scale.
const MIN_PLANES: usize = 9;

/// The surface that touches the planes of all box sides: πᵀQ*π = 0, linear in Q*, by SVD.
///
/// Each side of each box gives a plane π = Pᵀl and a row (π₁², 2π₁π₂, …, π₄²) of equations for the ten
/// entries of Q*. The result is rejected unless it is an ellipsoid completely in front of every camera, so
/// that no camera is inside and every outline is an ellipse. If all views are from one side, noise often
/// makes it a hyperboloid; use `rays` as a fallback, see `first_of`.
///
/// With `normalised`, planes have unit normals, and lengths are relative to the intersection of the lines of
/// sight and the size of the object. The equations are solved with Q*₄₄ = -1. The result then does not depend
/// on the distance to the world origin. Without `normalised`, the rows are in pixels and Q* is the last right
/// singular vector, as in the code of Nicholson et al., QuadricSLAM; `on_hyperboloid = "absolute"` reproduces
/// that code.
///
/// ```toml
/// initialiser = { type = "svd", min_views = 3, normalised = true }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Svd")]
pub struct SvdInitialiser {
    /// Minimum number of views. 3 are sufficient if all their sides are observed.
    pub min_views: usize,
    /// Minimum angle between the lines of sight of two views, in degrees.
    pub min_parallax: NotNegative,
    /// Whether the system is scaled to be well conditioned.
    pub normalised: bool,
    /// Treatment of a surface that is not an ellipsoid: `reject`, or use the `absolute` values of its squared
    /// semi-axes.
    pub on_hyperboloid: OnHyperboloid,
}

impl Default for SvdInitialiser {
    fn default() -> Self {
        Self {
            min_views: 3,
            min_parallax: NotNegative::literal(0.0),
            normalised: true,
            on_hyperboloid: OnHyperboloid::Reject,
        }
    }
}

#[typetag::serialize(name = "svd")]
impl Initialiser for SvdInitialiser {
    fn initialise(&self, views: &[ObjectView]) -> Result<DualQuadric, InitialiseError> {
        check_views(views, self.min_views)?;
        check_parallax(views, *self.min_parallax)?;
        let found = views.iter().map(|v| v.lines().count()).sum();
        if found < MIN_PLANES {
            return Err(InitialiseError::TooFewSides { found, needed: MIN_PLANES });
        }
        let matrix = if self.normalised { normalised(views)? } else { null_space(&pixel_planes(views))? };
        let quadric = DualQuadric::from_matrix_or(&matrix, self.on_hyperboloid)?;
        check_visible(&quadric, views)?;
        Ok(quadric)
    }
}
register!(dyn Initialiser, "svd", SvdInitialiser);

/// Returns the planes π = Pᵀl of all observed sides.
fn pixel_planes(views: &[ObjectView]) -> Vec<Vector4<f64>> {
    let mut planes = vec![];
    for view in views {
        let projection = view.camera.projection(&view.world_from_camera);
        planes.extend(view.lines().map(|line| projection.tr_mul(&line)));
    }
    planes
}

/// Computes Q* from planes with unit normals, in a frame centred at the object and scaled by its size.
fn normalised(views: &[ObjectView]) -> Result<Matrix4<f64>, InitialiseError> {
    let origin = shape::centroid(views)?;
    let mut planes: Vec<Vector4<f64>> = vec![];
    for view in views {
        let from_camera: Vector3<f64> = origin - view.world_from_camera.translation;
        planes.extend(view.lines().map(|line| {
            let normal = view.normal(&line);
            normal.push(normal.dot(&from_camera))
        }));
    }
    let size = (planes.iter().map(|p| p.w * p.w).sum::<f64>() / planes.len() as f64).sqrt();
    if !(size.is_finite() && size > 0.0) {
        return Err(InitialiseError::Undetermined);
    }
    for plane in &mut planes {
        plane.w /= size;
    }
    // Transforms back: points x = size y + origin.
    let back = Matrix4::new_scaling(size).append_translation(&origin);
    Ok(back * with_unit_corner(&planes)? * back.transpose())
}

/// Returns the matrix of the equations πᵀQπ = 0 in the ten entries of the upper triangle of Q, by rows.
fn system(planes: &[Vector4<f64>]) -> DMatrix<f64> {
    // At least ten rows: with fewer, a thin decomposition omits the null space.
    let mut system = DMatrix::zeros(planes.len().max(10), 10);
    for (i, p) in planes.iter().enumerate() {
        let mut column = 0;
        for r in 0..4 {
            for c in r..4 {
                system[(i, column)] = p[r] * p[c] * if r == c { 1.0 } else { 2.0 };
                column += 1;
            }
        }
    }
    system
}

/// Returns the symmetric matrix of an upper triangle, given by rows.
fn symmetric(q: &[f64; 10]) -> Matrix4<f64> {
    Matrix4::new(
        q[0], q[1], q[2], q[3], //
        q[1], q[4], q[5], q[6], //
        q[2], q[5], q[7], q[8], //
        q[3], q[6], q[8], q[9],
    )
}

fn decomposed(system: DMatrix<f64>, left: bool) -> Result<SVD<f64, Dyn, Dyn>, InitialiseError> {
    SVD::try_new(system, left, true, f64::EPSILON, 1000).ok_or(InitialiseError::Undetermined)
}

/// Returns the Q of norm 1 that minimizes Σ(πᵀQπ)²: the last right singular vector.
fn null_space(planes: &[Vector4<f64>]) -> Result<Matrix4<f64>, InitialiseError> {
    let v_t = decomposed(system(planes), false)?.v_t.ok_or(InitialiseError::Undetermined)?;
    Ok(symmetric(&std::array::from_fn(|i| v_t[(9, i)])))
}

/// Returns the Q with Q₄₄ = -1 that minimizes Σ(πᵀQπ)².
///
/// Noise affects the offsets of the planes and thus the squared lengths, which are on the right-hand side. A
/// solution of norm 1 would also distribute the noise over the exact directions, which biases the surface
/// towards a hyperboloid.
fn with_unit_corner(planes: &[Vector4<f64>]) -> Result<Matrix4<f64>, InitialiseError> {
    let system = system(planes);
    let svd = decomposed(system.columns(0, 9).into_owned(), true)?;
    let tolerance = 1e-10 * svd.singular_values.max();
    if svd.singular_values.min() <= tolerance {
        return Err(InitialiseError::Undetermined);
    }
    let q = svd.solve(&system.column(9), tolerance).map_err(|_| InitialiseError::Undetermined)?;
    Ok(symmetric(&std::array::from_fn(|i| if i < 9 { q[i] } else { -1.0 })))
}
