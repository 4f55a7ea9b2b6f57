//! Which objects are mapped, and where they begin.
use crate::mapping::measurements::{Measured, ObjectBox};
use crate::settings::{ObjectSettings, Settings};
use manifactor_geometry::Se3;
use manifactor_quadric::initialise::{View, parallax};
use manifactor_quadric::{Camera, DualQuadric};
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
    /// It does not stand still: by the depths of its boxes.
    Moves {
        /// How far it moves while it is seen, in metres.
        way_m: f64,
        /// Half its length, or three standard deviations of its depths, if that is more, in metres.
        limit_m: f64,
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
                write!(
                    f,
                    "its boxes' size deviates by {deviation_px:.1} px, allowed are less than {limit_px} px"
                )
            }
            Self::Parallax { parallax_deg, least_deg } => {
                write!(f, "seen under {parallax_deg:.1}°, at least {least_deg}° are needed")
            }
            Self::Moves { way_m, limit_m } => {
                write!(f, "it moves by {way_m:.2} m while it is seen, allowed are {limit_m:.2} m")
            }
            Self::Initialisation { message } => f.write_str(message),
        }
    }
}

/// The ellipsoid that an object begins with, in the frame of the poses; `pose` gives that of a frame.
pub(crate) fn start(
    measured: &Measured,
    pose: impl Fn(usize) -> Option<Se3>,
    camera: Camera,
    Settings { objects: settings, detections, .. }: &Settings,
) -> Result<DualQuadric, Rejection> {
    if let Some(prior) = &measured.prior {
        return Ok(prior.quadric);
    }
    sound(measured, settings)?;
    let seen = |view: &ObjectBox| {
        let pose = pose(view.frame)?;
        Some(View { observed: view.inside, depth: view.depth, ..View::new(pose, camera, view.bounding_box) })
    };
    let views: Vec<View> = measured.views.iter().filter_map(seen).collect();
    // over all pairs of views, so it is left out where any will do
    let parallax_deg = if settings.min_parallax_deg > 0.0 { parallax(&views) } else { 0.0 };
    if parallax_deg < settings.min_parallax_deg {
        return Err(Rejection::Parallax { parallax_deg, least_deg: settings.min_parallax_deg });
    }
    let started = settings.initialiser.initialise(&views);
    let start = started.map_err(|error| Rejection::Initialisation { message: error.to_string() })?;
    still(measured, pose, &camera, &start, detections.depth_error).map(|()| start)
}

/// Of an object's boxes so many are looked at for motion, from the first to the last.
const PLACES: usize = 128;

/// Whether an object that began so stands still, as far as the depths of its boxes tell.
pub(crate) fn still(
    measured: &Measured,
    pose: impl Fn(usize) -> Option<Se3>,
    camera: &Camera,
    start: &DualQuadric,
    depth_error: f64,
) -> Result<(), Rejection> {
    if measured.prior.is_some() {
        return Ok(());
    }
    let mut depths = 0.0;
    let mut place = |view: &ObjectBox| {
        // the centre of a box that the border cuts is not that of the object
        let (depth, pose) = (view.depth.filter(|_| view.inside == [true; 4])?, pose(view.frame)?);
        depths += depth;
        Some((view.frame as f64, pose.act(&(camera.ray(view.bounding_box.centre()) * depth))))
    };
    // with each new box, so that all of them would be looked at again and again
    let step = measured.views.len().div_ceil(PLACES).max(1);
    let places: Vec<(f64, Vector3<f64>)> =
        measured.views.iter().rev().step_by(step).rev().filter_map(&mut place).collect();
    let doubt_m = 3.0 * depth_error * depths / places.len().max(1) as f64;
    let (way_m, limit_m) = (way(&places), start.semi_axes.max().max(doubt_m));
    if way_m > limit_m { Err(Rejection::Moves { way_m, limit_m }) } else { Ok(()) }
}

/// How far something moves that was in these places at these times: along a line, by least squares.
fn way(places: &[(f64, Vector3<f64>)]) -> f64 {
    let (Some((first, _)), Some((last, _))) = (places.first(), places.last()) else { return 0.0 };
    let n = places.len() as f64;
    let mean = places.iter().map(|(time, _)| time).sum::<f64>() / n;
    let square: f64 = places.iter().map(|(time, _)| (time - mean).powi(2)).sum();
    let sum: Vector3<f64> = places.iter().map(|(time, place)| place * (time - mean)).sum();
    if square > 0.0 { sum.norm() / square * (last - first) } else { 0.0 }
}

/// Whether an object has boxes enough, and such as one object has; what an earlier map has needs none.
pub(crate) fn sound(measured: &Measured, settings: &ObjectSettings) -> Result<(), Rejection> {
    if measured.prior.is_some() {
        return Ok(());
    }
    let views = measured.views.len();
    if views < settings.min_views {
        return Err(Rejection::Views { views, least: settings.min_views });
    }
    let deviation_px = measured.box_deviation();
    if deviation_px >= settings.max_box_deviation_px {
        return Err(Rejection::BoxDeviation { deviation_px, limit_px: settings.max_box_deviation_px });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_is_that_of_the_line_through_the_places() {
        let at = |time: f64, x: f64| (time, Vector3::new(x, 0.0, 7.0));
        assert!((way(&[at(3.0, 1.0), at(4.0, 2.1), at(5.0, 2.9), at(6.0, 4.0)]) - 2.94).abs() < 1e-12);
        assert_eq!((way(&[]), way(&[at(3.0, 1.0)]), way(&[at(3.0, 1.0), at(3.0, 2.0)])), (0.0, 0.0, 0.0));
    }
}
