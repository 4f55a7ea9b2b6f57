//! Landmark metrics of Jablonsky et al., and the overlap of oriented cuboids: the error of a mapped object.
use crate::shapes::Box3;
use crate::shapes::DualQuadric;
use manifactor_geometry::Se3;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Error of an estimated object against the true one, both in one frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LandmarkError {
    /// Distance between the centroids of the quadric and of the true box, in metres.
    pub position: f64,
    /// Jaccard distance, 1 - IoU, between the quadric's axis-aligned box and the true box, both centred at
    /// the origin: 0 to 1.
    pub shape: f64,
    /// Jaccard distance between the two boxes at their actual positions: 0 to 1.
    pub quality: f64,
    /// Jaccard distance between the oriented cuboids around the quadric and around the true object: 0 to 1. Unlike
    /// the other measures, it includes the orientation.
    pub volume: f64,
    /// Angle between the z axis of the true cuboid, which points up while the object rests as usual, and the
    /// nearest principal axis of the quadric, in rad: 0 to 0.96.
    pub tilt: f64,
    /// Error of the proportions: RMS of the differences between the logarithms of the sorted semi-axes, each divided by
    /// their geometric mean. 0.1 is about 10 %.
    pub proportions: f64,
}

/// An oriented cuboid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cuboid {
    /// Centre and axes.
    pub pose: Se3,
    /// Half extents along the axes, in metres.
    pub half_extents: Vector3<f64>,
}

/// Sample points of a cuboid along each axis.
const SAMPLES: usize = 40;

impl Cuboid {
    /// Returns the volume, in cubic metres.
    pub fn volume(&self) -> f64 {
        8.0 * self.half_extents.product()
    }

    /// Returns the intersection over union of two cuboids, from a grid of points in the smaller one. The error is
    /// below 0.02; 0 if a volume is zero.
    pub fn iou(&self, other: &Self) -> f64 {
        let (small, large) = if self.volume() <= other.volume() { (self, other) } else { (other, self) };
        let large_from_small = large.pose.between(&small.pose);
        let at = |i: usize| (2 * i + 1) as f64 / SAMPLES as f64 - 1.0;
        let mut inside = 0usize;
        for (x, y, z) in (0..SAMPLES)
            .flat_map(|x| (0..SAMPLES).map(move |y| (x, y)))
            .flat_map(|(x, y)| (0..SAMPLES).map(move |z| (x, y, z)))
        {
            let point = Vector3::new(at(x), at(y), at(z)).component_mul(&small.half_extents);
            let seen = large_from_small.act(&point);
            inside += usize::from(seen.abs() <= large.half_extents);
        }
        let shared = small.volume() * inside as f64 / (SAMPLES * SAMPLES * SAMPLES) as f64;
        if shared > 0.0 { shared / (small.volume() + large.volume() - shared) } else { 0.0 }
    }
}

impl From<&Box3> for Cuboid {
    fn from(b: &Box3) -> Self {
        let pose = Se3 { translation: b.centroid(), ..Se3::identity() };
        Self { pose, half_extents: (b.max - b.min) / 2.0 }
    }
}

impl LandmarkError {
    /// Computes the error of an estimate against the axis-aligned box and the cuboid of the true object.
    pub fn of(estimate: &DualQuadric, truth: &Box3, cuboid: &Cuboid) -> Self {
        let estimated = estimate.axes_aligned_box();
        Self {
            position: (estimate.centroid() - truth.centroid()).norm(),
            shape: 1.0 - estimated.centred().iou(&truth.centred()),
            quality: 1.0 - estimated.iou(truth),
            volume: 1.0 - Cuboid { pose: estimate.pose, half_extents: estimate.semi_axes }.iou(cuboid),
            tilt: tilt(&estimate.pose, &cuboid.pose),
            proportions: (log_proportions(&estimate.semi_axes) - log_proportions(&cuboid.half_extents))
                .norm()
                / 3f64.sqrt(),
        }
    }
}

/// Returns the angle between the z axis of `truth` and the nearest axis of `estimate`, in rad.
fn tilt(estimate: &Se3, truth: &Se3) -> f64 {
    let up = truth.rotation.act(&Vector3::z());
    // in the frame of the estimate, the largest component is the cosine to the nearest axis
    let up = estimate.rotation.inverse().act(&up).abs();
    let rest = up.norm_squared() - up.max().powi(2);
    rest.max(0.0).sqrt().atan2(up.max())
}

/// Returns the sorted logarithms of semi-axes minus their mean.
fn log_proportions(semi_axes: &Vector3<f64>) -> Vector3<f64> {
    let mut logs = semi_axes.map(|axis| axis.max(f64::MIN_POSITIVE).ln());
    logs.as_mut_slice().sort_by(f64::total_cmp);
    logs.add_scalar(-logs.mean())
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::So3;

    fn error_of(estimate: &DualQuadric, truth: &Box3) -> LandmarkError {
        LandmarkError::of(estimate, truth, &truth.into())
    }

    #[test]
    fn position_shape_and_quality_are_apart() {
        let truth = Box3::around(Vector3::new(1.0, 2.0, 3.0), Vector3::repeat(2.0));
        let pose = Se3::new(So3::identity(), truth.centroid());
        let right = DualQuadric { pose, semi_axes: Vector3::repeat(1.0) };
        assert_eq!(
            error_of(&right, &truth),
            LandmarkError {
                position: 0.0,
                shape: 0.0,
                quality: 0.0,
                volume: 0.0,
                tilt: 0.0,
                proportions: 0.0
            }
        );

        let beside = DualQuadric { pose: Se3::new(So3::identity(), Vector3::new(2.0, 2.0, 3.0)), ..right };
        let error = error_of(&beside, &truth);
        assert_eq!((error.position, error.shape), (1.0, 0.0));
        assert!((error.quality - 2.0 / 3.0).abs() < 1e-15);

        let large = DualQuadric { semi_axes: Vector3::new(2.0, 1.0, 1.0), ..right };
        let error = error_of(&large, &truth);
        assert_eq!((error.position, error.shape, error.quality), (0.0, 0.5, 0.5));
    }

    #[test]
    fn objects_far_apart_have_nothing_in_common() {
        let truth = Box3::around(Vector3::zeros(), Vector3::repeat(2.0));
        let pose = Se3::new(So3::identity(), Vector3::new(9.0, 0.0, 0.0));
        let far = DualQuadric { pose, semi_axes: Vector3::repeat(1.0) };
        assert_eq!(
            error_of(&far, &truth),
            LandmarkError {
                position: 9.0,
                shape: 0.0,
                quality: 1.0,
                volume: 1.0,
                tilt: 0.0,
                proportions: 0.0
            }
        );
    }

    #[test]
    fn tilt_and_proportions_do_not_depend_on_the_order_and_the_size_of_axes() {
        let cuboid = Cuboid { pose: Se3::identity(), half_extents: Vector3::new(0.1, 0.2, 0.4) };
        let around = Box3::around(Vector3::zeros(), Vector3::repeat(1.0));
        let error = |turn: Vector3<f64>, semi_axes: Vector3<f64>| {
            let pose = Se3::new(So3::exp(&turn), Vector3::zeros());
            let error = LandmarkError::of(&DualQuadric { pose, semi_axes }, &around, &cuboid);
            (error.tilt, error.proportions)
        };
        let quarter = std::f64::consts::FRAC_PI_2;
        let turned = error(Vector3::new(quarter, 0.0, 0.0), Vector3::new(0.3, 1.2, 0.6));
        assert!(turned.0 < 1e-12 && turned.1 < 1e-12, "{turned:?}");
        let (tilt, _) = error(Vector3::new(0.0, 0.3, 0.0), cuboid.half_extents);
        assert!((tilt - 0.3).abs() < 1e-12, "{tilt}");
        // a ball: the logarithms differ by -ln 2, 0 and ln 2
        let (_, proportions) = error(Vector3::zeros(), Vector3::repeat(0.2));
        assert!((proportions - 2f64.ln() * (2.0f64 / 3.0).sqrt()).abs() < 1e-12, "{proportions}");
    }

    #[test]
    fn the_overlap_of_cuboids_depends_on_orientation_and_order_does_not_matter() {
        let plate = |angle: f64, z: f64| Cuboid {
            pose: Se3::new(So3::exp(&Vector3::new(0.0, angle, 0.0)), Vector3::new(0.0, 0.0, z)),
            half_extents: Vector3::new(0.2, 0.1, 0.01),
        };
        let level = plate(0.0, 0.0);
        assert_eq!(level.iou(&level), 1.0);
        // half of the thickness is shared: 1/3
        assert!((level.iou(&plate(0.0, 0.01)) - 1.0 / 3.0).abs() < 1e-9);
        let crossed = level.iou(&plate(std::f64::consts::FRAC_PI_2, 0.0));
        // a square column of 0.02 by 0.02 of a plate of 0.4 by 0.02
        assert!((crossed - 0.05 / 1.95).abs() < 1e-3, "{crossed}");
        let tilted = plate(0.3, 0.0);
        assert!((level.iou(&tilted) - tilted.iou(&level)).abs() < 0.02);
        let flat = Cuboid { half_extents: Vector3::new(0.2, 0.1, 0.0), ..level };
        assert_eq!(level.iou(&flat), 0.0);
    }
}
