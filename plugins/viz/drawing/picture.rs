//! A picture, before it is a file.
use crate::xml::visible;
use kuva::backend::raster::RasterBackend;
use kuva::backend::svg::SvgBackend;
use kuva::plot::legend::{LegendEntry, LegendShape};
use kuva::plot::{LinePlot, LineStyle};
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use kuva::render::render::{Scene, render_multiple};
use nalgebra::Point2;

/// A drawing, as SVG or PNG.
pub struct Picture {
    /// What its files are called, without their ending.
    pub name: String,
    scene: Scene,
}

/// Why there is no PNG of a picture.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the picture {name} cannot be drawn: {problem}")]
pub struct NotDrawn {
    /// The picture.
    pub name: String,
    /// What is wrong.
    pub problem: String,
}

/// Pixels of a PNG for each of the picture.
const SCALE: f32 = 1.5;

impl Picture {
    pub(crate) fn new(name: &str, plots: Vec<Plot>, layout: Layout) -> Self {
        Self { name: file_name(name), scene: render_multiple(plots, layout) }
    }

    /// As SVG.
    pub fn svg(&self) -> String {
        numbered(&self.part())
    }

    /// As SVG whose names are unlike those of all other pictures: for pages, which number them.
    pub(crate) fn part(&self) -> String {
        SvgBackend.render_scene(&self.scene)
    }

    /// As PNG, half as large again.
    ///
    /// # Errors
    /// Where the picture is too large for that.
    pub fn png(&self) -> Result<Vec<u8>, NotDrawn> {
        let drawn = RasterBackend::new().with_scale(SCALE).render_scene(&self.scene);
        drawn.map_err(|problem| NotDrawn { name: self.name.clone(), problem })
    }
}

/// With the names of clip paths by their order: kuva counts them over the life of a program, and the same picture is to
/// be the same bytes.
pub(crate) fn numbered(svg: &str) -> String {
    const NAME: &str = "kuva-clip-";
    let mut parts = svg.split(NAME);
    let (mut text, mut seen) = (parts.next().unwrap_or_default().to_owned(), vec![]);
    for part in parts {
        let end = part.find(|c: char| !c.is_ascii_digit()).unwrap_or(part.len());
        let (id, rest) = part.split_at(end);
        let number = seen.iter().position(|s| *s == id).unwrap_or_else(|| {
            seen.push(id);
            seen.len() - 1
        });
        text += &format!("{NAME}{number}{rest}");
    }
    text
}

/// Letters and digits as they are, all else a low line.
fn file_name(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect()
}

/// Dashes of what is true or measured; what is estimated is solid.
pub(crate) const DASHES: &str = "5 3";
/// The colour of what has no class.
pub(crate) const INK: &str = "#222222";

/// A line through points.
pub(crate) fn line(points: &[Point2<f64>], color: &str, width: f64, dashes: Option<&str>) -> Plot {
    let style = dashes.map_or(LineStyle::Solid, |d| LineStyle::Custom(d.into()));
    let data = points.iter().map(|p| (p.x, p.y));
    LinePlot::new().with_data(data).with_color(color).with_stroke_width(width).with_line_style(style).into()
}

/// What a line or a patch stands for.
pub(crate) fn entry(label: &str, color: &str, shape: LegendShape, dashes: Option<&str>) -> LegendEntry {
    LegendEntry { label: plain(label), color: color.into(), shape, dasharray: dashes.map(Into::into) }
}

/// A label as kuva takes it, which makes entities of markup and nothing else: a dollar sign would begin a formula.
pub(crate) fn plain(label: &str) -> String {
    visible(label).collect::<String>().replace('$', "\\$")
}

#[cfg(test)]
mod tests {
    use crate::Chart;

    #[test]
    fn a_picture_is_an_svg_and_a_png() {
        let chart = Chart {
            title: "a / b".into(),
            curves: vec![("a".into(), vec![(0.0, 1.0), (1.0, 3.0)])],
            ..Chart::default()
        };
        let picture = chart.picture("a / b").unwrap();
        assert_eq!(picture.name, "a___b");
        assert!(picture.svg().contains("a / b"));
        assert_eq!(picture.png().unwrap().get(..4), Some(&b"\x89PNG"[..]));
        let again = chart.picture("a / b").unwrap();
        assert!(again.svg() == picture.svg() && again.part() != picture.part());
    }
}
