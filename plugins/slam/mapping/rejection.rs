//! Which objects are mapped, and where they begin.
use crate::measurements::Measured;
use crate::sequence::Sequence;
use crate::settings::ObjectSettings;
use manifactor_geometry::Se3;
use manifactor_quadric::DualQuadric;
use nalgebra::Vector3;
use serde::Serialize;
use std::fmt;

/// Why an object is not mapped.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "reason", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Rejection {
    /// Too few boxes passed the filters.
    Views {
        /// How many did.
        views: usize,
        /// How many there should be.
        least: usize,
    },
    /// Its boxes differ too much in size.
    BoxDeviation {
        /// The larger of the standard deviations of width and height, in pixels.
        deviation_px: f64,
        /// Where it should be below.
        limit_px: f64,
    },
    /// It is seen from one side only.
    Parallax {
        /// The largest angle between two views, in degrees.
        parallax_deg: f64,
        /// How large it should be.
        least_deg: f64,
    },
    /// No ellipsoid could be made of its boxes.
    Initialisation {
        /// What the initialiser says.
        message: String,
    },
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Views { views, least } => write!(f, "{views} boxes, at least {least} are needed"),
            Self::BoxDeviation { deviation_px, limit_px } => {
                write!(f, "its boxes' size deviates by {deviation_px:.1} px, allowed are less than {limit_px} px")
            }
            Self::Parallax { parallax_deg, least_deg } => {
                write!(f, "seen under {parallax_deg:.1}°, at least {least_deg}° are needed")
            }
            Self::Initialisation { message } => f.write_str(message),
        }
    }
}

/// The ellipsoid that an object begins with, in the frame of the poses.
pub(super) fn start(
    measured: &Measured,
    poses: &[Se3],
    sequence: &Sequence,
    settings: &ObjectSettings,
) -> Result<DualQuadric, Rejection> {
    let views = measured.views.len();
    if views < settings.min_views {
        return Err(Rejection::Views { views, least: settings.min_views });
    }
    let deviation_px = measured.box_deviation();
    if deviation_px >= settings.max_box_deviation_px {
        return Err(Rejection::BoxDeviation { deviation_px, limit_px: settings.max_box_deviation_px });
    }
    let quadric = todo_initialise();
    let parallax_deg = parallax(&centres, &quadric.centroid()).to_degrees();
    if parallax_deg < settings.min_parallax_deg {
        return Err(Rejection::Parallax { parallax_deg, least_deg: settings.min_parallax_deg });
    }
    Ok(quadric)
}

/// The largest angle between two of the directions to a point, in radians.
fn parallax(centres: &[Vector3<f64>], point: &Vector3<f64>) -> f64 {
    let rays: Vec<Vector3<f64>> = centres.iter().map(|centre| point - centre).collect();
    let others = |i: usize| rays.iter().skip(i + 1);
    let angles = rays.iter().enumerate().flat_map(|(i, ray)| others(i).map(|other| ray.angle(other)));
    angles.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parallax_is_the_widest_angle() {
        let centres = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.1, 0.0]].map(Vector3::from);
        let angle = parallax(&centres, &Vector3::zeros()).to_degrees();
        assert!((angle - 174.3).abs() < 0.1);
        assert_eq!(parallax(&centres[..1], &Vector3::zeros()), 0.0);
    }
}
