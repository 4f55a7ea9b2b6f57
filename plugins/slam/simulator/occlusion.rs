//! Mutual occlusion of objects, from a coarse depth image.
use super::solid::{Solid, inside_convex, project};
use manifactor_geometry::Se3;
use manifactor_quadric::{BoundingBox, Camera};
use nalgebra::{Vector2, Vector3};

/// Side of a cell in pixels, unless this gives more than `MOST_CELLS` along a side of the image.
const CELL_PX: f64 = 4.0;
const MOST_CELLS: f64 = 1000.0;

/// The nearest object in each cell of an image.
pub(super) struct DepthImage {
    /// Side of a cell. Unit: pixels.
    cell: f64,
    columns: usize,
    rows: usize,
    /// For each cell: depth of the nearest surface, and its object.
    nearest: Vec<(f64, usize)>,
    /// For each object: the cells that it covers, row by row and without duplicates.
    covered: Vec<Vec<usize>>,
}

impl DepthImage {
    /// Draws all solids, each with its pose in the camera frame.
    pub(super) fn new<'a>(solids: impl Iterator<Item = (&'a Solid, Se3)>, camera: &Camera) -> Self {
        let size = camera.size();
        let cell = CELL_PX.max(size.max() / MOST_CELLS);
        let [columns, rows] = [size.x, size.y].map(|length| (length / cell).ceil() as usize);
        let mut image = Self {
            cell,
            columns,
            rows,
            nearest: vec![(f64::INFINITY, usize::MAX); columns * rows],
            covered: vec![],
        };
        for (object, (solid, camera_from_object)) in solids.enumerate() {
            let mut covered = vec![];
            for face in solid.in_front(&camera_from_object) {
                image.visit_cells(&face, camera, |cell, nearest, depth| {
                    covered.push(cell);
                    if depth < nearest.0 {
                        *nearest = (depth, object);
                    }
                });
            }
            covered.sort_unstable();
            covered.dedup();
            image.covered.push(covered);
        }
        image
    }

    /// Visits the cells of a face, with its depth in each cell.
    fn visit_cells(
        &mut self,
        face: &[Vector3<f64>],
        camera: &Camera,
        mut visit: impl FnMut(usize, &mut (f64, usize), f64),
    ) {
        let [a, b, c, ..] = face else { return };
        let normal = (b - a).cross(&(c - a));
        let outline: Vec<Vector2<f64>> = face.iter().map(|p| project(camera, p)).collect();
        let first = outline.first().copied().unwrap_or_default();
        let (low, high) = outline.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
        let side = self.cell;
        let cells = |low: f64, high: f64, most: usize| {
            let from = (low / side - 0.5).ceil().max(0.0) as usize;
            from..((high / side + 0.5).floor().max(0.0) as usize).min(most)
        };
        for row in cells(low.y, high.y, self.rows) {
            for column in cells(low.x, high.x, self.columns) {
                let p = Vector2::new((column as f64 + 0.5) * side, (row as f64 + 0.5) * side);
                if !inside_convex(&outline, &p) {
                    continue;
                }
                let y = (p.y - camera.cy) / camera.fy;
                let x = (p.x - camera.cx - camera.skew * y) / camera.fx;
                // depth at the intersection of the ray with the plane of the face
                let depth = normal.dot(a) / normal.dot(&Vector3::new(x, y, 1.0));
                let cell = row * self.columns + column;
                if depth > 0.0 {
                    visit(cell, &mut self.nearest[cell], depth);
                }
            }
        }
    }

    /// Returns the box of an object, reduced to the visible part, and the visible share; `None` if nothing is
    /// visible. An object smaller than a cell keeps its box.
    pub(super) fn visible_part(
        &self,
        object: usize,
        bounding_box: BoundingBox,
    ) -> Option<(BoundingBox, f64)> {
        let covered = self.covered.get(object)?;
        if covered.is_empty() {
            return Some((bounding_box, 1.0));
        }
        let ends = |cells: &mut dyn Iterator<Item = usize>| {
            let mut ends = [usize::MAX, usize::MAX, 0, 0];
            let mut count = 0;
            for cell in cells {
                let (column, row) = (cell % self.columns, cell / self.columns);
                let [x, y, z, w] = ends;
                ends = [x.min(column), y.min(row), z.max(column), w.max(row)];
                count += 1;
            }
            (ends, count)
        };
        let seen = |cell: &usize| self.nearest.get(*cell).is_some_and(|(_, nearest)| *nearest == object);
        let (all, covers) = ends(&mut covered.iter().copied());
        let (left, sees) = ends(&mut covered.iter().copied().filter(seen));
        if sees == 0 {
            return None;
        }
        let mut bounds = bounding_box.bounds();
        for side in (0..4).filter(|side| left[*side] != all[*side]) {
            bounds[side] = (left[side] + usize::from(side > 1)) as f64 * self.cell;
        }
        Some((BoundingBox::new(bounds).ok()?, f64::from(sees) / f64::from(covers)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::So3;

    const CAMERA: Camera =
        Camera { fx: 320.0, fy: 320.0, cx: 320.0, cy: 240.0, skew: 0.0, width: 640, height: 480 };

    fn whole((size, at): &([f64; 3], [f64; 3])) -> BoundingBox {
        let pose = Se3::new(So3::identity(), Vector3::from(*at));
        Solid::cuboid(*size).boxes(&pose, &CAMERA, &Se3::identity()).unwrap().whole
    }

    fn visible_boxes(objects: &[([f64; 3], [f64; 3])]) -> Vec<Option<(BoundingBox, f64)>> {
        let solids: Vec<_> = objects.iter().map(|(size, _)| Solid::cuboid(*size)).collect();
        let at = |(_, at): &([f64; 3], [f64; 3])| Se3::new(So3::identity(), Vector3::from(*at));
        let image = DepthImage::new(solids.iter().zip(objects.iter().map(at)), &CAMERA);
        (0..solids.len()).map(|i| image.visible_part(i, whole(&objects[i]))).collect()
    }

    #[test]
    fn alone_it_is_seen_as_it_is() {
        let sheet = ([0.4, 0.4, 0.1], [0.0, 0.0, 2.0]);
        assert_eq!(visible_boxes(&[sheet])[0], Some((whole(&sheet), 1.0)));
    }

    #[test]
    fn an_image_however_large_has_cells_in_bounds() {
        let camera = Camera { width: u32::MAX, height: u32::MAX, ..CAMERA };
        let image = DepthImage::new(std::iter::empty(), &camera);
        assert_eq!(image.nearest.len(), 1_000_000);
    }

    #[test]
    fn what_is_behind_ends_where_the_other_begins() {
        // the nearer sheet, at 0.95 m, covers x > 320 px
        let sheet = ([0.4, 0.4, 0.1], [0.0, 0.0, 2.0]);
        let found = visible_boxes(&[sheet, ([1.0, 1.0, 0.1], [0.5, 0.0, 1.0])]);
        let (behind, share) = found[0].unwrap();
        assert!((behind.xmax - 320.0).abs() <= CELL_PX, "{behind:?}");
        assert_eq!(behind.xmin, whole(&sheet).xmin);
        assert!((share - 0.5).abs() < 0.05, "{share}");
        assert_eq!(found[1].unwrap().1, 1.0);
        // in the middle it covers everything
        assert!(visible_boxes(&[sheet, ([1.0, 1.0, 0.1], [0.0, 0.0, 1.0])])[0].is_none());
    }
}
