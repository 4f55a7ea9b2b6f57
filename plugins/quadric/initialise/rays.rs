//! Where lines of sight meet, with a size from the boxes.
use super::{InitialiseError, Initialiser, View, check_parallax, check_views, check_visible, shape};
use crate::shapes::DualQuadric;
use manifactor_graph::checked::NotNegative;
use manifactor_graph::register;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An ellipsoid where the middles of the boxes meet, with axes along the world's.
///
/// The centre is nearest to all planes through a camera and the middle of its box; the semi-axes make
/// the planes of the sides touch it best, drawn a little to a ball. Both are linear least squares: less
/// exact than `svd`, and much harder to upset, as every result is an ellipsoid. Two views will do. It is
/// rejected unless all of it is in front of every camera.
///
/// ```toml
/// initialiser = { type = "rays", min_views = 2, min_parallax = 1.0 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Rays {
    /// The least number of views, 2 or more.
    pub min_views: usize,
    /// The least angle between the lines of sight of two views, in degrees.
    pub min_parallax: NotNegative,
}

impl Default for Rays {
    fn default() -> Self {
        Self { min_views: 2, min_parallax: NotNegative::literal(1.0) }
    }
}

#[typetag::serialize(name = "rays")]
impl Initialiser for Rays {
    fn initialise(&self, views: &[View]) -> Result<DualQuadric, InitialiseError> {
        check_views(views, self.min_views.max(2))?;
        check_parallax(views, *self.min_parallax)?;
        let quadric = shape::ellipsoid(views, shape::centroid(views)?)?;
        check_visible(&quadric, views)?;
        Ok(quadric)
    }
}
register!(dyn Initialiser, "rays", Rays);
