//! Curves, pose graphs, and pictures next to each other.
use super::stage::Stage;
use crate::canvas::{Ink, Sheet, Stroke};
use crate::drawing::{Chart, Curve, HEAD, Picture, Viewpoint, figure, title};
use crate::run::{self, cost};
use manifactor_graph::Direction;
use manifactor_slam::record::VariantRecord;
use nalgebra::{Point2, Vector3};

/// Curves over a common axis, in panels one below the other.
#[derive(Debug, Clone, Default)]
pub struct Plot {
    x: String,
    log_x: bool,
    panels: Vec<Chart>,
}

impl Plot {
    /// Creates a plot over the quantity `x`.
    pub fn over(x: &str) -> Self {
        Self { x: x.to_owned(), ..Self::default() }
    }

    /// Makes the axis of `x` logarithmic.
    #[must_use]
    pub fn logarithmic(self) -> Self {
        Self { log_x: true, ..self }
    }

    /// Adds a panel of the quantity `y`, with a logarithmic axis if `is_log`. Each curve has a name and points.
    #[must_use]
    pub fn panel(mut self, y: &str, is_log: bool, curves: Vec<(String, Vec<(f64, f64)>)>) -> Self {
        let curve = |(i, (name, points)): (usize, (String, Vec<(f64, f64)>))| {
            let has_dots = points.len() < 40;
            let curve = Curve::new(&name, Ink::Series(i), points);
            if has_dots { curve.with_dots() } else { curve }
        };
        let curves = curves.into_iter().enumerate().map(curve).collect();
        self.panels.push(Chart { y: y.to_owned(), log_y: is_log, begun_at_zero: false, curves });
        self
    }

    /// Draws the plot. `None` if no curve has a point.
    pub fn picture(&self, name: &str, text: &str, width: f64, height: f64) -> Option<Picture> {
        let sheet = figure(text, &self.x, self.log_x, &self.panels, width, height)?;
        Some(Picture::new(name, text, sheet))
    }
}

/// Draws the costs of variants over accepted steps; the costs of several variants are shares of the initial
/// cost.
pub fn costs(variants: &[VariantRecord], width: f64) -> Option<Picture> {
    cost(&run::costs(variants), width)
}

/// Draws pictures next to each other, the first at the left.
pub fn beside(name: &str, text: &str, pictures: &[Picture]) -> Picture {
    let sheets = || pictures.iter().map(Picture::sheet);
    let height = sheets().map(|sheet| sheet.height).fold(0.0, f64::max);
    let mut sheet = Sheet::new(sheets().map(|sheet| sheet.width).sum(), height);
    let mut left = 0.0;
    for part in sheets() {
        sheet.place(part.clone(), [left, 0.0]);
        left += part.width;
    }
    Picture::new(name, text, sheet)
}

/// Draws a planar pose graph: the path over the poses in order, and the edges between poses that do not follow
/// each other. An edge to a pose that is not there is left out. `None` without a pose.
pub fn pose_graph(text: &str, positions: &[[f64; 2]], edges: &[[usize; 2]], width: f64) -> Option<Picture> {
    let plane = Viewpoint::Top.plane(&Direction::Z);
    let points: Vec<Point2<f64>> =
        positions.iter().map(|[x, y]| plane.project(&Vector3::new(*x, *y, 0.0))).collect();
    let area = [10.0, HEAD + 4.0, width - 10.0, HEAD + 4.0 + width - 20.0];
    let stage = Stage::around(plane, points.iter().copied(), area)?;
    let mut sheet = Sheet::new(width, area[3] + 10.0);
    title(&mut sheet, text);
    let at = |i: usize| points.get(i).map(|p| stage.at(p));
    for [from, to] in edges {
        if let Some((from, to)) = at(*from).zip(at(*to)).filter(|_| from.abs_diff(*to) > 1) {
            sheet.line(vec![from, to], Stroke::solid(Ink::Odometry, 1.0));
        }
    }
    sheet.line((0..points.len()).filter_map(at).collect(), Stroke::solid(Ink::Estimate, 1.4));
    Some(Picture::new("pose_graph", text, sheet))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::Theme;

    #[test]
    fn pictures_beside_each_other_keep_their_widths() {
        let part =
            |text: &str| pose_graph(text, &[[0.0, 0.0], [1.0, 2.0], [0.0, 3.0]], &[[0, 2], [0, 9]], 300.0);
        let both = beside("both", "before and after", &[part("before").unwrap(), part("after").unwrap()]);
        let svg = both.svg(Theme::Light);
        assert!(svg.contains("width=\"600\"") && svg.contains(">before<") && svg.contains(">after<"));
        assert_eq!(svg.matches(Ink::Odometry.hex(Theme::Light)).count(), 2, "one edge in each");
        assert!(pose_graph("empty", &[], &[], 300.0).is_none());
    }

    #[test]
    fn a_plot_without_points_is_none() {
        assert!(Plot::over("t").panel("y", false, vec![]).picture("a", "a", 300.0, 200.0).is_none());
        let plot = Plot::over("t").panel("y", true, vec![("c".into(), vec![(0.0, 1.0), (1.0, 9.0)])]);
        assert!(plot.picture("a", "a", 300.0, 200.0).is_some());
    }
}
