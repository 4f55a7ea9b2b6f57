//! Viewing directions.
use manifactor_graph::Direction;
use nalgebra::{Point2, Vector3};

/// Viewing direction of a parallel projection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Viewpoint {
    /// From above.
    Top,
    /// From the side, with up at the top.
    Side,
    /// From above at an angle.
    Oblique,
}

/// Elevation of the oblique view. Unit: radians.
const ELEVATION: f64 = 0.6;

/// Largest absolute coordinate. Its square is finite, so outlines and margins are finite too.
const FAR: f64 = 1e150;

/// The plane of a picture: two orthogonal unit vectors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    right: Vector3<f64>,
    upward: Vector3<f64>,
    /// Names of the two axes, if they are axes of the frame.
    pub(crate) labels: [&'static str; 2],
}

impl Viewpoint {
    /// Returns the plane of the picture for this up direction. With z up, a top view shows x to the right
    /// and y upward.
    pub(crate) fn plane(self, up: &Direction) -> Plane {
        let up: Vector3<f64> = **up;
        // the frame's axis with the smallest component along `up`; x if x and y are equal
        let right = match up.x.abs() <= up.y.abs() + 1e-9 {
            true => Vector3::x(),
            false => Vector3::y(),
        };
        let right = (right - up * right.dot(&up)).normalize();
        let ahead = up.cross(&right);
        match self {
            Viewpoint::Top => Plane { right, upward: ahead, labels: [name(&right), name(&ahead)] },
            Viewpoint::Oblique => {
                let upward = ahead * ELEVATION.sin() + up * ELEVATION.cos();
                Plane { right, upward, labels: [name(&right), "upward"] }
            }
            Viewpoint::Side => Plane { right, upward: up, labels: [name(&right), "up"] },
        }
    }
}

impl Plane {
    /// Projects `p`. Coordinates are limited to ±[`FAR`].
    pub(crate) fn project(&self, p: &Vector3<f64>) -> Point2<f64> {
        Point2::new(self.right.dot(p), self.upward.dot(p)).map(|x| x.clamp(-FAR, FAR))
    }
}

/// Returns the name of an axis of the frame, or `horizontal` for any different direction.
fn name(direction: &Vector3<f64>) -> &'static str {
    let names = [["x", "-x"], ["y", "-y"], ["z", "-z"]];
    let found = names.iter().zip(direction.iter()).find(|(_, along)| along.abs() > 1.0 - 1e-6);
    found.map_or("horizontal", |([ahead, behind], along)| if *along > 0.0 { ahead } else { behind })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn with_z_up_x_points_right_and_y_upward() {
        let plane = Viewpoint::Top.plane(&Direction::Z);
        assert_eq!(plane.project(&Vector3::new(1.0, 2.0, 3.0)), Point2::new(1.0, 2.0));
        assert_eq!(plane.labels, ["x", "y"]);
        let side = Viewpoint::Side.plane(&Direction::Z);
        assert_eq!(side.project(&Vector3::new(1.0, 2.0, 3.0)), Point2::new(1.0, 3.0));
    }

    #[test]
    fn in_a_camera_frame_depth_is_upward() {
        let up = Direction::new(Vector3::new(0.0, -1.0, 0.0)).unwrap();
        let plane = Viewpoint::Top.plane(&up);
        assert_eq!(plane.project(&Vector3::new(1.0, 2.0, 3.0)), Point2::new(1.0, 3.0));
        assert_eq!(plane.labels, ["x", "z"]);
    }

    #[test]
    fn any_up_gives_a_right_angle() {
        for up in [[1.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1e-12], [-1.0, 0.3, 0.0]] {
            let up = Direction::new(up.into()).unwrap();
            for view in [Viewpoint::Top, Viewpoint::Side, Viewpoint::Oblique] {
                let plane = view.plane(&up);
                assert!(plane.right.dot(&plane.upward).abs() < 1e-12);
                assert!(
                    (plane.right.norm() - 1.0).abs() < 1e-12 && (plane.upward.norm() - 1.0).abs() < 1e-12
                );
            }
        }
    }
}
