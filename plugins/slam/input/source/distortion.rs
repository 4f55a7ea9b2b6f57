//! Boxes as a camera without a lens would have them.
use super::SourceError;
use crate::input::sequence::Detection;
use manifactor_quadric::{BoundingBox, Camera};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a lens bends the image: k₁, k₂, p₁, p₂, k₃ in the order of OpenCV, radial and tangential (Brown, *Close-range camera
/// calibration*, 1971).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Distortion([f64; 5]);

/// Steps until a point is found, and how near it has to be, in units of the focal length.
const STEPS: usize = 100;
const NEAR: f64 = 1e-9;

impl Distortion {
    /// Where the lens puts a point; both in units of the focal length, from the centre of the image.
    fn bent(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [k1, k2, p1, p2, k3] = self.0;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let sideways = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
        let upward = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
        [x * radial + sideways, y * radial + upward]
    }

    /// The pixel without the lens; `None` where there is none that is near.
    fn straightened(&self, camera: &Camera, [u, v]: [f64; 2]) -> Option<[f64; 2]> {
        let seen_y = (v - camera.cy) / camera.fy;
        let seen = [(u - camera.cx - camera.skew * seen_y) / camera.fx, seen_y];
        let mut point = seen;
        for _ in 0..STEPS {
            let [x, y] = self.bent(point);
            let off = [seen[0] - x, seen[1] - y];
            point = [point[0] + off[0], point[1] + off[1]];
            if off[0].hypot(off[1]) < NEAR {
                let [x, y] = point;
                return Some([camera.fx * x + camera.skew * y + camera.cx, camera.fy * y + camera.cy]);
            }
        }
        None
    }

    /// A box whose sides touch its object in their middles, as those of an ellipse do that stands or lies.
    fn without(&self, camera: &Camera, seen: &BoundingBox) -> Option<BoundingBox> {
        let [x, y] = [0.5 * (seen.xmin + seen.xmax), 0.5 * (seen.ymin + seen.ymax)];
        let side = |u, v, axis: usize| Some(self.straightened(camera, [u, v])?[axis]);
        let bounds =
            [side(seen.xmin, y, 0)?, side(x, seen.ymin, 1)?, side(seen.xmax, y, 0)?, side(x, seen.ymax, 1)?];
        BoundingBox::new(bounds).ok()
    }
}

/// Frees all boxes of the distortion, if there is any.
///
/// # Errors
/// Where a box has no place in the image without it.
pub(super) fn straighten(
    distortion: Option<Distortion>,
    camera: &Camera,
    detections: &mut [Detection],
) -> Result<(), SourceError> {
    let Some(distortion) = distortion else { return Ok(()) };
    for detection in detections {
        let seen = detection.bounding_box;
        detection.bounding_box = distortion
            .without(camera, &seen)
            .ok_or(SourceError::Distorted { frame: detection.frame, bounds: seen.bounds() })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::source::CameraChoice;

    /// The calibration of freiburg1, as the benchmark publishes it.
    const FREIBURG1: Distortion = Distortion([0.2624, -0.9531, -0.0054, 0.0026, 1.1633]);

    fn camera() -> Camera {
        serde_json::from_value::<CameraChoice>("freiburg1".into()).unwrap().camera()
    }

    #[test]
    fn what_a_lens_bends_is_straightened() {
        let camera = camera();
        for pixel in [[318.6, 255.3], [20.0, 30.0], [600.0, 50.0], [300.0, 460.0]] {
            let [u, v] = FREIBURG1.straightened(&camera, pixel).unwrap();
            let [x, y] = FREIBURG1.bent([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy]);
            let again = [camera.fx * x + camera.cx, camera.fy * y + camera.cy];
            assert!((again[0] - pixel[0]).hypot(again[1] - pixel[1]) < 1e-5, "{again:?}, not {pixel:?}");
        }
    }

    #[test]
    fn a_box_in_the_middle_stays_and_one_at_the_side_moves_by_pixels() {
        let camera = camera();
        let moved = |bounds: [f64; 4]| {
            let free = FREIBURG1.without(&camera, &BoundingBox::new(bounds).unwrap()).unwrap().bounds();
            free.iter().zip(bounds).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        assert!(moved([310.0, 245.0, 330.0, 265.0]) < 0.1);
        let at_the_side = moved([20.0, 30.0, 120.0, 200.0]);
        assert!((2.0..12.0).contains(&at_the_side), "{at_the_side}");
    }

    #[test]
    fn a_lens_that_folds_the_image_is_refused() {
        let folds = Distortion([-9.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(folds.straightened(&camera(), [20.0, 30.0]).is_none());
    }
}
