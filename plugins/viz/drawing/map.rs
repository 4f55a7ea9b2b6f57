//! The map, from above or from the side.
mod extent;

pub(crate) use extent::{Extent, Plot};

use super::axes::{Axes, HEAD, title};
use super::labels::{Label, place};
use super::legend::{Entry, legend};
use super::outline::Shape;
use super::picture::Picture;
use super::scale::FAR;
use super::scene::{Object, Palette, Scene, Track};
use super::series::{spaced, stretches};
use super::viewpoint::Viewpoint;
use crate::canvas::{Ink, Sheet, Stroke};
use nalgebra::{Point2, Vector3};

/// Number of classes in the legend.
const CLASSES: usize = 60;
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
    let (near, outside) = extent.include_near(&estimates, |(_, outline)| outline);

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

#[cfg(test)]
mod tests;
