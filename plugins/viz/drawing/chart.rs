//! Curves over a common axis, in one panel or in several stacked ones.
use super::axes::{Axes, HEAD, title};
use super::legend::{Entry, legend};
use super::scale::Scale;
use super::series::stretches;
use crate::canvas::{Ink, Sheet, Stroke};

/// Label of an axis of time since the first frame.
pub(crate) const TIME: &str = "time (s)";

/// A panel of curves.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Chart {
    /// Quantity on the y axis, with its unit.
    pub(crate) y: String,
    /// True for a logarithmic y axis.
    pub(crate) log_y: bool,
    /// True if the y axis begins at zero.
    pub(crate) begun_at_zero: bool,
    pub(crate) curves: Vec<Curve>,
}

/// A named curve.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Curve {
    pub(crate) name: String,
    pub(crate) stroke: Stroke,
    /// True if each point has a dot.
    pub(crate) dots: bool,
    /// Points in order of x. A non-finite point is a missing value.
    pub(crate) points: Vec<(f64, f64)>,
}

impl Curve {
    pub(crate) fn new(name: &str, ink: Ink, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.to_owned(), stroke: Stroke::solid(ink, 1.8), dots: false, points }
    }

    pub(crate) fn dashed(mut self) -> Self {
        self.stroke = Stroke::dashed(self.stroke.ink, 1.6);
        self
    }

    pub(crate) fn with_dots(self) -> Self {
        Self { dots: true, ..self }
    }
}

/// Draws stacked panels over one axis, with a title. Points that are not finite are omitted, and also
/// points at or below zero on a logarithmic axis. Returns `None` if no panel has a point.
pub(crate) fn figure(
    text: &str,
    x: &str,
    log_x: bool,
    panels: &[Chart],
    width: f64,
    height: f64,
) -> Option<Sheet> {
    let shown = |panel: &Chart, p: &(f64, f64)| {
        p.0.is_finite() && p.1.is_finite() && !(log_x && p.0 <= 0.0) && !(panel.log_y && p.1 <= 0.0)
    };
    let panels: Vec<Chart> = panels
        .iter()
        .map(|panel| {
            let has_points = |curve: &&Curve| curve.points.iter().any(|p| shown(panel, p));
            Chart { curves: panel.curves.iter().filter(has_points).cloned().collect(), ..panel.clone() }
        })
        .filter(|panel| !panel.curves.is_empty())
        .collect();
    let points = |panel| points(panel).filter(move |p| shown(panel, p));
    let along = Scale::over(panels.iter().flat_map(points).map(|p| p.0), log_x)?;

    let mut entries: Vec<Entry> = vec![];
    for curve in panels.iter().flat_map(|panel| &panel.curves) {
        if !entries.iter().any(|entry| entry.name == curve.name) {
            entries.push(Entry::line(&curve.name, curve.stroke));
        }
    }
    let entries = legend(&entries, width - 20.0);
    let top = HEAD + entries.height + 8.0;
    let each = (height - top - Axes::below(x)) / panels.len() as f64;
    // space above each panel except the first, for the numbers of the panel above it
    let each = each.max(70.0);
    let scales: Vec<Scale> = panels.iter().filter_map(upward).collect();
    let left = scales.iter().map(|y| Axes::left(y, each - 22.0)).fold(0.0, f64::max);

    let mut sheet = Sheet::new(width, top + each * panels.len() as f64 + Axes::below(x) - 20.0);
    title(&mut sheet, text);
    sheet.place(entries, [10.0, HEAD]);
    let last = panels.len() - 1;
    sheet.is_over_time = x == TIME && !log_x;
    for (i, (panel, y)) in panels.iter().zip(scales).enumerate() {
        let ymin = top + i as f64 * each;
        let x_label = if i == last { x.to_owned() } else { String::new() };
        let area = [10.0 + left, ymin, width - 18.0, ymin + each - 22.0];
        let axes = Axes { area, x: along, y, x_label, y_label: panel.y.clone() };
        axes.draw(&mut sheet);
        sheet.panels.push(axes.panel());
        for Curve { stroke, points, dots, .. } in &panel.curves {
            let known = points.iter().map(|p| shown(panel, p).then(|| axes.point(p.0, p.1)));
            for points in stretches(known).into_iter().map(thinned) {
                if *dots {
                    points.iter().for_each(|p| sheet.dot(*p, 2.6, stroke.ink));
                }
                sheet.line(points, *stroke);
            }
        }
    }
    Some(sheet)
}

fn upward(panel: &Chart) -> Option<Scale> {
    let zero = panel.begun_at_zero.then_some(0.0);
    Some(Scale::over(points(panel).map(|p| p.1).chain(zero), panel.log_y)?.with_margin(0.05))
}

fn points(panel: &Chart) -> impl Iterator<Item = &(f64, f64)> {
    panel.curves.iter().flat_map(|curve| &curve.points)
}

/// Reduces a line to the points that are visible. In each column of pixels, it keeps the first, the lowest,
/// the highest and the last point.
fn thinned(points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    if points.len() < 1500 {
        return points;
    }
    let mut kept: Vec<[f64; 2]> = vec![];
    for column in points.chunk_by(|a, b| a[0].round() == b[0].round()) {
        let by = |a: &(usize, &[f64; 2]), b: &(usize, &[f64; 2])| a.1[1].total_cmp(&b.1[1]);
        let lowest = column.iter().enumerate().min_by(by).map(|(i, _)| i);
        let highest = column.iter().enumerate().max_by(by).map(|(i, _)| i);
        let mut places: Vec<usize> =
            [Some(0), lowest, highest, column.len().checked_sub(1)].into_iter().flatten().collect();
        places.sort_unstable();
        places.dedup();
        kept.extend(places.into_iter().filter_map(|place| column.get(place)));
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::{Colors, Theme};

    #[test]
    fn curves_have_their_names_and_their_axes() {
        let curve = (0..9).map(|i| (10f64.powi(i - 6), 0.02 + f64::from(i) * 1e-3)).collect();
        let curves = vec![
            Curve::new("fr1/desk & more", Ink::Series(0), curve),
            Curve::new("nothing", Ink::Series(1), vec![(f64::NAN, 1.0)]),
        ];
        let panel = Chart { y: "ATE (m)".into(), curves, ..Chart::default() };
        let sheet = figure("ATE over σ", "σ", true, &[panel], 700.0, 400.0).unwrap();
        let svg = sheet.svg("ATE", Colors::Of(Theme::Light));
        for text in ["ATE over σ", "ATE (m)", "fr1/desk &amp; more", "viewBox"] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(!svg.contains("NaN") && !svg.contains("nothing"));
        assert_eq!(sheet.png(Theme::Dark).unwrap().get(..4), Some(&b"\x89PNG"[..]));
        assert!(figure("", "", false, &[Chart::default()], 700.0, 400.0).is_none());
    }

    #[test]
    fn charts_tell_a_page_their_scales() {
        let chart = |x: &str, colors| {
            let curves = vec![Curve::new("c", Ink::Series(0), vec![(0.0, 1.0), (8.0, 2.0)])];
            let panel = Chart { curves, ..Chart::default() };
            figure("", x, false, &[panel], 700.0, 400.0).unwrap().svg("", colors)
        };
        let svg = chart(TIME, Colors::OfPage);
        let (_, rest) = svg.split_once("data-panels=\"").unwrap();
        let numbers: Vec<f64> =
            rest.split('"').next().unwrap().split(' ').map(|x| x.parse().unwrap()).collect();
        let [xmin, ymin, xmax, ymax, from, to, log_x, low, high, log_y] = numbers[..] else {
            panic!("{svg}")
        };
        assert!(xmin < xmax && ymin < ymax && low <= 1.0 && high >= 2.0, "{numbers:?}");
        assert_eq!([from, to, log_x, log_y], [0.0, 8.0, 0.0, 0.0]);
        assert!(svg.contains("data-time") && !chart("steps", Colors::OfPage).contains("data-time"));
        assert!(!chart(TIME, Colors::Of(Theme::Light)).contains("data-"));
    }

    #[test]
    fn a_curve_is_not_drawn_across_a_gap() {
        let curve: Vec<(f64, f64)> = (0..100).map(|i| (f64::from(i), 1.0 + f64::from(i))).collect();
        let lines = |points: Vec<(f64, f64)>| {
            let panel = Chart { curves: vec![Curve::new("c", Ink::Series(3), points)], ..Chart::default() };
            let svg =
                figure("", "t", false, &[panel], 700.0, 400.0).unwrap().svg("", Colors::Of(Theme::Light));
            svg.matches(&Ink::Series(3).hex(Theme::Light)).count()
        };
        let mut broken = curve.clone();
        broken[30..70].iter_mut().for_each(|p| p.1 = f64::NAN);
        assert_eq!(lines(broken), lines(curve) + 1);
    }

    #[test]
    fn thinning_keeps_peaks_and_ends() {
        let mut points: Vec<[f64; 2]> = (0..20_000).map(|i| [f64::from(i) / 40.0, 1.0]).collect();
        points[777][1] = 9.0;
        let thin = thinned(points.clone());
        assert!(thin.len() < 2100 && thin.contains(&points[777]));
        assert_eq!((thin.first(), thin.last()), (points.first(), points.last()));
    }
}
