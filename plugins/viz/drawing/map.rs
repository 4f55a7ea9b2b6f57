//! The map, from above or from the side.
use super::axes::{Axes, HEAD, title};
use super::labels::{Label, place};
use super::legend::{Entry, legend};
use super::outline::Shape;
use super::picture::Picture;
use super::scale::{FAR, Scale};
use super::scene::{Object, Palette, Scene, Track};
use super::series::{spaced, stretches};
use super::viewpoint::Viewpoint;
use crate::canvas::{Ink, Sheet, Stroke};
use nalgebra::{Point2, Vector2, Vector3};

/// Number of classes in the legend.
const CLASSES: usize = 60;
/// Smallest and largest height of the area, as a fraction of the width.
const SHARES: [f64; 2] = [0.3, 0.9];

/// A class, and the outline of one of its objects.
type Outline<'a> = (&'a str, Vec<Point2<f64>>);

/// Draws a scene in metres, with one scale for both axes.
///
/// The truth is dashed, the estimate solid and filled; objects have the colour of their class. The picture
/// shows all trajectories and true objects entirely. A far estimate is left outside, and the title has the
/// number of such estimates. Coordinates that are not finite, or beyond the range of an axis, are omitted.
pub(crate) fn map(scene: &Scene, view: Viewpoint, palette: &Palette, width: f64) -> Picture {
    let plane = view.plane(&scene.up);
    let point = |p: Vector3<f64>| Some(plane.project(&p)).filter(|p| p.iter().all(|x| x.abs() <= FAR));
    let stretches = |track: &Track| stretches(track.positions.iter().map(|p| p.and_then(point)));
    let tracks: Vec<Vec<Vec<Point2<f64>>>> = scene.tracks.iter().map(stretches).collect();
    let outlines = |of: fn(&Object) -> Option<&Shape>| -> Vec<Outline<'_>> {
        let outline = |o| of(o).and_then(|shape| shape.outline(&plane));
        scene.objects.iter().filter_map(|o| Some((o.class.as_str(), outline(o)?))).collect()
    };
    let (truths, estimates) = (outlines(|o| o.truth.as_ref()), outlines(|o| o.estimate.as_ref()));
    let mut extent = Extent::default();
    tracks.iter().flatten().flatten().for_each(|p| extent.include(p));
    truths.iter().flat_map(|(_, outline)| outline).for_each(|p| extent.include(p));
    let (near, outside) = extent.include_near(&estimates);

    let entries = legend(&entries(scene, palette, &truths, &estimates), width - 20.0);
    let top = HEAD + entries.height + 8.0;
    let Plot { x, y, area: [left, _, right, height] } = extent.on(width);
    let area = [left, top, right, top + height];
    let [x_label, y_label] = plane.labels.map(|label| format!("{label} (m)"));
    let axes = Axes { area, x, y, y_label, x_label };
    let mut sheet = Sheet::new(width, top + height + Axes::below("x") + 2.0);
    let text = match outside {
        0 => scene.title.clone(),
        n => format!("{} ({n} of {} objects outside the picture)", scene.title, estimates.len()),
    };
    title(&mut sheet, &text);
    sheet.place(entries, [10.0, HEAD]);
    axes.draw(&mut sheet);

    let drawn = |points: &[Point2<f64>]| spaced(points.iter().map(|p| axes.point(p.x, p.y)).collect());
    for (class, outline) in &near {
        let ink = palette.ink(class);
        sheet.outline(drawn(outline), Stroke::solid(ink, 1.8), Some((ink, 0.18)));
    }
    for (class, outline) in &truths {
        sheet.outline(drawn(outline), Stroke::dashed(palette.ink(class), 1.3), None);
    }
    for (track, stretches) in scene.tracks.iter().zip(&tracks) {
        stretches.iter().for_each(|points| sheet.line(drawn(points), track.stroke));
    }
    // labels would overlap in a side view, because all objects on a table are on one line
    if view == Viewpoint::Top {
        let label = |(class, outline): &&Outline<'_>| Label {
            text: (*class).to_owned(),
            around: around(&drawn(outline)),
            ink: palette.ink(class),
        };
        place(&mut sheet, &near.iter().map(label).collect::<Vec<_>>(), area);
    }
    let (name, seen) = match view {
        Viewpoint::Top => ("map_top", "seen from above"),
        Viewpoint::Side => ("map_side", "seen from the side"),
        Viewpoint::Oblique => ("map_oblique", "seen from above at an angle"),
    };
    Picture::new(name, format!("{text}: trajectories and objects {seen}"), sheet)
}

fn entries(
    scene: &Scene,
    palette: &Palette,
    truths: &[Outline<'_>],
    estimates: &[Outline<'_>],
) -> Vec<Entry> {
    let mut entries: Vec<_> = scene.tracks.iter().map(|t| Entry::line(&t.name, t.stroke)).collect();
    if !truths.is_empty() {
        entries.push(Entry::line("true object", Stroke::dashed(Ink::Faint, 1.3)));
    }
    if !estimates.is_empty() {
        entries.push(Entry::line("estimated object", Stroke::solid(Ink::Faint, 1.8)));
    }
    let here = |name: &&String| scene.objects.iter().any(|object| object.class == **name);
    let classes: Vec<&String> = palette.names().iter().filter(here).collect();
    entries.extend(classes.iter().take(CLASSES).map(|name| Entry::patch(name, palette.ink(name))));
    if classes.len() > CLASSES {
        entries.push(Entry::patch(&format!("and {} more", classes.len() - CLASSES), Ink::Text));
    }
    entries
}

/// Returns the bounding box of points.
fn around(points: &[[f64; 2]]) -> [f64; 4] {
    let end =
        |of: fn(&[f64; 2]) -> f64, pick: fn(f64, f64) -> f64, from| points.iter().map(of).fold(from, pick);
    [
        end(|p| p[0], f64::min, f64::INFINITY),
        end(|p| p[1], f64::min, f64::INFINITY),
        end(|p| p[0], f64::max, f64::NEG_INFINITY),
        end(|p| p[1], f64::max, f64::NEG_INFINITY),
    ]
}

/// The part of the plane that is shown.
#[derive(Debug, Default)]
struct Extent(Option<(Point2<f64>, Point2<f64>)>);

impl Extent {
    fn include(&mut self, p: &Point2<f64>) {
        let (low, high) = self.0.unwrap_or((*p, *p));
        self.0 = Some((low.inf(p), high.sup(p)));
    }

    /// Returns how far a point lies outside along x or y.
    fn beyond(&self, p: &Point2<f64>) -> f64 {
        self.0.map_or(0.0, |(low, high)| (low - p).sup(&(p - high)).max().max(0.0))
    }

    /// Includes the outlines within a margin around the extent, and returns them with the number of
    /// outlines outside. The margin is half the extent's size, or three times the distance of the median
    /// outline if that is larger. Most objects are far outside if the camera hardly moved.
    fn include_near<'a>(&mut self, outlines: &'a [Outline<'a>]) -> (Vec<&'a Outline<'a>>, usize) {
        let beyond = |o: &Outline<'_>| o.1.iter().map(|p| self.beyond(p)).fold(0.0, f64::max);
        let distances: Vec<f64> = outlines.iter().map(beyond).collect();
        let mut sorted = distances.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len().saturating_sub(1) / 2).copied().unwrap_or(0.0);
        let margin = (0.5 * self.size()).max(3.0 * median);
        let near = outlines.iter().zip(&distances).filter(|(_, distance)| **distance <= margin);
        let near: Vec<_> = near.map(|(outline, _)| outline).collect();
        near.iter().flat_map(|(_, outline)| outline).for_each(|p| self.include(p));
        let outside = outlines.len() - near.len();
        (near, outside)
    }

    /// Returns the longer side.
    fn size(&self) -> f64 {
        self.0.map_or(0.0, |(low, high)| (high - low).max())
    }

    /// Returns its scales on a sheet of this width.
    fn on(&self, width: f64) -> Plot {
        let (low, high) = self.0.unwrap_or((Point2::new(-1.0, -1.0), Point2::new(1.0, 1.0)));
        // for a single point, or points so far out that a relative margin is below rounding
        let margin = (0.03 * self.size()).max(1e-9 * low.coords.amax().max(high.coords.amax()));
        let margin = Vector2::repeat(if margin > 0.0 { margin } else { 1.0 });
        let (middle, mut half) = (nalgebra::center(&low, &high), 0.5 * (high - low) + margin);
        // the most that numbers and labels need; space that they leave widens the view on both sides
        let across = width - 100.0;
        let height = (across * half.y / half.x).clamp(SHARES[0] * width, SHARES[1] * width);
        let metres = (half.x / across).max(half.y / height);
        half.y = metres * height;
        let y = Scale::new(middle.y - half.y, middle.y + half.y);
        let left = 10.0 + Axes::left(&y, height);
        half.x = metres * (width - RIGHT - left);
        let x = Scale::new(middle.x - half.x, middle.x + half.x);
        Plot { x, y, area: [left, 0.0, width - RIGHT, height] }
    }
}

/// Space at the right edge. Unit: pixels.
const RIGHT: f64 = 18.0;

/// Scales with equal units on both axes, and the area that they need, from 0 downward.
struct Plot {
    x: Scale,
    y: Scale,
    area: [f64; 4],
}

#[cfg(test)]
mod tests;
