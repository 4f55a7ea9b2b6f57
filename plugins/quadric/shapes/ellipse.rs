//! Ellipses in an image, and what an image leaves of them.
use manifactor_graph::Scalar;
use nalgebra::Vector2;

/// The points centre + x with xᵀΣ⁻¹x ≤ 1, Σ = [xx xy; xy yy] positive definite; in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse<T: Scalar = f64> {
    /// The centre.
    pub centre: Vector2<T>,
    /// The square of half its width.
    pub xx: T,
    /// How it leans: 0 where its axes are those of the image.
    pub xy: T,
    /// The square of half its height.
    pub yy: T,
    /// xx yy - xy², kept because thin ellipses would lose it in that difference.
    pub determinant: T,
}

/// One side of a box around an ellipse: the line along the ellipse that holds the side in its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Side<T> {
    /// The ellipse ends here: the line touches it at `at`, a coordinate on each image axis, and has
    /// the normal (1, slope), the side's own axis first.
    Touched { bound: T, across: T, slope: T },
    /// The image ends here.
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

/// An ellipse with one image axis singled out: its `bound`s are sought, between borders `across`.
struct Along<T> {
    centre: T,
    across: T,
    /// Σ: along, mixed, across.
    aa: T,
    ab: T,
    bb: T,
    determinant: T,
}

impl<T: Scalar> Along<T> {
    /// Where the whole ellipse ends; `sign` is -1 for the lower end, 1 for the upper.
    #[inline(always)]
    fn end(&self, sign: f64) -> Side<T> {
        let half = self.aa.sqrt() * sign;
        Side::Touched { bound: self.centre + half, across: self.across + self.ab / half, slope: T::zero() }
    }
    /// Where its part ends that is within 0 and `limit` across; `None` where there is none.
    ///
    /// The part is convex: it ends where the ellipse does, or where the ellipse meets the border that
    /// cuts its end off. The bound has a derivative even where the one becomes the other.
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
    /// Both ends of what is inside of an image of that size.
    #[inline(always)]
    fn ends_inside(&self, length: f64, limit: f64) -> Option<[Side<T>; 2]> {
        let [low, high] = [self.end_within(-1.0, limit)?, self.end_within(1.0, limit)?];
        if low.bound() >= T::from(length) || high.bound() <= T::zero() {
            return None;
        }
        // a bound on the border belongs to the border: its derivative is that of a constant
        Some([
            if low.bound() <= T::zero() { Side::Border(0.0) } else { low },
            if high.bound() >= T::from(length) { Side::Border(length) } else { high },
        ])
    }
}

impl<T: Scalar> Ellipse<T> {
    #[inline(always)]
    fn along_x(&self) -> Along<T> {
        Along {
            centre: self.centre.x,
            across: self.centre.y,
            aa: self.xx,
            ab: self.xy,
            bb: self.yy,
            determinant: self.determinant,
        }
    }
    #[inline(always)]
    fn along_y(&self) -> Along<T> {
        Along {
            centre: self.centre.y,
            across: self.centre.x,
            aa: self.yy,
            ab: self.xy,
            bb: self.xx,
            determinant: self.determinant,
        }
    }
    /// xmin, ymin, xmax, ymax of all of it.
    #[inline(always)]
    pub fn bounds(&self) -> [T; 4] {
        let (w, h) = (self.xx.sqrt(), self.yy.sqrt());
        let c = &self.centre;
        [c.x - w, c.y - h, c.x + w, c.y + h]
    }
    /// xmin, ymin, xmax, ymax of what is inside of an image of that size, exactly; `None` where
    /// nothing is.
    pub fn truncated_bounds(&self, size: Vector2<f64>) -> Option<[T; 4]> {
        self.truncated_sides(size).map(|sides| sides.map(|side| side.bound()))
    }
    /// The sides of [`Ellipse::bounds`].
    #[inline(always)]
    pub(crate) fn sides(&self) -> [Side<T>; 4] {
        let (x, y) = (self.along_x(), self.along_y());
        [x.end(-1.0), y.end(-1.0), x.end(1.0), y.end(1.0)]
    }
    /// The sides of [`Ellipse::truncated_bounds`].
    #[inline(always)]
    pub(crate) fn truncated_sides(&self, size: Vector2<f64>) -> Option<[Side<T>; 4]> {
        let [xmin, xmax] = self.along_x().ends_inside(size.x, size.y)?;
        let [ymin, ymax] = self.along_y().ends_inside(size.y, size.x)?;
        Some([xmin, ymin, xmax, ymax])
    }
}
