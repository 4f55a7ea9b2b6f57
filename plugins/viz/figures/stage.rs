//! Objects and paths in an oblique view.
use crate::canvas::{Ink, Sheet, Stroke};
use crate::drawing::outline::Shape;
use crate::drawing::{HEAD, Label, Palette, Picture, Plane, Scene, Viewpoint, place, title};
use manifactor_slam::record::VariantRecord;
use nalgebra::{Point2, Vector3};

/// A part of a plane on a rectangle of a sheet, with one scale for both axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stage {
    pub(super) plane: Plane,
    middle: Point2<f64>,
    /// Scale. Unit: pixels per metre.
    pub(super) scale: f64,
    /// xmin, ymin, xmax, ymax. Unit: pixels.
    area: [f64; 4],
}

impl Stage {
    /// Creates the stage on which all points are visible. `None` without a finite point.
    pub(super) fn around(
        plane: Plane,
        points: impl Iterator<Item = Point2<f64>>,
        area: [f64; 4],
    ) -> Option<Self> {
        let finite = points.filter(|p| p.iter().all(|x| x.is_finite()));
        let ends = finite.fold(None, |ends: Option<(Point2<f64>, Point2<f64>)>, p| {
            Some(ends.map_or((p, p), |(low, high)| (low.inf(&p), high.sup(&p))))
        });
        let (low, high) = ends?;
        let size = (high - low).map(|x| x.max(1e-9));
        let [xmin, ymin, xmax, ymax] = area;
        let scale = 0.94 * ((xmax - xmin) / size.x).min((ymax - ymin) / size.y);
        Some(Self { plane, middle: nalgebra::center(&low, &high), scale, area })
    }

    /// Position of a point of the plane on the sheet.
    pub(super) fn at(&self, p: &Point2<f64>) -> [f64; 2] {
        let [xmin, ymin, xmax, ymax] = self.area;
        let from_middle = (p - self.middle) * self.scale;
        [0.5 * (xmin + xmax) + from_middle.x, 0.5 * (ymin + ymax) - from_middle.y]
    }

    /// Position of a point of the scene on the sheet.
    pub(super) fn point(&self, p: &Vector3<f64>) -> [f64; 2] {
        self.at(&self.plane.project(p))
    }

    /// Outline of an ellipsoid on the sheet.
    pub(super) fn outline(&self, shape: &Shape) -> Option<Vec<[f64; 2]>> {
        Some(shape.outline(&self.plane)?.iter().map(|p| self.at(p)).collect())
    }
}

/// Draws the objects of a variant in an oblique view: true shapes dashed, estimates filled, both in the colour
/// of their class. The camera path is left out, so that the objects fill the picture. `None` without an object.
pub fn objects(variant: &VariantRecord, text: &str, width: f64) -> Option<Picture> {
    let scene = Scene::of(text, variant);
    let palette = Palette::new(variant.classes().into_iter());
    let plane = Viewpoint::Oblique.plane(&scene.up);
    let area = [10.0, HEAD + 6.0, width - 10.0, HEAD + 6.0 + 0.62 * width];
    let shapes = scene.objects.iter().flat_map(|object| [&object.truth, &object.estimate]).flatten();
    let corners = shapes.filter_map(|shape| shape.outline(&plane)).flatten();
    let stage = Stage::around(plane, corners, area)?;
    let mut sheet = Sheet::new(width, area[3] + 10.0);
    title(&mut sheet, text);
    let mut labels = vec![];
    for object in &scene.objects {
        let ink = palette.ink(&object.class);
        if let Some(outline) = object.estimate.as_ref().and_then(|shape| stage.outline(shape)) {
            sheet.outline(outline, Stroke::solid(ink, 1.8), Some((ink, 0.22)));
        }
        if let Some(outline) = object.truth.as_ref().and_then(|shape| stage.outline(shape)) {
            labels.push(label(&object.class, ink, &outline));
            sheet.outline(outline, Stroke::dashed(ink, 1.4), None);
        }
    }
    place(&mut sheet, &labels, area);
    Some(Picture::new("objects", text, sheet))
}

/// Returns the label of an object with this outline.
pub(super) fn label(text: &str, ink: Ink, outline: &[[f64; 2]]) -> Label {
    let around = outline.iter().fold(
        [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY],
        |[xmin, ymin, xmax, ymax], [x, y]| [xmin.min(*x), ymin.min(*y), xmax.max(*x), ymax.max(*y)],
    );
    Label { text: text.to_owned(), around, ink }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_graph::Direction;

    #[test]
    fn all_points_are_in_the_area() {
        let plane = Viewpoint::Oblique.plane(&Direction::Z);
        let points = [Point2::new(-3.0, 1.0), Point2::new(5.0, 2.0), Point2::new(0.0, f64::NAN)];
        let area = [10.0, 20.0, 110.0, 70.0];
        let stage = Stage::around(plane, points.into_iter(), area).unwrap();
        for p in &points[..2] {
            let [x, y] = stage.at(p);
            assert!((10.0..=110.0).contains(&x) && (20.0..=70.0).contains(&y), "{x}, {y}");
        }
        assert!(stage.at(&points[0])[1] > stage.at(&points[1])[1], "y grows downward on a sheet");
        assert!(Stage::around(plane, std::iter::empty(), area).is_none());
    }
}
