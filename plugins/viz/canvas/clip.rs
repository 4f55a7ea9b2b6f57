//! Clips paths slightly outside the sheet. Renderers compute in single precision or fixed point, so they
//! draw far coordinates incorrectly, and tiny-skia panics.
use super::{Item, Sheet};

/// Margin around the sheet, wider than any stroke, so that an edge along this border is not visible. Unit:
/// pixels.
const MARGIN: f64 = 64.0;

type Point = [f64; 2];

/// A half plane: the coordinates on one side of a bound.
#[derive(Clone, Copy)]
struct Side {
    axis: usize,
    bound: f64,
    /// 1 if the coordinates below the bound are inside, −1 if those above it are.
    sign: f64,
}

impl Sheet {
    /// Returns the items that can be drawn. Paths are clipped at a margin around the sheet. Items outside
    /// of it, and items with a non-finite coordinate, are omitted.
    pub(super) fn drawable(&self) -> impl Iterator<Item = Item> {
        let sides = [
            Side { axis: 0, bound: self.width + MARGIN, sign: 1.0 },
            Side { axis: 0, bound: -MARGIN, sign: -1.0 },
            Side { axis: 1, bound: self.height + MARGIN, sign: 1.0 },
            Side { axis: 1, bound: -MARGIN, sign: -1.0 },
        ];
        let holds = move |p: &Point| sides.iter().all(|side| side.holds(p));
        self.items.iter().flat_map(move |item| match item {
            Item::Path { points, .. } if points.iter().all(holds) => vec![item.clone()],
            Item::Path { points, .. } if points.iter().flatten().any(|x| !x.is_finite()) => vec![],
            Item::Path { points, closed, stroke, fill } => {
                let parts = if *closed { vec![polygon(points, &sides)] } else { lines(points, &sides) };
                let path = |points| Item::Path { points, closed: *closed, stroke: *stroke, fill: *fill };
                parts.into_iter().filter(|part| !part.is_empty()).map(path).collect()
            }
            Item::Dot { at, radius, .. } => {
                Vec::from_iter((holds(at) && (0.0..=MARGIN).contains(radius)).then(|| item.clone()))
            }
            Item::Text(text) => Vec::from_iter(holds(&text.at).then(|| item.clone())),
        })
    }
}

impl Side {
    fn holds(&self, p: &Point) -> bool {
        self.sign * p[self.axis] <= self.sign * self.bound
    }

    /// Returns the intersection of a segment with the bound. It computes with halves, because the
    /// difference of two finite numbers may overflow.
    fn crossing(&self, a: Point, b: Point) -> Point {
        let from = 0.5 * a[self.axis];
        let share = (0.5 * self.bound - from) / (0.5 * b[self.axis] - from);
        let mut point = [0, 1].map(|i: usize| a[i] * (1.0 - share) + b[i] * share);
        point[self.axis] = self.bound;
        point
    }
}

/// Returns the part of a filled polygon that lies inside (Sutherland and Hodgman, 1974).
fn polygon(points: &[Point], sides: &[Side]) -> Vec<Point> {
    sides.iter().fold(points.to_vec(), |points, side| {
        let ends = points.iter().cycle().skip(1);
        let edges = points.iter().zip(ends);
        edges.fold(vec![], |mut inside, (a, b)| {
            if side.holds(a) {
                inside.push(*a);
            }
            if side.holds(a) != side.holds(b) {
                inside.push(side.crossing(*a, *b));
            }
            inside
        })
    })
}

/// Returns the parts of a line that lie inside.
fn lines(points: &[Point], sides: &[Side]) -> Vec<Vec<Point>> {
    let mut parts: Vec<Vec<Point>> = vec![];
    for (a, b) in points.iter().zip(points.iter().skip(1)) {
        let inside = sides.iter().try_fold((*a, *b), |(a, b), side| match (side.holds(&a), side.holds(&b)) {
            (true, true) => Some((a, b)),
            (true, false) => Some((a, side.crossing(a, b))),
            (false, true) => Some((side.crossing(a, b), b)),
            (false, false) => None,
        });
        let Some((a, b)) = inside else { continue };
        match parts.last_mut().filter(|part| part.last() == Some(&a)) {
            Some(part) => part.push(b),
            None => parts.push(vec![a, b]),
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::{Colors, Ink, Stroke, Text, Theme};

    fn paths(sheet: &Sheet) -> Vec<Vec<Point>> {
        let points = |item| match item {
            Item::Path { points, .. } => Some(points),
            _ => None,
        };
        sheet.drawable().filter_map(points).collect()
    }

    #[test]
    fn a_coordinate_of_any_size_is_drawn_or_left_out() {
        let far = [0.0, 50.0, -50.0, 1e10, -1e10, 1e30, -1e30, 1e308, -1e308, f64::INFINITY, f64::NAN];
        let mut sheet = Sheet::new(100.0, 80.0);
        for x in far {
            for y in far {
                let points = vec![[x, y], [30.0, 20.0], [y, -x], [-x, 0.5 * y]];
                sheet.line(points.clone(), Stroke::dashed(Ink::Text, 1.0));
                sheet.outline(points, Stroke::solid(Ink::Text, 2.0), Some((Ink::Grid, 0.5)));
                sheet.area([-x.abs(), y, x, y.abs()], Ink::Grid, 0.5);
                sheet.dot([x, y], 2.0, Ink::Text);
                sheet.dot([30.0, 20.0], x, Ink::Text);
                sheet.text(Text::new("far", [x, y], 11.0, Ink::Text));
            }
        }
        assert_eq!(sheet.png(Theme::Light).unwrap().get(..4), Some(&b"\x89PNG"[..]));
        let svg = sheet.svg("", Colors::Of(Theme::Light));
        for wrong in ["NaN", "inf", "00000"] {
            assert!(!svg.contains(wrong), "{wrong}");
        }
        assert!(paths(&sheet).iter().flatten().flatten().all(|x| x.abs() <= 200.0));
    }

    #[test]
    fn a_line_keeps_its_slope_and_its_visible_parts() {
        let mut sheet = Sheet::new(100.0, 100.0);
        let stroke = Stroke::solid(Ink::Text, 1.0);
        sheet.line(vec![[-1e6, -1e6], [1e6, 1e6]], stroke);
        sheet.line(vec![[50.0, 50.0], [50.0, 1e308], [60.0, 1e308], [60.0, 50.0]], stroke);
        sheet.line(vec![[1e9, 0.0], [1e9, 50.0]], stroke);
        let paths = paths(&sheet);
        assert_eq!(paths.len(), 3);
        assert!(paths[0].iter().all(|[x, y]| (x - y).abs() < 1e-6));
        assert_eq!(paths[1..], [vec![[50.0, 50.0], [50.0, 164.0]], vec![[60.0, 164.0], [60.0, 50.0]]]);
    }

    #[test]
    fn a_polygon_around_the_sheet_fills_it() {
        let mut sheet = Sheet::new(100.0, 100.0);
        sheet.area([-1e308, -1e308, 1e308, 1e308], Ink::Text, 1.0);
        let corners = [-64.0, 164.0];
        let paths = paths(&sheet);
        assert!(corners.iter().all(|x| corners.iter().all(|y| paths[0].contains(&[*x, *y]))), "{paths:?}");
    }
}
