//! What a camera sees: boxes as they were measured, and what the estimate puts there.
use crate::color::classes;
use crate::picture::{Picture, plain};
use kuva::plot::legend::{LegendEntry, LegendShape};
use kuva::plot::{LinePlot, LineStyle};
use kuva::render::annotations::TextAnnotation;
use kuva::render::layout::{Layout, TickFormat};
use kuva::render::plots::Plot;
use manifactor_geometry::Se3;
use manifactor_quadric::{BoundingBox, DualQuadric, Ellipse, Ellipsoid};
use manifactor_slam::estimate::Estimate;
use manifactor_slam::mapping::pose_key;
use manifactor_slam::sequence::ObjectId;
use nalgebra::Vector2;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Pixels of the picture for each of the image's width.
const WIDTH: f64 = 760.0;
const MARGINS: (f64, f64) = (190.0, 100.0);
const CORNERS: usize = 64;
const DASHES: &str = "5 3";
const BORDER: &str = "#222222";

/// An object in one image.
struct Seen<'a> {
    class: &'a str,
    measured: BoundingBox,
    /// Outline and box of the estimate, where it is in front of the camera.
    estimated: Option<(Ellipse, BoundingBox)>,
}

/// The frames of an estimate in which mapped objects were seen, `count` of them, spread evenly.
pub fn frames_seen(estimate: &Estimate, count: usize) -> Vec<usize> {
    let mapped: BTreeSet<ObjectId> = estimate.mapping.mapped().map(|object| object.id).collect();
    let objects = estimate.mapping.measurements.objects.iter().filter(|object| mapped.contains(&object.id));
    let frames: BTreeSet<usize> =
        objects.flat_map(|object| object.views.iter().map(|view| view.frame)).collect();
    let (frames, last) = (Vec::from_iter(frames), count.saturating_sub(1).max(1));
    let places: BTreeSet<usize> = (0..count).map(|k| k * frames.len().saturating_sub(1) / last).collect();
    places.into_iter().filter_map(|place| frames.get(place).copied()).collect()
}

/// One image: measured boxes dashed, estimated ones and the ellipses inside of them solid, by class. Pixels, y downward.
pub fn image(estimate: &Estimate, frame: usize) -> Picture {
    let seen = seen(estimate, frame);
    let classes = classes(seen.iter().map(|object| object.class));
    let color =
        |class: &str| classes.iter().find(|(name, _)| *name == class).map_or(BORDER, |(_, color)| color);
    let camera = &estimate.sequence.camera;
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let mut plots = vec![line(&corners([0.0, 0.0, width, height]), BORDER, 1.0, None)];
    let mut labels = vec![];
    for object in &seen {
        let color = color(object.class);
        plots.push(line(&corners(object.measured.bounds()), color, 1.6, Some(DASHES)));
        if let Some((ellipse, bounds)) = &object.estimated {
            plots.push(line(&outline(ellipse), color, 2.2, None));
            plots.push(line(&corners(bounds.bounds()), color, 0.8, None));
        }
        let [x, y, ..] = object.measured.bounds();
        labels.push(
            TextAnnotation::new(plain(object.class), x.max(0.0) + 2.0, 4.0 - y.max(0.0)).with_color(color),
        );
    }
    let stamp = estimate.sequence.frames.get(frame).map_or(0.0, |frame| frame.timestamp);
    let kinds = [entry("measured", Some(DASHES)), entry("estimated", None)];
    let mut layout = Layout::auto_from_plots(&plots)
        .with_width(WIDTH + MARGINS.0)
        .with_height(WIDTH * height / width + MARGINS.1)
        .with_title(format!("image {frame}, at {stamp:.3} s"))
        .with_title_size(15)
        .with_x_label("x (px)")
        .with_y_label("y (px)")
        .with_x_axis_min(-0.02 * width)
        .with_x_axis_max(1.02 * width)
        .with_y_axis_min(-1.02 * height)
        .with_y_axis_max(0.02 * height)
        // images have y downward
        .with_y_tick_format(TickFormat::Custom(Arc::new(|y| format!("{:.0}", 0.0 - y))))
        .with_show_grid(false)
        .with_legend_group("Objects", kinds.into());
    for label in labels {
        layout = layout.with_annotation(label.with_font_size(10));
    }
    Picture::new(&format!("image_{frame:06}"), plots, layout)
}

fn seen(estimate: &Estimate, frame: usize) -> Vec<Seen<'_>> {
    let camera: Option<&Se3> = estimate.solution.values.get(pose_key(frame)).ok();
    let quadrics: BTreeMap<ObjectId, &DualQuadric> =
        estimate.landmarks().into_iter().map(|landmark| (landmark.object.id, landmark.quadric)).collect();
    let objects = estimate.mapping.measurements.objects.iter();
    let seen = |object: &'_ manifactor_slam::measurements::Measured| {
        let view = object.views.iter().find(|view| view.frame == frame)?;
        let quadric = quadrics.get(&object.id)?;
        let estimated = camera
            .map(|camera| Ellipsoid::seen(camera, quadric))
            .filter(Ellipsoid::is_in_front)
            .and_then(|seen| {
                let ellipse = seen.outline(&estimate.sequence.camera);
                Some((ellipse, seen.dual_conic(&estimate.sequence.camera).bounds()?))
            });
        Some((view.bounding_box, estimated))
    };
    objects
        .filter_map(|object| {
            let (measured, estimated) = seen(object)?;
            let class = object.class.as_ref().map_or("unknown", |class| class.name.as_str());
            Some(Seen { class, measured, estimated })
        })
        .collect()
}

/// The four sides of a box, closed.
fn corners([xmin, ymin, xmax, ymax]: [f64; 4]) -> Vec<(f64, f64)> {
    [(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax), (xmin, ymin)].into()
}

/// centre + L (cos φ, sin φ) with L Lᵀ = Σ.
fn outline(ellipse: &Ellipse) -> Vec<(f64, f64)> {
    let a = ellipse.xx.max(0.0).sqrt();
    let b = if a > 0.0 { ellipse.xy / a } else { 0.0 };
    let c = (ellipse.yy - b * b).max(0.0).sqrt();
    let point = |k: usize| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / CORNERS as f64).sin_cos();
        let p = ellipse.centre + Vector2::new(a * cos, b * cos + c * sin);
        (p.x, p.y)
    };
    (0..=CORNERS).map(point).collect()
}

fn line(points: &[(f64, f64)], color: &str, width: f64, dashes: Option<&str>) -> Plot {
    let style = dashes.map_or(LineStyle::Solid, |d| LineStyle::Custom(d.into()));
    let data = points.iter().filter(|(x, y)| x.is_finite() && y.is_finite()).map(|(x, y)| (*x, -y));
    LinePlot::new().with_data(data).with_color(color).with_stroke_width(width).with_line_style(style).into()
}

fn entry(label: &str, dashes: Option<&str>) -> LegendEntry {
    LegendEntry {
        label: label.into(),
        color: BORDER.into(),
        shape: LegendShape::Line,
        dasharray: dashes.map(Into::into),
    }
}
