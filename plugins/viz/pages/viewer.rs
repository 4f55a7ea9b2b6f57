//! The map in 3D: the data and the markup for the page's script.
use crate::canvas::{Ink, Theme};
use crate::drawing::Palette;
use manifactor_geometry::Se3;
use manifactor_graph::Direction;
use manifactor_quadric::{BoundingBox, Camera, DualQuadric};
use manifactor_slam::record::{
    BoxRecord, FrameRecord, ObjectRecord, PoseRecord, RunRecord, TrueCuboid, VariantRecord,
};
use serde_json::{Value, json};

pub(super) const MARKUP: &str = include_str!("assets/map.html");
/// Scripts of every view in 3D, in order of their dependencies. A page adds the script of its content.
pub(super) const VIEW: [&str; 5] = [
    include_str!("assets/algebra.js"),
    include_str!("assets/shapes.js"),
    include_str!("assets/renderer.js"),
    include_str!("assets/orbit.js"),
    include_str!("assets/panels.js"),
];
/// Script of the map. A page adds a script that feeds it.
pub(super) const MAP: &str = include_str!("assets/map.js");
/// Scripts of a finished run, in order of their dependencies.
pub(super) const REPLAY: [&str; 2] = [include_str!("assets/cursor.js"), include_str!("assets/replay.js")];

/// Returns the data for the script. Metres are rounded to 0.01 mm and pixels to a tenth, below the visible
/// resolution.
pub(super) fn data(run: &RunRecord, palette: &Palette) -> Value {
    let scenes = run.variants.iter().map(|variant| of_variant(variant, palette));
    of_scenes(&scenes.collect::<Vec<_>>())
}

/// Combines scenes side by side, with the colours of their paths.
pub(super) fn of_scenes(scenes: &[Value]) -> Value {
    let color = |ink: Ink| ink.hex(Theme::Light);
    let colors = json!({ "odometry": color(Ink::Odometry), "estimate": color(Ink::Estimate) });
    json!({ "colors": colors, "variants": scenes })
}

/// Largest number of frames per variant. More are not visible on a screen, and slow to load.
const FRAMES: usize = 5000;

fn of_variant(variant: &VariantRecord, palette: &Palette) -> Value {
    let start = variant.frames.first().map_or(0.0, |frame| frame.timestamp);
    let every = variant.frames.len().div_ceil(FRAMES).max(1);
    let frames = variant.frames.iter().step_by(every).map(|frame| of_frame(frame, start));
    let objects = variant.objects.iter().map(|object| of_object(object, palette.ink(&object.class)));
    scene(
        &variant.name,
        &variant.up,
        &variant.camera,
        every,
        &frames.collect::<Vec<_>>(),
        &objects.collect::<Vec<_>>(),
    )
}

/// Returns the data of one scene. `frames` are all frames, or every second, third, … of a long recording.
pub(super) fn scene(
    name: &str,
    up: &Direction,
    camera: &Camera,
    every: usize,
    frames: &[Value],
    objects: &[Value],
) -> Value {
    json!({
        "name": name,
        "up": numbers(up.iter(), 6),
        "camera": [camera.fx, camera.fy, camera.cx, camera.cy, f64::from(camera.width), f64::from(camera.height)],
        "every": every,
        "frames": frames,
        "objects": objects,
    })
}

/// `[seconds, true position, position by odometry, its error, estimated pose, its error, boxes]`
pub(super) fn of_frame(frame: &FrameRecord, start: f64) -> Value {
    let position = |pose: &Se3| numbers(pose.translation.iter(), 4);
    let error = |tracked: &PoseRecord| tracked.error.map(|x| number(x, 5));
    json!([
        number(frame.timestamp - start, 3),
        frame.truth.as_ref().map(position),
        position(&frame.odometry.pose),
        error(&frame.odometry),
        pose(&frame.estimate.pose),
        error(&frame.estimate),
        frame.boxes.iter().map(of_box).collect::<Vec<Value>>(),
    ])
}

/// `[object, measured, outline of the estimate]`
pub(super) fn of_box(seen: &BoxRecord) -> Value {
    json!([seen.object, bounds(&seen.measured), seen.ellipse.map(ellipse)])
}

/// Left, top, right, bottom.
pub(super) fn bounds(of_box: &BoundingBox) -> Vec<Value> {
    numbers(of_box.bounds().iter(), 1)
}

pub(super) fn of_object(object: &ObjectRecord, color: Ink) -> Value {
    let quadric = |q: &DualQuadric| [pose(&q.pose), numbers(q.semi_axes.iter(), 5)].concat();
    let solid = |s: &TrueCuboid| [pose(&s.pose), numbers(s.half_extents.iter(), 5)].concat();
    let factors = object.factors.iter().map(|factor| {
        let residual = numbers(factor.residual.iter(), 3);
        json!({ "factor": factor.factor, "because": factor.because, "with": factor.with, "residual": residual })
    });
    let error = object.error.map(|e| numbers([e.position, e.shape, e.quality].iter(), 4));
    json!({
        "id": object.id,
        "key": object.key,
        "class": object.class,
        "color": color.hex(Theme::Light),
        "score": object.score.map(|x| number(x, 3)),
        "boxes": object.boxes,
        "box_rms": object.box_rms.map(|x| number(x, 3)),
        "estimate": object.estimate.as_ref().map(quadric),
        "truth": object.truth.as_ref().map(solid),
        "error": error,
        "factors": factors.collect::<Vec<_>>(),
        "left_out": object.left_out,
        "rejected": object.rejected,
    })
}

/// Rounds the centre to a tenth of a pixel; for a large outline, its squares to integers.
fn ellipse([x, y, xx, xy, yy]: [f64; 5]) -> Vec<Value> {
    let digits = if xx.min(yy) > 100.0 { 0 } else { 1 };
    [numbers([x, y].iter(), 1), numbers([xx, xy, yy].iter(), digits)].concat()
}

/// Position, then quaternion (x, y, z, w).
fn pose(pose: &Se3) -> Vec<Value> {
    numbers(pose.translation.iter().chain(&pose.rotation.quaternion_xyzw()), 5)
}

pub(super) fn numbers<'a>(list: impl Iterator<Item = &'a f64>, digits: i32) -> Vec<Value> {
    list.map(|x| number(*x, digits)).collect()
}

/// Rounds a number to this number of decimals.
pub(super) fn number(x: f64, digits: i32) -> Value {
    let unit = 10f64.powi(digits);
    let near = (x * unit).round() / unit;
    match near {
        // integers have no decimal point
        near if near.fract() == 0.0 && near.abs() < 1e9 => Value::from(near as i64),
        near if near.is_finite() => Value::from(near),
        // a number too large for rounding has no such decimals
        _ => Value::from(x),
    }
}
