//! Which objects are mapped, and where they begin.
use super::moving_objects;
use crate::mapping::measurements::{Measured, ObjectBox};
use crate::settings::{ObjectSettings, Settings};
use manifactor_formats::tum::StampedPose;
use manifactor_quadric::initialise::{View, parallax};
use manifactor_quadric::{Camera, DualQuadric};
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
    /// It does not stand still, or one thing after the other passes through its place: by the depths of its boxes within two seconds.
    Moves {
        /// How fast, in m/s.
        speed: f64,
        /// Twice the log-likelihood ratio of that to standing still.
        evidence: f64,
        /// What is allowed.
        limit: f64,
    },
    /// Its depths differ too much within two seconds: it is several things.
    Scatters {
        /// Root mean square by which it seems to be elsewhere, as a part of its depth.
        scatter: f64,
        /// What is allowed.
        limit: f64,
    },
    /// No ellipsoid could be made of its boxes.
    Initialisation {
        /// What the initialiser says.
        message: String,
    },
}

impl Rejection {
    /// The setting that would map the object, or what to change in the recording.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Views { .. } => "`objects.min_views` sets the least number",
            Self::BoxDeviation { .. } => "`objects.max_box_deviation_px` sets the limit",
            Self::Parallax { .. } => "move around the object, or lower `objects.min_parallax_deg`",
            Self::Moves { .. } | Self::Scatters { .. } => {
                "larger errors of depths are allowed by `detections.depth_error`"
            }
            Self::Initialisation { .. } => "try `objects.initialiser = { type = \"rays\" }`, or more views",
        }
    }
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
            Self::Moves { speed, evidence, limit } => write!(
                f,
                "it moves at {speed:.1} m/s; twice the log-likelihood ratio of that to standing still is {evidence:.0}, allowed are {limit}"
            ),
            Self::Scatters { scatter, limit } => write!(
                f,
                "within seconds it seems to be in places that differ by {:.1} % of their depth, allowed are {:.1} %: it is several things, \
                 or `detections.depth_error` is too small",
                100.0 * scatter,
                100.0 * limit
            ),
            Self::Initialisation { message } => f.write_str(message),
        }
    }
}

/// The ellipsoid that an object begins with, in the frame of the poses; `at` has the time and pose of a frame.
pub fn start(
    measured: &Measured,
    at: impl Fn(usize) -> Option<StampedPose>,
    camera: Camera,
    Settings { objects: settings, detections, .. }: &Settings,
) -> Result<DualQuadric, Rejection> {
    if let Some(prior) = &measured.prior {
        return Ok(prior.quadric);
    }
    sound(measured, settings)?;
    let seen = |view: &ObjectBox| {
        let pose = at(view.frame)?.pose;
        Some(View {
            observed: view.inside,
            depth: view.quantities.depth(),
            ..View::new(pose, camera, view.bounding_box)
        })
    };
    let views: Vec<View> = measured.views.iter().filter_map(seen).collect();
    // over all pairs of views, so it is left out where any will do
    let parallax_deg = if *settings.min_parallax_deg > 0.0 { parallax(&views) } else { 0.0 };
    if parallax_deg < *settings.min_parallax_deg {
        return Err(Rejection::Parallax { parallax_deg, least_deg: *settings.min_parallax_deg });
    }
    let started = settings.initialiser.initialise(&views);
    let start = started.map_err(|error| Rejection::Initialisation { message: error.to_string() })?;
    still(measured, &measured.views, at, &camera, *detections.depth_error).map(|()| start)
}

/// Returns whether an object stands still, as far as the depths of these boxes of it tell; what an earlier map has does.
pub fn still(
    measured: &Measured,
    views: &[ObjectBox],
    at: impl Fn(usize) -> Option<StampedPose>,
    camera: &Camera,
    depth_error: f64,
) -> Result<(), Rejection> {
    if measured.prior.is_some() {
        return Ok(());
    }
    moving_objects::still(views, at, camera, depth_error)
}

/// Returns whether an object has boxes enough, and such as one object has; what an earlier map has needs none.
pub fn sound(measured: &Measured, settings: &ObjectSettings) -> Result<(), Rejection> {
    if measured.prior.is_some() {
        return Ok(());
    }
    let views = measured.views.len();
    if views < settings.min_views {
        return Err(Rejection::Views { views, least: settings.min_views });
    }
    let deviation_px = measured.box_deviation();
    if deviation_px >= *settings.max_box_deviation_px {
        return Err(Rejection::BoxDeviation { deviation_px, limit_px: *settings.max_box_deviation_px });
    }
    Ok(())
}
