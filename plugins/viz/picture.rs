//! A picture, before it is a file.
use kuva::backend::raster::RasterBackend;
use kuva::backend::svg::SvgBackend;
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use kuva::render::render::{Scene, render_multiple};

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

/// Letters and digits as they are, all else a low line.
fn file_name(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect()
}

/// A dollar sign would begin a formula.
pub(crate) fn plain(label: &str) -> String {
    label.replace('$', "\\$")
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
    }
}
