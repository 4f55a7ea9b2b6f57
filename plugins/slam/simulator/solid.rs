//! True shapes of objects: solids with flat faces, which an ellipsoid only approximates.
use manifactor_geometry::Se3;
use manifactor_quadric::{BoundingBox, Camera};
use manifactor_recording::ellipse::ImageEllipse;
use nalgebra::{Matrix2, Vector2, Vector3};
use std::f64::consts::TAU;

/// Near plane: closer parts are not visible. Unit: metres.
const NEAR_PLANE_M: f64 = 0.05;

/// Convex faces in space, each a list of corners. The frame's origin is the centre of the enclosing box.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Solid {
    faces: Vec<Vec<Vector3<f64>>>,
}

impl Solid {
    /// Returns a box of these extents in metres.
    pub(crate) fn cuboid(extents: [f64; 3]) -> Self {
        let [x, y, z] = extents.map(|e| e / 2.0);
        let rectangle = |a: Vector3<f64>, u: Vector3<f64>, v: Vector3<f64>| {
            [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(s, t)| a + u * s + v * t).to_vec()
        };
        let axes = [Vector3::x() * x, Vector3::y() * y, Vector3::z() * z];
        let sides = (0..3).flat_map(|i| [1.0, -1.0].map(|s| (i, s)));
        Self {
            faces: sides.map(|(i, s)| rectangle(axes[i] * s, axes[(i + 1) % 3], axes[(i + 2) % 3])).collect(),
        }
    }

    /// Returns a round body along z: radii at the bottom and the top, and the height, in metres.
    pub(crate) fn frustum(bottom: f64, top: f64, height: f64) -> Self {
        Self::turned(&[(bottom, -height / 2.0), (top, height / 2.0)])
    }

    /// Returns a ball with this radius in metres.
    pub(crate) fn ball(radius: f64) -> Self {
        const RINGS: usize = 8;
        let ring = |i: usize| {
            let latitude = (i as f64 / RINGS as f64 - 0.5) * TAU / 2.0;
            (radius * latitude.cos(), radius * latitude.sin())
        };
        Self::turned(&(0..=RINGS).map(ring).collect::<Vec<_>>())
    }

    /// Returns the body that an outline of (radius, z) forms when it is rotated about z.
    fn turned(outline: &[(f64, f64)]) -> Self {
        const SIDES: usize = 24;
        let at = |(radius, z): (f64, f64), i: usize| {
            let angle = i as f64 / SIDES as f64 * TAU;
            Vector3::new(radius * angle.cos(), radius * angle.sin(), z)
        };
        let ends = [outline.first(), outline.last()];
        let caps = ends.into_iter().flatten().map(|end| (0..SIDES).map(|i| at(*end, i)).collect());
        let bands = outline.windows(2).flat_map(|w| {
            (0..SIDES).map(move |i| vec![at(w[0], i), at(w[0], i + 1), at(w[1], i + 1), at(w[1], i)])
        });
        Self { faces: caps.chain(bands).collect() }
    }

    /// Returns a flat part with an upright part along its far edge, like a chair or an open laptop: width,
    /// depth, height and the thickness of both parts, in metres.
    pub(crate) fn folded([width, depth, height]: [f64; 3], thickness: f64) -> Self {
        let flat = Self::cuboid([width, depth, thickness]).moved(Vector3::z() * (thickness - height) / 2.0);
        let back = Self::cuboid([width, thickness, height]).moved(Vector3::y() * (depth - thickness) / 2.0);
        Self { faces: flat.faces.into_iter().chain(back.faces).collect() }
    }

    fn moved(mut self, by: Vector3<f64>) -> Self {
        self.faces.iter_mut().flatten().for_each(|corner| *corner += by);
        self
    }

    /// Returns the shape scaled by a factor.
    #[must_use]
    pub(crate) fn scaled(mut self, factor: f64) -> Self {
        self.faces.iter_mut().flatten().for_each(|corner| *corner *= factor);
        self
    }

    /// Returns the corners of all faces; shared corners are repeated.
    pub(crate) fn corners(&self) -> impl Iterator<Item = &Vector3<f64>> {
        self.faces.iter().flatten()
    }

    /// Returns half the extents along the axes of the solid.
    pub(crate) fn half_extents(&self) -> Vector3<f64> {
        self.corners().fold(Vector3::zeros(), |most, corner| most.sup(&corner.abs()))
    }

    /// Returns the boxes around the solid in an image, without and with the image border. `None` if no part
    /// is in front of the camera or inside the image.
    pub(crate) fn boxes(
        &self,
        world_from_object: &Se3,
        camera: &Camera,
        world_from_camera: &Se3,
    ) -> Option<ImageBoxes> {
        let (mut whole, mut inside) = (PixelBounds::default(), PixelBounds::default());
        for front in self.in_front(&world_from_camera.between(world_from_object)) {
            let mut image: Vec<_> = front.iter().map(|p| project(camera, p)).collect();
            image.iter().for_each(|p| whole.add(p));
            let size = camera.size();
            for axis in 0..2 {
                image = clip(&image, |p| p[axis]);
                image = clip(&image, |p| size[axis] - p[axis]);
            }
            // an edge that meets the border may be off by rounding
            image.iter().for_each(|p| inside.add(&p.sup(&Vector2::zeros()).inf(&size)));
        }
        Some(ImageBoxes { whole: whole.bounding_box()?, inside: inside.bounding_box()? })
    }

    /// Returns the ellipse with the moments of the convex hull of the outline in an image without a border. `None` if a part
    /// is not in front of the camera.
    pub(crate) fn outline(&self, camera_from_object: &Se3, camera: &Camera) -> Option<ImageEllipse> {
        let seen: Vec<Vector3<f64>> = self.corners().map(|corner| camera_from_object.act(corner)).collect();
        if seen.iter().any(|corner| corner.z <= NEAR_PLANE_M) {
            return None;
        }
        let hull = convex_hull(seen.iter().map(|corner| project(camera, corner)).collect());
        let origin = *hull.first()?;
        let (mut area, mut first, mut second) = (0.0, Vector2::zeros(), Matrix2::zeros());
        // moments of the triangles from the first corner
        for pair in hull.windows(2) {
            let (a, b) = (pair[0] - origin, pair[1] - origin);
            let part = 0.5 * a.perp(&b);
            area += part;
            first += (a + b) * (part / 3.0);
            let sum = a + b;
            second += (a * a.transpose() + b * b.transpose() + sum * sum.transpose()) * (part / 12.0);
        }
        let mean = first / area;
        let covariance = second / area - mean * mean.transpose();
        // a uniform ellipse has a quarter of its squared semi-axes as variance
        ImageEllipse::from_shape(origin + mean, covariance * 4.0)
    }

    /// Returns the parts of the faces in front of a camera, in the camera frame.
    pub(super) fn in_front(&self, camera_from_object: &Se3) -> impl Iterator<Item = Vec<Vector3<f64>>> {
        self.faces.iter().map(|face| {
            let seen: Vec<_> = face.iter().map(|corner| camera_from_object.act(corner)).collect();
            clip(&seen, |p| p.z - NEAR_PLANE_M)
        })
    }
}

/// Boxes around an object in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ImageBoxes {
    /// Box around the whole object, as if the image had no border.
    pub whole: BoundingBox,
    /// Box around the part inside the image.
    pub inside: BoundingBox,
}

/// Projects a point to pixels.
pub(super) fn project(camera: &Camera, p: &Vector3<f64>) -> Vector2<f64> {
    let (x, y) = (p.x / p.z, p.y / p.z);
    Vector2::new(camera.fx * x + camera.skew * y + camera.cx, camera.fy * y + camera.cy)
}

/// Returns the corners of the convex hull, counter-clockwise in x and y (Andrew's monotone chain).
fn convex_hull(mut points: Vec<Vector2<f64>>) -> Vec<Vector2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = &Vector2<f64>>| {
        let mut chain: Vec<Vector2<f64>> = vec![];
        for p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp(&(p - b)) <= 0.0
            {
                chain.pop();
            }
            chain.push(*p);
        }
        // it is the first one of the other half
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter());
    hull.extend(half(&mut points.iter().rev()));
    hull
}

/// Returns whether a point is in a convex polygon of either orientation.
pub(super) fn inside_convex(polygon: &[Vector2<f64>], p: &Vector2<f64>) -> bool {
    let next = polygon.iter().cycle().skip(1);
    let sides = polygon.iter().zip(next).map(|(a, b)| (b - a).perp(&(p - a)));
    let (low, high) = sides.fold((0.0_f64, 0.0_f64), |(low, high), side| (low.min(side), high.max(side)));
    low >= 0.0 || high <= 0.0
}

/// Returns the part of a polygon in which `distance` is not negative (Sutherland and Hodgman).
fn clip<const D: usize>(
    polygon: &[nalgebra::SVector<f64, D>],
    distance: impl Fn(&nalgebra::SVector<f64, D>) -> f64,
) -> Vec<nalgebra::SVector<f64, D>> {
    let mut part = Vec::with_capacity(polygon.len() + 2);
    let next = polygon.iter().cycle().skip(1);
    for (a, b) in polygon.iter().zip(next) {
        let (from, to) = (distance(a), distance(b));
        if from >= 0.0 {
            part.push(*a);
        }
        if (from >= 0.0) != (to >= 0.0) {
            part.push(a + (b - a) * (from / (from - to)));
        }
    }
    part
}

/// Bounds of the points that were added.
#[derive(Default)]
struct PixelBounds(Option<(Vector2<f64>, Vector2<f64>)>);

impl PixelBounds {
    fn add(&mut self, p: &Vector2<f64>) {
        self.0 = Some(self.0.map_or((*p, *p), |(min, max)| (min.inf(p), max.sup(p))));
    }
    fn bounding_box(self) -> Option<BoundingBox> {
        let (min, max) = self.0?;
        BoundingBox::new([min.x, min.y, max.x, max.y]).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::So3;
    use manifactor_quadric::Box3;

    const CAMERA: Camera =
        Camera { fx: 320.0, fy: 320.0, cx: 320.0, cy: 240.0, skew: 0.0, width: 640, height: 480 };

    fn at(x: f64, y: f64, z: f64) -> Se3 {
        Se3::new(So3::identity(), Vector3::new(x, y, z))
    }

    #[test]
    fn the_box_of_a_cuboid_is_that_of_its_near_corners() {
        let boxes =
            Solid::cuboid([0.2, 0.4, 1.0]).boxes(&at(0.0, 0.0, 4.5), &CAMERA, &Se3::identity()).unwrap();
        // the near face is at 4 m
        let expected = [320.0 - 8.0, 240.0 - 16.0, 320.0 + 8.0, 240.0 + 16.0];
        let found = boxes.whole.bounds();
        assert!(expected.iter().zip(found).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
        assert_eq!(boxes.whole, boxes.inside);
    }

    #[test]
    fn the_ellipse_has_the_moments_of_the_outline() {
        // a rectangle of 100 × 50 px has the variances 100²/12 and 50²/12, a quarter of the squared semi-axes
        let plate = Solid::cuboid([1.25, 0.625, 1e-9]);
        let ellipse = plate.outline(&at(0.0, 0.0, 4.0), &CAMERA).unwrap();
        let expected = Matrix2::new(1e4 / 3.0, 0.0, 0.0, 2500.0 / 3.0);
        assert!((ellipse.shape() - expected).norm() < 1e-4, "{}", ellipse.shape());
        assert!((Vector2::from(ellipse.centre) - Vector2::new(320.0, 240.0)).norm() < 1e-6);
        assert!(plate.outline(&at(0.0, 0.0, 0.0), &CAMERA).is_none());
    }

    #[test]
    fn what_the_border_cuts_ends_at_the_border() {
        let boxes =
            Solid::cuboid([1.0, 0.2, 0.2]).boxes(&at(-2.0, 0.0, 2.0), &CAMERA, &Se3::identity()).unwrap();
        assert!(boxes.whole.xmin < 0.0 && boxes.inside.xmin == 0.0 && boxes.inside.xmax == boxes.whole.xmax);
        assert!(Solid::ball(0.1).boxes(&at(-9.0, 0.0, 2.0), &CAMERA, &Se3::identity()).is_none());
    }

    #[test]
    fn what_is_partly_behind_the_camera_is_seen_in_part() {
        let wall = Solid::cuboid([0.1, 0.1, 4.0]);
        let boxes = wall.boxes(&at(0.3, 0.0, 0.5), &CAMERA, &Se3::identity()).unwrap();
        assert!(boxes.inside.bounds().iter().all(|x| x.is_finite()) && boxes.inside.xmax == 640.0);
        assert!(wall.boxes(&at(0.3, 0.0, -3.0), &CAMERA, &Se3::identity()).is_none());
    }

    #[test]
    fn solids_are_centred_and_of_their_size() {
        for (solid, half) in [
            (Solid::cuboid([0.2, 0.4, 0.6]), [0.1, 0.2, 0.3]),
            (Solid::frustum(0.1, 0.2, 0.5), [0.2, 0.2, 0.25]),
            (Solid::ball(0.3), [0.3, 0.3, 0.3]),
            (Solid::folded([0.3, 0.2, 0.25], 0.02), [0.15, 0.1, 0.125]),
        ] {
            let around = Box3::enclosing(solid.corners().copied()).unwrap();
            for i in 0..3 {
                assert!((around.max[i] - half[i]).abs() < 1e-12 && (around.min[i] + half[i]).abs() < 1e-12);
                assert!((solid.half_extents()[i] - half[i]).abs() < 1e-12);
            }
        }
    }
}
