//! A map that grows, as a moving picture.
use super::stage::{Stage, label};
use crate::canvas::{Anchor, Colors, Ink, Sheet, Stroke, Text, Theme};
use crate::drawing::outline::Shape;
use crate::drawing::{HEAD, LABELS, Palette, Viewpoint, ellipsoid, place, spaced, title};
use manifactor_geometry::Se3;
use manifactor_graph::Direction;
use manifactor_quadric::DualQuadric;
use nalgebra::Vector3;

/// A moving picture of a map: snapshots in order of time, all in one oblique view.
///
/// The SVG moves by itself in browsers and on pages that show it as an image. It needs no script. A program that
/// does not animate SVG shows the last snapshot.
#[derive(Debug, Clone)]
pub struct Movie {
    title: String,
    up: Direction,
    snapshots: Vec<Snapshot>,
}

/// The map at one time.
#[derive(Debug, Clone)]
struct Snapshot {
    /// Unit: seconds.
    time: f64,
    path: Vec<Vector3<f64>>,
    camera: Option<Se3>,
    /// Objects with their names and classes.
    objects: Vec<(String, Shape)>,
}

/// Depth of the camera symbol, and half its width and height at that depth. Unit: metres.
const FRUSTUM: [f64; 3] = [0.22, 0.16, 0.12];
/// Largest number of points of the path in one snapshot.
const POINTS: usize = 100;
/// Number of steps for which the last snapshot stays before the picture begins again.
const PAUSE: usize = 6;

impl Movie {
    /// Creates a picture without a snapshot.
    pub fn new(title: &str, up: Direction) -> Self {
        Self { title: title.to_owned(), up, snapshots: vec![] }
    }

    /// Adds the map at a time in seconds: the camera's poses so far, and the objects with their classes.
    pub fn add<'a>(
        &mut self,
        time: f64,
        path: &[Se3],
        objects: impl IntoIterator<Item = (&'a str, &'a DualQuadric)>,
    ) {
        let every = path.len().div_ceil(POINTS).max(1);
        let positions = path.iter().step_by(every).chain(path.last());
        self.snapshots.push(Snapshot {
            time,
            path: positions.map(|pose| pose.translation).collect(),
            camera: path.last().copied(),
            objects: objects.into_iter().map(|(class, q)| (class.to_owned(), ellipsoid(q))).collect(),
        });
    }

    /// Returns the moving picture as SVG. It takes `seconds`, then begins again. `None` if there is nothing to
    /// see. Unit of `width`: pixels.
    pub fn svg(&self, width: f64, seconds: f64, theme: Theme) -> Option<String> {
        let colors = Colors::Of(theme);
        let plane = Viewpoint::Oblique.plane(&self.up);
        let area = [10.0, HEAD + 24.0, width - 10.0, HEAD + 24.0 + 0.6 * width];
        let last = self.snapshots.last()?;
        let objects = last.objects.iter().filter_map(|(_, shape)| shape.outline(&plane)).flatten();
        let path = self.snapshots.iter().flat_map(|snapshot| &snapshot.path).map(|p| plane.project(p));
        let stage = Stage::around(plane, path.chain(objects), area)?;
        let classes = self.snapshots.iter().flat_map(|snapshot| &snapshot.objects);
        let palette = Palette::new(classes.map(|(class, _)| class.as_str()));
        let mut base = Sheet::new(width, area[3] + 10.0);
        title(&mut base, &self.title);
        let steps = self.snapshots.len() + PAUSE;
        let frame = |(i, snapshot): (usize, &Snapshot)| {
            let is_last = i + 1 == self.snapshots.len();
            let end = if is_last { steps } else { i + 1 };
            let [from, to] = [i, end].map(|step| step as f64 / steps as f64);
            let (values, times) = match (i, is_last) {
                (0, true) => ("visible".to_owned(), "0".to_owned()),
                (0, false) => ("visible;hidden".to_owned(), format!("0;{to:.4}")),
                (_, true) => ("hidden;visible".to_owned(), format!("0;{from:.4}")),
                _ => ("hidden;visible;hidden".to_owned(), format!("0;{from:.4};{to:.4}")),
            };
            let visibility = if is_last { "visible" } else { "hidden" };
            format!(
                "<g visibility=\"{visibility}\"><animate attributeName=\"visibility\" calcMode=\"discrete\" \
                 dur=\"{seconds}s\" repeatCount=\"indefinite\" values=\"{values}\" keyTimes=\"{times}\"/>\n{}</g>\n",
                snapshot.sheet(&stage, &palette, area).parts(colors)
            )
        };
        let frames: String = self.snapshots.iter().enumerate().map(frame).collect();
        let svg = base.svg(&self.title, colors);
        Some(svg.strip_suffix("</svg>\n").unwrap_or(&svg).to_owned() + &frames + "</svg>\n")
    }
}

impl Snapshot {
    fn sheet(&self, stage: &Stage, palette: &Palette, area: [f64; 4]) -> Sheet {
        let mut sheet = Sheet::new(area[2] + 10.0, area[3] + 10.0);
        let mut labels = vec![];
        for (class, shape) in &self.objects {
            let Some(outline) = stage.outline(shape) else { continue };
            let (ink, outline) = (palette.ink(class), spaced(outline));
            labels.push(label(class, ink, &outline));
            sheet.outline(outline, Stroke::solid(ink, 1.6), Some((ink, 0.25)));
        }
        let path = self.path.iter().map(|p| stage.point(p)).collect();
        sheet.line(spaced(path), Stroke::solid(Ink::Estimate, 2.0));
        if let Some(camera) = &self.camera {
            for line in frustum(camera) {
                let points = line.iter().map(|p| stage.point(p)).collect();
                sheet.line(points, Stroke::solid(Ink::Estimate, 1.6));
            }
        }
        place(&mut sheet, &labels, area);
        let count = self.objects.len();
        let text = format!("{:.1} s, {count} objects", self.time);
        let at = [area[2] - 4.0, area[1] - 8.0];
        sheet.text(Text::new(text, at, LABELS, Ink::Faint).anchored(Anchor::End));
        sheet
    }
}

/// Returns the lines of the camera symbol: its image, and the rays to the corners of the image.
pub(super) fn frustum(camera: &Se3) -> Vec<Vec<Vector3<f64>>> {
    let [depth, x, y] = FRUSTUM;
    let corners = [[-x, -y], [x, -y], [x, y], [-x, y]];
    let corners = corners.map(|[x, y]| camera.translation + camera.rotation.act(&Vector3::new(x, y, depth)));
    let image = corners.iter().chain(corners.first()).copied().collect();
    corners.iter().map(|corner| vec![camera.translation, *corner]).chain([image]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_snapshot_has_its_time_and_the_last_stays() {
        let mut movie = Movie::new("growing <map>", Direction::Z);
        assert_eq!(movie.svg(600.0, 6.0, Theme::Light), None);
        let mut path = vec![];
        for i in 0..4 {
            path.push(Se3 { translation: Vector3::new(f64::from(i), 0.0, 1.0), ..Se3::identity() });
            let cup = DualQuadric { pose: Se3::identity(), semi_axes: Vector3::repeat(0.1) };
            movie.add(f64::from(i), &path, [("cup", &cup)]);
        }
        let svg = movie.svg(600.0, 6.0, Theme::Light).unwrap();
        assert_eq!(svg.matches("<animate ").count(), 4);
        assert_eq!(svg.matches("<g visibility=\"visible\">").count(), 1);
        assert!(svg.contains("keyTimes=\"0;0.1000;0.2000\"") && svg.contains("keyTimes=\"0;0.3000\""));
        assert!(svg.contains("growing &lt;map&gt;") && svg.ends_with("</svg>\n"));
        assert_eq!(svg.matches("</svg>").count(), 1);
    }
}
