//! Selection of the objects to map, and their initial values.
use super::moving_objects;
use crate::mapping::measurements::{ObjectBox, ObjectMeasurements};
use crate::settings::{ObjectSettings, RunSettings};
use manifactor_formats::tum::StampedPose;
use manifactor_quadric::DualQuadric;
use manifactor_quadric::initialise::{ObjectView, parallax};
use serde::Serialize;
use std::fmt;

/// Reason why an object is not mapped.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "reason", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Rejection {
    /// Too few boxes passed the filters.
    Views {
        /// Number of boxes.
        views: usize,
        /// Required number.
        least: usize,
    },
    /// The sizes of its boxes differ too much.
    BoxDeviation {
        /// The larger of the standard deviations of width and height, in pixels.
        deviation_px: f64,
        /// Upper limit, in pixels.
        limit_px: f64,
    },
    /// The viewing directions differ too little.
    Parallax {
        /// Largest angle between two views, in degrees.
        parallax_deg: f64,
        /// Required angle, in degrees.
        least_deg: f64,
    },
    /// It moves, or several objects pass through its place in turn, according to the depths of its boxes
    /// within two seconds.
    Moves {
        /// Speed in m/s.
        speed: f64,
        /// Twice the log-likelihood ratio of this motion to standing still.
        evidence: f64,
        /// Upper limit.
        limit: f64,
    },
    /// Its depths differ too much within two seconds, so it is several objects.
    Scatters {
        /// Root mean square scatter of its position, relative to its depth.
        scatter: f64,
        /// Upper limit.
        limit: f64,
    },
    /// The fit of its ellipsoid does not reach a minimum.
    Stalled {
        /// End of the solve.
        termination: String,
    },
    /// Its estimated ellipsoid does not explain its boxes.
    Misfit {
        /// Median intersection over union of its boxes and the outline of the ellipsoid.
        overlap: f64,
        /// Lower limit.
        limit: f64,
    },
    /// The initialiser found no ellipsoid for its boxes.
    Initialisation {
        /// Message of the initialiser.
        message: String,
    },
}

impl Rejection {
    /// Returns the setting that would map the object, or advice for the recording.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Views { .. } => "`objects.min_views` sets the least number",
            Self::BoxDeviation { .. } => "`objects.max_box_deviation_px` sets the limit",
            Self::Parallax { .. } => "move around the object, or lower `objects.min_parallax_deg`",
            Self::Moves { .. } | Self::Scatters { .. } => {
                "larger errors of depths are allowed by `detections.depth_error`"
            }
            Self::Stalled { .. } => "see whether some of its boxes show another object",
            Self::Misfit { .. } => "`completion.min_overlap` sets the limit",
            Self::Initialisation { .. } => "try `objects.initialiser = { type = \"rays\" }`, or more views",
        }
    }
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Views { views, least } => {
                let boxes = if *views == 1 { "box" } else { "boxes" };
                write!(f, "{views} {boxes}, at least {least} are needed")
            }
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
            Self::Stalled { termination } => write!(f, "no ellipsoid is found for its boxes: {termination}"),
            Self::Misfit { overlap, limit } => write!(
                f,
                "its boxes and its ellipsoid overlap by {:.0} % (median), at least {:.0} % are needed: they show several objects, or the poses are wrong",
                100.0 * overlap,
                100.0 * limit
            ),
            Self::Initialisation { message } => f.write_str(message),
        }
    }
}

/// Returns the initial ellipsoid of an object, in the frame of the poses. `at` returns time and pose of a
/// frame.
pub fn initial_quadric(
    measured: &ObjectMeasurements,
    at: impl Fn(usize) -> Option<StampedPose>,
    RunSettings { objects: settings, detections, .. }: &RunSettings,
) -> Result<DualQuadric, Rejection> {
    if let Some(prior) = &measured.prior {
        return Ok(prior.quadric);
    }
    check_boxes(measured, settings)?;
    let seen = |view: &ObjectBox| {
        let pose = at(view.frame)?.pose;
        Some(ObjectView {
            observed: view.inside,
            depth: view.quantities.depth(),
            ..ObjectView::new(view.camera_pose(&pose), view.camera.model, view.bounding_box)
        })
    };
    let views: Vec<ObjectView> = measured.views.iter().filter_map(seen).collect();
    // the parallax compares all pairs of views, so skip it if there is no limit
    let parallax_deg = if *settings.min_parallax_deg > 0.0 { parallax(&views) } else { 0.0 };
    if parallax_deg < *settings.min_parallax_deg {
        return Err(Rejection::Parallax { parallax_deg, least_deg: *settings.min_parallax_deg });
    }
    let started = settings.initialiser.initialise(&views);
    let start = started.map_err(|error| Rejection::Initialisation { message: error.to_string() })?;
    check_still(measured, &measured.views, at, *detections.depth_error).map(|()| start)
}

/// Checks that an object stands still, according to the depths of these boxes. Objects of the prior map
/// always pass.
pub fn check_still(
    measured: &ObjectMeasurements,
    views: &[ObjectBox],
    at: impl Fn(usize) -> Option<StampedPose>,
    depth_error: f64,
) -> Result<(), Rejection> {
    if measured.prior.is_some() {
        return Ok(());
    }
    moving_objects::check_still(views, at, depth_error)
}

/// Checks that an object has enough boxes of consistent size. Objects of the prior map always pass.
pub fn check_boxes(measured: &ObjectMeasurements, settings: &ObjectSettings) -> Result<(), Rejection> {
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
