//! The map in 3D: the data that the page's own script draws, and the markup that it fills.
use crate::canvas::{Ink, Theme};
use crate::drawing::Palette;
use manifactor_geometry::Se3;
use manifactor_quadric::DualQuadric;
use manifactor_slam::record::{FrameRecord, ObjectRecord, RunRecord, TrackedPose, VariantRecord};
use serde_json::{Value, json};

pub(super) const MARKUP: &str = include_str!("assets/map.html");
/// In the order in which they use each other.
pub(super) const SCRIPTS: [&str; 6] = [
    include_str!("assets/algebra.js"),
    include_str!("assets/shapes.js"),
    include_str!("assets/renderer.js"),
    include_str!("assets/orbit.js"),
    include_str!("assets/panels.js"),
    include_str!("assets/map.js"),
];

/// All that the script draws. Metres to a hundredth of a millimetre and pixels to a tenth: no more is seen.
pub(super) fn data(run: &RunRecord) -> Value {
    let palette = Palette::of(run);
    let color = |ink: Ink| ink.hex(Theme::Light);
    json!({
        "colors": { "odometry": color(Ink::Odometry), "estimate": color(Ink::Estimate) },
        "variants": run.variants.iter().map(|variant| of_variant(variant, &palette)).collect::<Vec<_>>(),
    })
}

fn of_variant(variant: &VariantRecord, palette: &Palette) -> Value {
    let start = variant.frames.first().map_or(0.0, |frame| frame.timestamp);
    let camera = &variant.camera;
    let up = [variant.up.x, variant.up.y, variant.up.z].map(|x| rounded(x, 6));
    json!({
        "name": variant.name,
        "up": up,
        "camera": [camera.fx, camera.fy, camera.cx, camera.cy, f64::from(camera.width), f64::from(camera.height)],
        "frames": variant.frames.iter().map(|frame| of_frame(frame, start)).collect::<Vec<_>>(),
        "objects": variant.objects.iter().map(|object| of_object(object, palette)).collect::<Vec<_>>(),
    })
}

/// `[seconds, true pose, odometry, its error, estimate, its error, boxes]`
fn of_frame(frame: &FrameRecord, start: f64) -> Value {
    let tracked = |tracked: &TrackedPose| (pose(&tracked.pose), tracked.error.map(|x| rounded(x, 5)));
    let ((odometry, odometry_error), (estimate, error)) = (tracked(&frame.odometry), tracked(&frame.estimate));
    let boxes = frame.boxes.iter().map(|seen| {
        let pixels = |list: &[f64]| list.iter().map(|x| rounded(*x, 1)).collect::<Vec<_>>();
        json!([seen.object, pixels(&seen.measured.bounds()), seen.ellipse.map(|ellipse| pixels(&ellipse))])
    });
    let time = rounded(frame.timestamp - start, 3);
    let boxes: Vec<Value> = boxes.collect();
    json!([time, frame.truth.as_ref().map(pose), odometry, odometry_error, estimate, error, boxes])
}

fn of_object(object: &ObjectRecord, palette: &Palette) -> Value {
    let quadric = |q: &DualQuadric| [pose(&q.pose), q.semi_axes.iter().map(|x| rounded(*x, 5)).collect()].concat();
    let solid = object.truth.as_ref().map(|truth| {
        [pose(&truth.pose), truth.half_extents.iter().map(|x| rounded(*x, 5)).collect()].concat()
    });
    let factors = object.factors.iter().map(|factor| {
        let residual: Vec<f64> = factor.residual.iter().map(|x| rounded(*x, 3)).collect();
        json!({ "factor": factor.factor, "because": factor.because, "with": factor.with, "residual": residual })
    });
    let error = object.error.map(|e| [e.position, e.shape, e.quality].map(|x| rounded(x, 4)));
    json!({
        "id": object.id,
        "key": object.key,
        "class": object.class,
        "color": palette.ink(&object.class).hex(Theme::Light),
        "score": object.score.map(|x| rounded(x, 3)),
        "boxes": object.boxes,
        "box_rms": object.box_rms.map(|x| rounded(x, 3)),
        "estimate": object.estimate.as_ref().map(quadric),
        "truth": solid,
        "error": error,
        "factors": factors.collect::<Vec<_>>(),
        "left_out": object.left_out,
        "rejected": object.rejected,
    })
}

/// Position, then quaternion (x, y, z, w).
fn pose(pose: &Se3) -> Vec<f64> {
    pose.translation.iter().chain(&pose.rotation.quaternion_xyzw()).map(|x| rounded(*x, 5)).collect()
}

fn rounded(x: f64, digits: i32) -> f64 {
    let unit = 10f64.powi(digits);
    let near = (x * unit).round() / unit;
    // what is too large to be rounded has no such digits
    if near.is_finite() { near + 0.0 } else { x }
}
