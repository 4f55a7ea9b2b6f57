//! The picture of a graph, seen from above or from the side.
use super::{GraphLine, GraphPoint, GraphScene};
use crate::canvas::{Ink, Sheet, Stroke};
use crate::drawing::{
    Axes, Entry, Extent, HEAD, Label, Picture, Plane, Plot, Viewpoint, legend, place, title,
};
use manifactor_graph::Direction;
use nalgebra::{Point2, Vector3};

/// Largest number of factors that are drawn as lines; more would cover the points.
const LINES: usize = 50_000;
/// Number of factors with the largest costs that are marked.
const MARKED: usize = 10;

const BEFORE: Stroke = Stroke { ink: Ink::Odometry, width: 0.8, dashed: false };
const AFTER: Stroke = Stroke { ink: Ink::Estimate, width: 1.2, dashed: false };
const LARGEST: Stroke = Stroke { ink: Ink::Outlier, width: 2.0, dashed: false };
const OUTLIER: Stroke = Stroke { ink: Ink::Faint, width: 0.8, dashed: true };

impl GraphScene {
    /// Draws the graph from above, and from the side as well unless it is planar. Unit of `width`: pixels.
    pub fn pictures(&self, width: f64) -> Vec<Picture> {
        let views: &[_] =
            if self.is_planar() { &[Viewpoint::Top] } else { &[Viewpoint::Top, Viewpoint::Side] };
        views.iter().map(|view| self.picture(*view, width)).collect()
    }

    fn picture(&self, view: Viewpoint, width: f64) -> Picture {
        let plane = view.plane(&Direction::Z);
        let project = |of: fn(&GraphPoint) -> Vector3<f64>| -> Vec<Point2<f64>> {
            self.points().iter().map(|point| plane.project(&of(point))).collect()
        };
        let (before, after) = (project(|p| p.before), project(|p| p.after));
        let mut extent = Extent::default();
        after.iter().for_each(|p| extent.include(p));
        let each: Vec<[Point2<f64>; 1]> = before.iter().map(|p| [*p]).collect();
        let (_, outside) = extent.include_near(&each, |p| p);
        let lines = if self.lines().len() > LINES { &[] } else { self.lines() };
        let marked = marked(lines);

        let entries = legend(&self.entries(lines, marked.len()), width - 20.0);
        let top = HEAD + entries.height + 8.0;
        let Plot { x, y, area: [left, _, right, height] } = extent.on(width);
        let area = [left, top, right, top + height];
        let Plane { labels: [x_label, y_label], .. } = plane;
        let axes = Axes { area, x, y, y_label: y_label.to_owned(), x_label: x_label.to_owned() };
        let mut sheet = Sheet::new(width, top + height + Axes::below("x") + 2.0);
        let text = self.heading(lines.len(), outside);
        title(&mut sheet, &text);
        sheet.place(entries, [10.0, HEAD]);
        axes.draw(&mut sheet);

        let on_sheet = |p: &Point2<f64>| axes.point(p.x, p.y);
        let [before, after] = [before, after].map(|points| points.iter().map(on_sheet).collect::<Vec<_>>());
        for line in lines {
            join(&mut sheet, line, &before, BEFORE);
        }
        // the marked ones cover the others
        for line in lines.iter().filter(|line| !marked.contains(&line.factor)) {
            join(&mut sheet, line, &after, if line.is_outlier { OUTLIER } else { AFTER });
        }
        for line in lines.iter().filter(|line| marked.contains(&line.factor)) {
            join(&mut sheet, line, &after, LARGEST);
        }
        let radius = if self.has_names() { 3.0 } else { 1.0 };
        for (point, at) in self.points().iter().zip(&after) {
            let ink = if point.is_fixed { Ink::Text } else { Ink::Estimate };
            sheet.dot(*at, if point.is_fixed { 1.5 * radius } else { radius }, ink);
        }
        if self.has_names() {
            let label = |(point, [x, y]): (&GraphPoint, &[f64; 2])| Label {
                text: point.key.to_string(),
                around: [x - radius, y - radius, x + radius, y + radius],
                ink: Ink::Text,
            };
            let labels: Vec<Label> = self.points().iter().zip(&after).map(label).collect();
            place(&mut sheet, &labels, area);
        }
        let (name, seen) = match view {
            Viewpoint::Side => ("graph_side", "from the side"),
            _ => ("graph", "from above"),
        };
        Picture::new(name, format!("{text}: variables and factors seen {seen}"), sheet)
    }

    /// The title, with the numbers of everything that is not drawn.
    fn heading(&self, lines: usize, outside: usize) -> String {
        let mut omitted = vec![];
        if outside > 0 {
            omitted.push(format!("{outside} initial positions outside the picture"));
        }
        omitted.extend(self.left_out().map(|text| format!("{text} not drawn")));
        let factors = self.lines().len() - lines;
        if factors > 0 {
            omitted.push(format!("{factors} factors not drawn"));
        }
        if omitted.is_empty() {
            self.title.clone()
        } else {
            format!("{} ({})", self.title, omitted.join(", "))
        }
    }

    fn entries(&self, lines: &[GraphLine], marked: usize) -> Vec<Entry> {
        let mut entries = vec![Entry::line("initial values", BEFORE), Entry::line("estimate", AFTER)];
        if lines.iter().any(|line| line.is_outlier) {
            entries.push(Entry::line("factor with a weight below 0.5", OUTLIER));
        }
        match marked {
            0 => {}
            1 => entries.push(Entry::line("factor with the largest cost", LARGEST)),
            n => entries.push(Entry::line(&format!("{n} factors with the largest costs"), LARGEST)),
        }
        if self.points().iter().any(|point| point.is_fixed) {
            entries.push(Entry::patch("fixed variable", Ink::Text));
        }
        entries
    }
}

/// Returns the factors that are marked: those with the largest costs, as far as they are worth a look. A cost of ½ is
/// that of one standard deviation.
fn marked(lines: &[GraphLine]) -> Vec<usize> {
    const NOTABLE: f64 = 0.5;
    let mut costs: Vec<(f64, usize)> =
        lines.iter().filter(|l| l.cost > NOTABLE && !l.is_outlier).map(|l| (l.cost, l.factor)).collect();
    costs.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    costs.into_iter().take(MARKED).map(|(_, factor)| factor).collect()
}

/// Draws a factor: a line between two points, or lines from the middle of several.
fn join(sheet: &mut Sheet, line: &GraphLine, points: &[[f64; 2]], stroke: Stroke) {
    let ends: Vec<[f64; 2]> = line.ends.iter().filter_map(|i| points.get(*i).copied()).collect();
    if let [a, b] = *ends {
        sheet.line(vec![a, b], stroke);
        return;
    }
    let middle = [0, 1].map(|i| ends.iter().map(|end| end[i]).sum::<f64>() / ends.len() as f64);
    for end in ends {
        sheet.line(vec![middle, end], stroke);
    }
}
