//! Initial estimate from the intersection of lines of sight, with a size from the boxes.
use super::{InitialiseError, Initialiser, ObjectView, check_parallax, check_views, check_visible, shape};
use crate::shapes::DualQuadric;
use manifactor_graph::checked::NotNegative;
use manifactor_graph::register;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An ellipsoid at the intersection of the lines of sight, with axes along the world axes.
///
/// The centre is the point closest to all planes through a camera and the centre of its box. The semi-axes
/// make the ellipsoid touch the planes of the sides as closely as possible, with a weak pull towards a ball.
/// Both are linear least-squares problems. The result is less accurate than with `svd` but much more robust,
/// as it is always an ellipsoid. Two views are enough. The result is rejected unless the whole object is in
/// front of every camera.
///
/// ```toml
/// initialiser = { type = "rays", min_views = 2, min_parallax = 1.0 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Rays")]
pub struct RaysInitialiser {
    /// Minimum number of views, 2 or more.
    pub min_views: usize,
    /// Minimum angle between the lines of sight of two views, in degrees.
    pub min_parallax: NotNegative,
}

impl Default for RaysInitialiser {
    fn default() -> Self {
        Self { min_views: 2, min_parallax: NotNegative::literal(1.0) }
    }
}

#[typetag::serialize(name = "rays")]
impl Initialiser for RaysInitialiser {
    fn initialise(&self, views: &[ObjectView]) -> Result<DualQuadric, InitialiseError> {
        check_views(views, self.min_views.max(2))?;
        check_parallax(views, *self.min_parallax)?;
        let quadric = shape::ellipsoid(views, shape::centroid(views)?)?;
        check_visible(&quadric, views)?;
        Ok(quadric)
    }
}
register!(dyn Initialiser, "rays", RaysInitialiser);
