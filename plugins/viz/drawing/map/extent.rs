//! The part of a plane that a map shows, and its place on a sheet.
use crate::drawing::axes::Axes;
use crate::drawing::scale::Scale;
use nalgebra::{Point2, Vector2};

/// Smallest and largest height of the area, as a fraction of the width.
const SHARES: [f64; 2] = [0.3, 0.9];

/// The part of the plane that is shown.
#[derive(Debug, Default)]
pub(crate) struct Extent(Option<(Point2<f64>, Point2<f64>)>);

impl Extent {
    pub(crate) fn include(&mut self, p: &Point2<f64>) {
        let (low, high) = self.0.unwrap_or((*p, *p));
        self.0 = Some((low.inf(p), high.sup(p)));
    }

    /// Returns how far a point lies outside along x or y.
    fn beyond(&self, p: &Point2<f64>) -> f64 {
        self.0.map_or(0.0, |(low, high)| (low - p).sup(&(p - high)).max().max(0.0))
    }

    /// Includes the outlines within a margin around the extent, and returns them with the number of
    /// outlines outside. `points` are those of an outline. The margin is half the extent's size, or three times the
    /// distance of the median outline if that is larger. Most objects are far outside if the camera hardly moved.
    pub(crate) fn include_near<'a, T>(
        &mut self,
        outlines: &'a [T],
        points: impl Fn(&T) -> &[Point2<f64>],
    ) -> (Vec<&'a T>, usize) {
        let beyond = |o: &T| points(o).iter().map(|p| self.beyond(p)).fold(0.0, f64::max);
        let distances: Vec<f64> = outlines.iter().map(beyond).collect();
        let mut sorted = distances.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len().saturating_sub(1) / 2).copied().unwrap_or(0.0);
        let margin = (0.5 * self.size()).max(3.0 * median);
        let near = outlines.iter().zip(&distances).filter(|(_, distance)| **distance <= margin);
        let near: Vec<_> = near.map(|(outline, _)| outline).collect();
        near.iter().flat_map(|outline| points(outline)).for_each(|p| self.include(p));
        let outside = outlines.len() - near.len();
        (near, outside)
    }

    /// Returns the longer side.
    fn size(&self) -> f64 {
        self.0.map_or(0.0, |(low, high)| (high - low).max())
    }

    /// Returns its scales on a sheet of this width.
    pub(crate) fn on(&self, width: f64) -> Plot {
        let (low, high) = self.0.unwrap_or((Point2::new(-1.0, -1.0), Point2::new(1.0, 1.0)));
        // for a single point, or points so far out that a relative margin is below rounding
        let margin = (0.03 * self.size()).max(1e-9 * low.coords.amax().max(high.coords.amax()));
        let margin = Vector2::repeat(if margin > 0.0 { margin } else { 1.0 });
        let (middle, mut half) = (nalgebra::center(&low, &high), 0.5 * (high - low) + margin);
        // the most that numbers and labels need; space that they leave widens the view on both sides
        let across = width - 100.0;
        let height = (across * half.y / half.x).clamp(SHARES[0] * width, SHARES[1] * width);
        let metres = (half.x / across).max(half.y / height);
        half.y = metres * height;
        let y = Scale::new(middle.y - half.y, middle.y + half.y);
        let left = 10.0 + Axes::left(&y, height);
        half.x = metres * (width - RIGHT - left);
        let x = Scale::new(middle.x - half.x, middle.x + half.x);
        Plot { x, y, area: [left, 0.0, width - RIGHT, height] }
    }
}

/// Space at the right edge. Unit: pixels.
const RIGHT: f64 = 18.0;

/// Scales with equal units on both axes, and the area that they need, from 0 downward.
pub(crate) struct Plot {
    pub(crate) x: Scale,
    pub(crate) y: Scale,
    pub(crate) area: [f64; 4],
}
