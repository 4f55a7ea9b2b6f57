//! Initial estimate from a box and the depth at its centre; one view is enough.
use super::{InitialiseError, Initialiser, ObjectView, check_views, check_visible, shape};
use crate::shapes::DualQuadric;
use manifactor_graph::checked::NotNegative;
use manifactor_graph::register;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An ellipsoid behind the surface measured at the centre of the box, with axes along the world axes.
///
/// The depth belongs to the surface; the centre is deeper by `thickness` times the mean of half the width and
/// half the height. Several views are averaged. The semi-axes follow from the sides of the boxes as for
/// `rays`. A single view does not determine the extent along the line of sight, so the extent of a ball is
/// used. Views without a depth contribute only their sides. The result is rejected unless the whole object is
/// in front of every camera.
///
/// ```toml
/// initialiser = { type = "depth", thickness = 1.0 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Depth")]
pub struct DepthInitialiser {
    /// Depth of objects relative to their width and height: 1 for a ball, 0 if the measured depth belongs to
    /// the centre.
    pub thickness: NotNegative,
}

impl Default for DepthInitialiser {
    fn default() -> Self {
        Self { thickness: NotNegative::literal(1.0) }
    }
}

impl DepthInitialiser {
    /// Returns the centre in the world frame.
    fn centroid(&self, view: &ObjectView) -> Option<Vector3<f64>> {
        let depth = view.depth.filter(|depth| *depth > 0.0)?;
        let (b, camera) = (&view.bounding_box, &view.camera);
        // Half the size at depth 1. The clamp handles boxes too large for an object behind the surface.
        let half = (b.width() / camera.fx + b.height() / camera.fy) / 4.0;
        let z = depth / (1.0 - (*self.thickness * half).clamp(0.0, 0.5));
        Some(view.world_from_camera.act(&(camera.ray(b.centre()) * z)))
    }
}

#[typetag::serialize(name = "depth")]
impl Initialiser for DepthInitialiser {
    fn initialise(&self, views: &[ObjectView]) -> Result<DualQuadric, InitialiseError> {
        check_views(views, 1)?;
        let (mut sum, mut count) = (Vector3::zeros(), 0);
        for centroid in views.iter().filter_map(|view| self.centroid(view)) {
            sum += centroid;
            count += 1;
        }
        if count == 0 {
            return Err(InitialiseError::NoDepth);
        }
        let quadric = shape::ellipsoid(views, sum / f64::from(count))?;
        check_visible(&quadric, views)?;
        Ok(quadric)
    }
}
register!(dyn Initialiser, "depth", DepthInitialiser);
