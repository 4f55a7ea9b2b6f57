//! Ellipses in an image, and their part inside the image.
use manifactor_graph::Scalar;
use nalgebra::Vector2;

/// An ellipse in pixels: the points centre + x with xᵀΣ⁻¹x ≤ 1, Σ = [xx xy; xy yy] positive definite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse<T: Scalar = f64> {
    /// Centre.
    pub centre: Vector2<T>,
    /// Square of half the width.
    pub xx: T,
    /// Off-diagonal entry of Σ; 0 if the axes of the ellipse are parallel to the image axes.
    pub xy: T,
    /// Square of half the height.
    pub yy: T,
    /// Determinant xx yy - xy². Stored, as the difference loses its digits for thin ellipses.
    pub determinant: T,
}

/// One side of a box around an ellipse, with the line that determines its position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Side<T> {
    /// The end of the ellipse: the line touches the ellipse at `bound` and `across`, one coordinate per image
    /// axis, and has the normal (1, slope), with the axis of the side first.
    Touched { bound: T, across: T, slope: T },
    /// The border of the image.
    Border(f64),
}

impl<T: Scalar> Side<T> {
    pub(crate) fn bound(&self) -> T {
        match self {
            Side::Touched { bound, .. } => *bound,
            Side::Border(bound) => T::from(*bound),
        }
    }
}

/// An ellipse with one image axis selected: its bounds along this axis, between borders across it.
struct AxisBounds<T> {
    centre: T,
    across: T,
    /// Entries of Σ: along, mixed, across.
    aa: T,
    ab: T,
    bb: T,
    determinant: T,
}

impl<T: Scalar> AxisBounds<T> {
    /// Returns the end of the whole ellipse; `sign` is -1 for the lower end, 1 for the upper.
    #[inline(always)]
    fn end(&self, sign: f64) -> Side<T> {
        let half = self.aa.sqrt() * sign;
        Side::Touched { bound: self.centre + half, across: self.across + self.ab / half, slope: T::zero() }
    }
    /// Returns the end of the part within 0 and `limit` across; `None` if there is no such part.
    ///
    /// The part is convex: it ends at the end of the ellipse, or at the intersection of the ellipse with the
    /// border that cuts its end off. The bound is differentiable even at the transition between the two
    /// cases.
    #[inline(always)]
    fn end_within(&self, sign: f64, limit: f64) -> Option<Side<T>> {
        let whole = self.end(sign);
        let Side::Touched { across, .. } = whole else { return Some(whole) };
        let border = if across < T::zero() {
            T::zero()
        } else if across > T::from(limit) {
            T::from(limit)
        } else {
            return Some(whole);
        };
        let off = border - self.across;
        let chord = T::one() - off * off / self.bb;
        let half = (self.determinant * chord / self.bb).sqrt() * sign;
        if !(chord > T::zero() && half != T::zero()) {
            return None;
        }
        let lean = self.ab / self.bb;
        let slope = self.determinant * off / (self.bb * self.bb * half) - lean;
        Some(Side::Touched { bound: self.centre + lean * off + half, across: border, slope })
    }
    /// Returns both ends of the part inside an image of this size.
    #[inline(always)]
    fn ends_inside(&self, length: f64, limit: f64) -> Option<[Side<T>; 2]> {
        let [low, high] = [self.end_within(-1.0, limit)?, self.end_within(1.0, limit)?];
        if low.bound() >= T::from(length) || high.bound() <= T::zero() {
            return None;
        }
        // A bound on the border counts as the border, with the derivative of a constant.
        Some([
            if low.bound() <= T::zero() { Side::Border(0.0) } else { low },
            if high.bound() >= T::from(length) { Side::Border(length) } else { high },
        ])
    }
}

impl<T: Scalar> Ellipse<T> {
    #[inline(always)]
    fn along_x(&self) -> AxisBounds<T> {
        AxisBounds {
            centre: self.centre.x,
            across: self.centre.y,
            aa: self.xx,
            ab: self.xy,
            bb: self.yy,
            determinant: self.determinant,
        }
    }
    #[inline(always)]
    fn along_y(&self) -> AxisBounds<T> {
        AxisBounds {
            centre: self.centre.y,
            across: self.centre.x,
            aa: self.yy,
            ab: self.xy,
            bb: self.xx,
            determinant: self.determinant,
        }
    }
    /// Returns xmin, ymin, xmax, ymax of the whole ellipse.
    #[inline(always)]
    pub fn bounds(&self) -> [T; 4] {
        let (w, h) = (self.xx.sqrt(), self.yy.sqrt());
        let c = &self.centre;
        [c.x - w, c.y - h, c.x + w, c.y + h]
    }
    /// Returns the exact xmin, ymin, xmax, ymax of the part inside an image of this size; `None` if no part
    /// is inside.
    pub fn truncated_bounds(&self, size: Vector2<f64>) -> Option<[T; 4]> {
        self.truncated_sides(size).map(|sides| sides.map(|side| side.bound()))
    }
    /// Returns the sides of [`Ellipse::bounds`].
    #[inline(always)]
    pub(crate) fn sides(&self) -> [Side<T>; 4] {
        let (x, y) = (self.along_x(), self.along_y());
        [x.end(-1.0), y.end(-1.0), x.end(1.0), y.end(1.0)]
    }
    /// Returns the sides of [`Ellipse::truncated_bounds`].
    #[inline(always)]
    pub(crate) fn truncated_sides(&self, size: Vector2<f64>) -> Option<[Side<T>; 4]> {
        let [xmin, xmax] = self.along_x().ends_inside(size.x, size.y)?;
        let [ymin, ymax] = self.along_y().ends_inside(size.y, size.x)?;
        Some([xmin, ymin, xmax, ymax])
    }
}
