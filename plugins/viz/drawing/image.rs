//! The image of a camera: measured boxes and the predictions of the estimate.
use super::axes::{Axes, HEAD, title};
use super::labels::{Label, place};
use super::legend::{Entry, legend};
use super::outline::ellipse;
use super::picture::Picture;
use super::scale::Scale;
use super::scene::Palette;
use crate::canvas::{Ink, Sheet, Stroke};
use manifactor_slam::record::{BoxRecord, FrameRecord, VariantRecord};
use nalgebra::{Matrix2, Point2};

/// Largest ratio of height to width. A taller image is drawn flatter, because a PNG needs memory for each
/// pixel.
const HIGHEST: f64 = 4.0;

/// Height of the picture of a camera's image, drawn at a width. Unit: pixels.
fn drawn_height([width, height]: [f64; 2], drawn: f64) -> f64 {
    drawn * (height / width).min(HIGHEST)
}

/// Draws one image: measured boxes dashed, estimated ellipses and their bounding boxes solid, coloured by
/// class. Unit: pixels, y downward.
pub(crate) fn image(
    variant: &VariantRecord,
    number: usize,
    frame: &FrameRecord,
    palette: &Palette,
    width: f64,
) -> Picture {
    let size = [variant.camera.width, variant.camera.height].map(f64::from);
    let class = |seen: &BoxRecord| {
        let object = variant.objects.iter().find(|object| object.id == seen.object);
        object.map_or("unknown", |object| object.class.as_str())
    };
    let mut entries = vec![
        Entry::line("measured", Stroke::dashed(Ink::Faint, 1.6)),
        Entry::line("estimated", Stroke::solid(Ink::Faint, 2.0)),
    ];
    let here = |name: &&String| frame.boxes.iter().any(|seen| class(seen) == **name);
    entries.extend(palette.names().iter().filter(here).map(|name| Entry::patch(name, palette.ink(name))));
    let entries = legend(&entries, width - 20.0);
    let top = HEAD + entries.height + 8.0;
    // images have y downward
    let (x, y) = (Scale::new(0.0, size[0]), Scale::new(-size[1], 0.0));
    let left = 10.0 + Axes::left(&y, drawn_height(size, width - 80.0));
    let height = drawn_height(size, width - 18.0 - left);
    let area = [left, top, width - 18.0, top + height];
    let axes = Axes { area, x, y, x_label: "x (px)".into(), y_label: "y (px)".into() };
    let mut sheet = Sheet::new(width, top + height + Axes::below("x") + 2.0);
    let start = variant.frames.first().map_or(0.0, |first| first.timestamp);
    let text = format!("{}: image {number}, after {:.2} s", variant.name, frame.timestamp - start);
    title(&mut sheet, &text);
    sheet.place(entries, [10.0, HEAD]);
    axes.draw_downward(&mut sheet);
    let mut labels = vec![];
    for seen in &frame.boxes {
        let ink = palette.ink(class(seen));
        let corners = |bounds: [f64; 4]| clipped(bounds, size).map(|p| axes.point(p[0], -p[1])).to_vec();
        let measured = corners(seen.measured.bounds());
        if let (Some(first), Some(third)) = (measured.first(), measured.get(2)) {
            let around = [first[0], first[1], third[0], third[1]];
            labels.push(Label { text: class(seen).to_owned(), around, ink });
        }
        if let Some(outline) = seen.ellipse.and_then(outline) {
            let points = outline.iter().map(|p| [p.x.clamp(0.0, size[0]), p.y.clamp(0.0, size[1])]);
            let points = points.map(|[x, y]| axes.point(x, -y)).collect();
            sheet.outline(points, Stroke::solid(ink, 2.0), Some((ink, 0.15)));
        }
        if let Some(projected) = seen.projected {
            sheet.outline(corners(projected), Stroke::solid(ink, 0.8), None);
        }
        sheet.outline(measured, Stroke::dashed(ink, 1.6), None);
    }
    place(&mut sheet, &labels, area);
    Picture::new(&format!("image_{number:06}"), format!("{text}: boxes measured and estimated"), sheet)
}

/// Returns the corners of a box, clipped to the image.
fn clipped([xmin, ymin, xmax, ymax]: [f64; 4], [width, height]: [f64; 2]) -> [[f64; 2]; 4] {
    let corners = [[xmin, ymin], [xmax, ymin], [xmax, ymax], [xmin, ymax]];
    corners.map(|[x, y]| [x.clamp(0.0, width), y.clamp(0.0, height)])
}

/// Returns the outline of an ellipse.
fn outline([x, y, xx, xy, yy]: [f64; 5]) -> Option<Vec<Point2<f64>>> {
    ellipse(&Point2::new(x, y), &Matrix2::new(xx, xy, xy, yy))
}

/// Selects `count` evenly spaced frames with mapped objects, including the first and the last. Returns all
/// of them if there are no more than `count`.
pub(crate) fn frames_seen(variant: &VariantRecord, count: usize) -> Vec<usize> {
    let seen = |frame: &FrameRecord| frame.boxes.iter().any(|seen| seen.ellipse.is_some());
    let frames = variant.frames.iter().enumerate().filter(|(_, frame)| seen(frame)).map(|(i, _)| i);
    spread(&frames.collect::<Vec<_>>(), count)
}

fn spread(frames: &[usize], count: usize) -> Vec<usize> {
    let count = count.min(frames.len());
    let last = count.saturating_sub(1).max(1);
    // the square of a number of frames cannot overflow
    let places = (0..count).map(|k| k * (frames.len() - 1) / last);
    places.filter_map(|place| frames.get(place).copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::{HIGHEST, drawn_height, spread};

    #[test]
    fn a_picture_of_a_high_image_is_flatter() {
        assert_eq!(drawn_height([640.0, 480.0], 800.0), 600.0);
        assert_eq!(drawn_height([1.0, f64::from(u32::MAX)], 800.0), HIGHEST * 800.0);
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
