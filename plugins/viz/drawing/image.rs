//! What a camera sees: boxes as they were measured, and what the estimate puts there.
use crate::drawing::color::classes;
use crate::drawing::outline::ellipse;
use crate::drawing::picture::{DASHES, INK, Picture, entry, line, plain};
use kuva::plot::legend::LegendShape;
use kuva::render::annotations::TextAnnotation;
use kuva::render::layout::{Layout, TickFormat};
use manifactor_geometry::Se3;
use manifactor_quadric::{BoundingBox, DualQuadric, Ellipse, Ellipsoid};
use manifactor_slam::estimate::Estimate;
use manifactor_slam::mapping::pose_key;
use manifactor_slam::measurements::Measured;
use manifactor_slam::sequence::ObjectId;
use nalgebra::{Matrix2, Point2};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Pixels of the picture for each of the image's width.
const WIDTH: f64 = 760.0;
const MARGINS: (f64, f64) = (190.0, 100.0);
/// Most pixels upward: a camera that is higher is drawn flatter, as a PNG takes memory for each pixel.
const HEIGHT: f64 = 4.0 * WIDTH;

/// An object in one image.
struct Seen<'a> {
    class: &'a str,
    measured: BoundingBox,
    /// The outline of the estimate, where it is in front of the camera.
    estimated: Option<Ellipse>,
}

/// The frames of an estimate in which mapped objects were seen, `count` of them, spread evenly.
pub fn frames_seen(estimate: &Estimate, count: usize) -> Vec<usize> {
    let mapped: BTreeSet<ObjectId> = estimate.mapping.mapped().map(|object| object.id).collect();
    let objects = estimate.mapping.measurements.objects.iter().filter(|object| mapped.contains(&object.id));
    let frames: BTreeSet<usize> =
        objects.flat_map(|object| object.views.iter().map(|view| view.frame)).collect();
    spread(&Vec::from_iter(frames), count)
}

/// An even choice of `n` items of a list, the first and the last among them; all if there are no more.
fn spread(frames: &[usize], count: usize) -> Vec<usize> {
    let count = count.min(frames.len());
    let last = count.saturating_sub(1).max(1);
    // a number of frames squared is far from the largest number
    let places = (0..count).map(|k| k * (frames.len() - 1) / last);
    places.filter_map(|place| frames.get(place).copied()).collect()
}

/// Pixels upward of the picture of a camera's image, without margins.
fn drawn_height([width, height]: [f64; 2]) -> f64 {
    (WIDTH * height / width).min(HEIGHT)
}

/// One image: measured boxes dashed, estimated ones and the ellipses inside of them solid, by class. Pixels, y downward.
pub fn image(estimate: &Estimate, frame: usize) -> Picture {
    let seen = seen(estimate, frame);
    let classes = classes(seen.iter().map(|object| object.class));
    let color = |class: &str| classes.iter().find(|(name, _)| *name == class).map_or(INK, |(_, color)| color);
    let camera = &estimate.sequence.camera;
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let mut plots = vec![line(&corners([0.0, 0.0, width, height]), INK, 1.0, None)];
    let mut labels = vec![];
    for object in &seen {
        let color = color(object.class);
        plots.push(line(&corners(object.measured.bounds()), color, 1.6, Some(DASHES)));
        if let Some((ellipse, outline)) = object.estimated.and_then(|of| Some((of, outline(&of)?))) {
            let (half, centre) = ([ellipse.xx.sqrt(), ellipse.yy.sqrt()], ellipse.centre);
            let bounds = [centre.x - half[0], centre.y - half[1], centre.x + half[0], centre.y + half[1]];
            plots.push(line(&outline, color, 2.2, None));
            plots.push(line(&corners(bounds), color, 0.8, None));
        }
        let [x, y, ..] = object.measured.bounds();
        labels.push(
            TextAnnotation::new(plain(object.class), x.max(0.0) + 2.0, 4.0 - y.max(0.0)).with_color(color),
        );
    }
    let stamp = estimate.sequence.frames.get(frame).map_or(0.0, |frame| frame.timestamp);
    let kinds = [("measured", Some(DASHES)), ("estimated", None)];
    let kinds = kinds.map(|(name, dashes)| entry(name, INK, LegendShape::Line, dashes));
    let mut layout = Layout::auto_from_plots(&plots)
        .with_width(WIDTH + MARGINS.0)
        .with_height(drawn_height([width, height]) + MARGINS.1)
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
    let seen = |object: &'_ Measured| {
        let view = object.views.iter().find(|view| view.frame == frame)?;
        let ellipsoid = Ellipsoid::seen(camera?, quadrics.get(&object.id)?);
        let estimated = ellipsoid.is_in_front().then(|| ellipsoid.outline(&estimate.sequence.camera));
        Some((view.bounding_box, estimated))
    };
    let objects = estimate.mapping.measurements.objects.iter().filter_map(|object| {
        let (measured, estimated) = seen(object)?;
        let class = object.class.as_ref().map_or("unknown", |class| class.name.as_str());
        Some(Seen { class, measured, estimated })
    });
    objects.collect()
}

/// The four sides of a box, closed; y upward.
fn corners([xmin, ymin, xmax, ymax]: [f64; 4]) -> [Point2<f64>; 5] {
    [(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax), (xmin, ymin)].map(|(x, y)| Point2::new(x, -y))
}

/// The outline of an ellipse; y upward.
fn outline(of: &Ellipse) -> Option<Vec<Point2<f64>>> {
    ellipse(&Point2::new(of.centre.x, -of.centre.y), &Matrix2::new(of.xx, -of.xy, -of.xy, of.yy))
}

#[cfg(test)]
mod tests {
    use super::{HEIGHT, WIDTH, drawn_height, spread};

    #[test]
    fn a_picture_of_a_high_image_is_flatter() {
        assert_eq!(drawn_height([640.0, 480.0]), 0.75 * WIDTH);
        assert_eq!(drawn_height([1.0, f64::from(u32::MAX)]), HEIGHT);
    }

    #[test]
    fn frames_are_spread_from_the_first_to_the_last() {
        let frames = [2, 3, 5, 7, 11];
        assert_eq!(spread(&frames, 3), [2, 5, 11]);
        assert_eq!(spread(&frames, 1), [2]);
        for all in [5, 6, usize::MAX] {
            assert_eq!(spread(&frames, all), frames);
        }
        assert!(spread(&frames, 0).is_empty() && spread(&[], usize::MAX).is_empty());
    }
}
