//! Charts of numbers: curves, and how values are distributed.
use crate::drawing::picture::{Picture, plain};
use kuva::plot::{BoxPlot, LinePlot};
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;

/// Curves over a common axis.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Chart {
    /// Written over it.
    pub title: String,
    /// What is to the right, with its unit.
    pub x: String,
    /// What is upward, with its unit.
    pub y: String,
    /// Whether x goes by powers of ten.
    pub log_x: bool,
    /// The curves, each with its name.
    pub curves: Vec<(String, Vec<(f64, f64)>)>,
}

/// Groups of values, side by side.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Distribution {
    /// Written over it.
    pub title: String,
    /// What the values are, with their unit.
    pub y: String,
    /// The groups, each with its name.
    pub groups: Vec<(String, Vec<f64>)>,
}

/// Pixels.
const SIZE: (f64, f64) = (760.0, 420.0);
/// Told apart on white and by those who see no red: Okabe and Ito.
const COLORS: [&str; 8] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#444444", "#b8a900"];

impl Chart {
    /// The picture, by the name of its file. Points that are not finite, or not above zero on an axis of powers, are left
    /// out; a chart without any point is `None`.
    pub fn picture(&self, name: &str) -> Option<Picture> {
        let shown = |p: &&(f64, f64)| p.0.is_finite() && p.1.is_finite() && !(self.log_x && p.0 <= 0.0);
        let curves = self.curves.iter().zip(COLORS.iter().cycle()).filter_map(|((name, points), color)| {
            let points: Vec<(f64, f64)> = points.iter().filter(shown).copied().collect();
            let line = LinePlot::new().with_data(points.iter().copied()).with_color(*color);
            (!points.is_empty()).then(|| Plot::from(line.with_stroke_width(1.6).with_legend(plain(name))))
        });
        let plots: Vec<Plot> = curves.collect();
        if plots.is_empty() {
            return None;
        }
        let layout = layout(&plots, &self.title, &self.y).with_x_label(plain(&self.x));
        let layout = if self.log_x { layout.with_log_x() } else { layout };
        Some(Picture::new(name, plots, layout))
    }
}

impl Distribution {
    /// The picture, by the name of its file: a box from quartile to quartile with the median in it, for each group.
    /// Values that are not finite are left out; `None` where nothing is left.
    pub fn picture(&self, name: &str) -> Option<Picture> {
        let mut plot = BoxPlot::new().with_color(COLORS[0]);
        let mut any = false;
        for (name, values) in &self.groups {
            let values: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
            if !values.is_empty() {
                any = true;
                plot = plot.with_group(plain(name), values);
            }
        }
        let plots = vec![Plot::Box(plot)];
        any.then(|| {
            let layout = layout(&plots, &self.title, &self.y);
            let layout = if self.groups.len() > 5 { layout.with_x_tick_rotate(-30.0) } else { layout };
            Picture::new(name, plots, layout)
        })
    }
}

fn layout(plots: &[Plot], title: &str, y: &str) -> Layout {
    Layout::auto_from_plots(plots)
        .with_width(SIZE.0)
        .with_height(SIZE.1)
        .with_title(plain(title))
        .with_title_size(15)
        .with_y_label(plain(y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_have_their_names_and_their_axes() {
        let curve = (0..9).map(|i| (10f64.powi(i - 6), 0.02 + f64::from(i) * 1e-3)).collect();
        let chart = Chart {
            title: "ATE over σ".into(),
            x: "σ".into(),
            y: "ATE (m)".into(),
            log_x: true,
            curves: vec![("fr1/desk & more".into(), curve), ("nothing".into(), vec![(f64::NAN, 1.0)])],
        };
        let svg = chart.picture("ate").unwrap().svg();
        for text in ["ATE over σ", "ATE (m)", "fr1/desk &amp; more"] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(!svg.contains("NaN") && !svg.contains("nothing"));
        assert!(Chart::default().picture("none").is_none());
    }

    #[test]
    fn each_group_has_its_box() {
        let groups = vec![("Q".into(), vec![0.1, 0.2, 0.4]), ("Q+O".into(), vec![0.1, f64::INFINITY])];
        let shape = Distribution { title: "shape".into(), y: "shape".into(), groups };
        let svg = shape.picture("shape").unwrap().svg();
        assert!(svg.contains(">Q<") && svg.contains(">Q+O<") && !svg.contains("inf"));
        assert!(Distribution::default().picture("none").is_none());
    }
}
