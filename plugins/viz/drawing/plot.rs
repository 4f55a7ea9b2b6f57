//! The picture itself.
use crate::drawing::color::classes;
use crate::drawing::outline::Shape;
use crate::drawing::picture::{DASHES, INK, Picture, entry, line, plain};
use crate::drawing::scene::{Scene, TrackKind};
use crate::drawing::view::{Plane, View};
use kuva::plot::legend::{LegendEntry, LegendShape};
use kuva::render::annotations::TextAnnotation;
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use nalgebra::{Point2, Vector2};

/// Pixels.
const WIDTH: f64 = 900.0;
/// Most pixels, unless the legend is longer.
const HEIGHT: f64 = 800.0;
/// Classes in the legend: a picture is as high as its legend.
const CLASSES: usize = 60;
/// What axes, legend and title take, in pixels: about that much.
const MARGINS: (f64, f64) = (190.0, 110.0);

/// A class, and the outline of an object of it.
type Outline<'a> = (&'a str, Vec<Point2<f64>>);

/// Draws a scene, in metres, both axes to the same scale.
///
/// What is true is dashed, what is estimated solid; objects have the colour of their class. The picture shows all
/// trajectories and true objects whole; an estimate far away from them is left outside, and the title says how many
/// are. Coordinates that are not finite are left out.
pub fn plot(scene: &Scene, view: View) -> Picture {
    let plane = view.plane(&scene.up);
    let mut frame = Frame::default();
    let mut plots: Vec<Plot> = Vec::new();
    let mut tracks: Vec<LegendEntry> = Vec::new();

    for track in &scene.tracks {
        let points: Vec<Point2<f64>> = track
            .positions
            .iter()
            .filter(|p| p.iter().all(|x| x.is_finite()))
            .map(|p| plane.project(p))
            .collect();
        points.iter().for_each(|p| frame.include(p));
        let (color, width, dashes) = style(track.kind);
        plots.push(line(&points, color, width, dashes));
        tracks.push(entry(&track.name, color, LegendShape::Line, dashes));
    }

    let classes = classes(scene.objects.iter().map(|o| o.class.as_str()));
    let color = |class: &str| classes.iter().find(|(name, _)| *name == class).map_or(INK, |(_, color)| color);
    let outlines = |of: fn(&crate::Object) -> &Option<Shape>| -> Vec<Outline<'_>> {
        let outline = |o| of(o).as_ref().and_then(|shape: &Shape| shape.outline(&plane));
        scene.objects.iter().filter_map(|o| Some((o.class.as_str(), outline(o)?))).collect()
    };
    let (truths, estimates) = (outlines(|o| &o.truth), outlines(|o| &o.estimate));
    for (class, outline) in &truths {
        outline.iter().for_each(|p| frame.include(p));
        plots.push(line(outline, color(class), 1.6, Some(DASHES)));
    }
    let (near, outside) = frame.include_near(&estimates);
    let mut labels = Vec::new();
    for (class, outline) in near {
        plots.push(line(outline, color(class), 2.2, None));
        let top = outline.iter().fold(Point2::new(0.0, f64::MIN), |a, p| if p.y > a.y { *p } else { a });
        labels.push((*class, top));
    }

    let mut kinds = Vec::new();
    if !truths.is_empty() {
        kinds.push(entry("true", INK, LegendShape::Line, Some(DASHES)));
    }
    if !estimates.is_empty() {
        kinds.push(entry("estimated", INK, LegendShape::Line, None));
    }
    let shown = classes.iter().take(CLASSES);
    kinds.extend(shown.map(|(name, color)| entry(name, color, LegendShape::Rect, None)));
    if classes.len() > CLASSES {
        let more = format!("and {} more", classes.len() - CLASSES);
        kinds.push(entry(&more, INK, LegendShape::Rect, None));
    }
    let entries = tracks.len() + kinds.len();
    let mut layout = layout(scene, &plots, &plane, &frame, outside, entries);
    for (title, entries) in [("Trajectories", tracks), ("Objects", kinds)] {
        if !entries.is_empty() {
            layout = layout.with_legend_group(title, entries);
        }
    }
    let above = 0.008 * frame.size();
    // seen from the side, what stands on one table stands on one line
    for (class, top) in labels.into_iter().filter(|_| view == View::Top) {
        let label = TextAnnotation::new(plain(class), top.x, top.y + above);
        layout = layout.with_annotation(label.with_font_size(10).with_color(color(class)));
    }
    let name = match view {
        View::Top => "map_top",
        View::Side => "map_side",
    };
    Picture::new(name, plots, layout)
}

fn layout(
    scene: &Scene,
    plots: &[Plot],
    plane: &Plane,
    frame: &Frame,
    outside: usize,
    entries: usize,
) -> Layout {
    let (low, high) = frame.bounds();
    // as high as the frame asks for at this width, and high enough for the legend
    let height = MARGINS.1 + (WIDTH - MARGINS.0) * (high.y - low.y) / (high.x - low.x);
    let height = height.clamp(100.0 + 20.0 * entries as f64, HEIGHT.max(120.0 + 20.0 * entries as f64));
    let title = match outside {
        0 => plain(&scene.title),
        n => format!("{} ({n} of {} objects outside the picture)", plain(&scene.title), scene.objects.len()),
    };
    let [x, y] = plane.labels;
    Layout::auto_from_plots(plots)
        .with_width(WIDTH)
        .with_height(height)
        .with_title(title)
        .with_title_size(16)
        .with_x_label(format!("{x} (m)"))
        .with_y_label(format!("{y} (m)"))
        .with_x_axis_min(low.x)
        .with_x_axis_max(high.x)
        .with_y_axis_min(low.y)
        .with_y_axis_max(high.y)
        .with_equal_aspect()
}

fn style(kind: TrackKind) -> (&'static str, f64, Option<&'static str>) {
    match kind {
        TrackKind::Truth => (INK, 1.4, Some(DASHES)),
        TrackKind::Odometry => ("#ee7733", 1.2, None),
        TrackKind::Estimate => ("#0077bb", 1.6, None),
    }
}

/// The part of the plane that is shown.
#[derive(Debug, Default)]
struct Frame(Option<(Point2<f64>, Point2<f64>)>);

impl Frame {
    fn include(&mut self, p: &Point2<f64>) {
        let (low, high) = self.0.unwrap_or((*p, *p));
        self.0 = Some((low.inf(p), high.sup(p)));
    }

    fn contains(&self, p: &Point2<f64>) -> bool {
        self.0.is_some_and(|(low, high)| low <= *p && *p <= high)
    }

    /// Includes the outlines that lie within half the frame's size around it, and returns them; how many do not.
    fn include_near<'a>(&mut self, outlines: &'a [Outline<'a>]) -> (Vec<&'a Outline<'a>>, usize) {
        let margin = Vector2::repeat(0.5 * self.size());
        let around = self.0.map(|(low, high)| Frame(Some((low - margin, high + margin))));
        let is_near = |o: &&Outline<'_>| around.as_ref().is_none_or(|a| o.1.iter().all(|p| a.contains(p)));
        let near: Vec<_> = outlines.iter().filter(is_near).collect();
        near.iter().flat_map(|(_, outline)| outline).for_each(|p| self.include(p));
        let outside = outlines.len() - near.len();
        (near, outside)
    }

    /// The longer side.
    fn size(&self) -> f64 {
        self.0.map_or(0.0, |(low, high)| (high - low).max())
    }

    /// What to show: a little more than what is in it.
    fn bounds(&self) -> (Point2<f64>, Point2<f64>) {
        let (low, high) = self.0.unwrap_or((Point2::new(-1.0, -1.0), Point2::new(1.0, 1.0)));
        // one point alone, or points so far out that a margin drowns in rounding
        let margin = (0.05 * self.size()).max(1e-9 * low.coords.amax().max(high.coords.amax()));
        let margin = Vector2::repeat(if margin > 0.0 { margin } else { 1.0 });
        (low - margin, high + margin)
    }
}

#[cfg(test)]
mod tests;
