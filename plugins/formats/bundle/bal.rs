//! BAL files: problems of bundle adjustment in the large (Agarwal et al., ECCV 2010).
//!
//! | lines | fields |
//! | --- | --- |
//! | the first | number of cameras, points and observations |
//! | one per observation | camera point x y: indices from 0; pixels from the image centre, x right and y up |
//! | nine numbers per camera | rotation vector (3), translation (3), f, k1, k2 |
//! | three numbers per point | x y z |
//!
//! Rotation and translation map points from the world frame to the camera's frame, which looks along -z; a
//! [`BalCamera`] stores the inverse. Cameras get the keys `c<number>`, points `p<number>`. Observations
//! become `projection_bal` factors with a standard deviation of one pixel.
//!
//! Such a file does not determine the position, orientation and scale of the whole: seven directions are
//! free. By default, the reader [holds](read) the pose of one camera and, for the scale, one direction of the
//! camera that is farthest from it. This does not change the cost. Gauss-Newton requires it. Damped solvers
//! do not, but report an undetermined direction at the end.
use crate::bundle::gauge::{fix_gauge, gauge_note};
use crate::error::{FormatError, Mistake, ProblemList};
use crate::graph_format::{GraphFormat, GraphRead, GraphText};
use crate::lines::{Fields, lines, number};
use crate::text::read_text;
use crate::words::list;
use manifactor_geometry::{BalCamera, Coordinates, Point3, ProjectionBal, Se3, So3};
use manifactor_graph::{Graph, Key, Values};
use nalgebra::{Vector2, Vector3};
use std::path::Path;

mod write;
pub use write::{BalOmissions, format, write};

/// A problem from a file, with initial values for all its variables.
#[derive(Debug, Clone, Default)]
pub struct BalProblem {
    /// Observations as factors, and held variables.
    pub graph: Graph,
    /// Cameras, then points, in file order.
    pub values: Values,
    /// Assumptions that the reader made.
    pub report: BalReport,
}

/// Assumptions that the reader made.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BalReport {
    /// Cameras with a held pose or direction, as the file does not fix the gauge.
    pub anchored: Vec<Key>,
    /// Cameras and points without any observation; they are held.
    pub unobserved: Vec<Key>,
}

impl BalReport {
    /// Returns the assumptions as text.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if !self.unobserved.is_empty() {
            notes.push(format!("nothing observes {}: held", list(self.unobserved.iter())));
        }
        notes.extend(gauge_note(&self.anchored));
        notes
    }
}

crate::register_graph_format!(GraphFormat {
    name: "BAL",
    extensions: &["bal"],
    folder: None,
    begins: looks_like_bal,
    parse: |text, path, reading| {
        let BalProblem { graph, values, report } = parse(text, path, reading.anchor)?;
        Ok(GraphRead { graph, values, notes: report.notes() })
    },
    format: Some(|graph, values, _| {
        let (text, omitted) = format(graph, values);
        Ok(GraphText::file(text, omitted.notes()))
    }),
});

/// Numbers of cameras, points and observations from the first line.
struct BalCounts([usize; 3]);

const CAMERA_NUMBERS: usize = 9;
/// Index of the focal length among a camera's numbers.
const FOCAL_LENGTH: usize = 6;
const POINT_NUMBERS: usize = 3;

/// Returns whether a text begins like a BAL file: with three whole numbers.
pub fn looks_like_bal(text: &str) -> bool {
    lines(text).next().is_some_and(|(_, line)| header(line).is_ok())
}

/// Reads a BAL file. If `anchor` is set, holds variables to fix the gauge.
///
/// # Errors
/// If a line is malformed, if an observation refers to an unknown camera or point, or if the numbers of lines
/// and values differ from the counts in the first line. The error lists all mistakes.
pub fn read(path: impl AsRef<Path>, anchor: bool) -> Result<BalProblem, FormatError> {
    let path = path.as_ref();
    parse(&read_text(path)?, path, anchor)
}

/// Works like [`read`], for a given text; `path` is used only in errors.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str, path: impl AsRef<Path>, anchor: bool) -> Result<BalProblem, FormatError> {
    let mut problems = ProblemList::of(path.as_ref(), text);
    let mut lines = lines(text);
    let first = lines.next().unwrap_or((0, ""));
    let counts = problems.ok(first.0, header(first.1)).unwrap_or(BalCounts([0; 3]));
    if !problems.is_empty() {
        // Without the counts, the remaining lines cannot be interpreted.
        return problems.finish().map(|()| BalProblem::default());
    }
    let BalCounts([cameras, points, observations]) = counts;
    let mut seen = vec![];
    for (line, text) in lines.by_ref().take(observations) {
        let observation = observation(text, &counts);
        seen.extend(problems.ok(line, observation));
    }
    let mut numbers = vec![];
    for (line, text) in lines {
        for word in text.split_whitespace() {
            numbers.push(problems.ok(line, number(word)).unwrap_or_default());
        }
    }
    let expected =
        cameras.saturating_mul(CAMERA_NUMBERS).saturating_add(points.saturating_mul(POINT_NUMBERS));
    if problems.is_empty() && seen.len() != observations {
        let found = seen.len();
        problems.push(0, Mistake::Count { what: "lines of observations", expected: observations, found });
    } else if problems.is_empty() && numbers.len() != expected {
        let what = "numbers after the observations, nine for each camera and three for each point";
        problems.push(0, Mistake::Count { what, expected, found: numbers.len() });
    }
    // Focal lengths can be located only if the total count of numbers is right.
    let known = if problems.is_empty() { cameras } else { 0 };
    for (i, camera) in numbers.chunks_exact(CAMERA_NUMBERS).take(known).enumerate() {
        let found = camera.get(FOCAL_LENGTH).copied().unwrap_or_default();
        if found <= 0.0 {
            let what = format!("camera {i}: expected a focal length above zero, got {found}");
            problems.push(0, Mistake::Row(what));
        }
    }
    problems.finish()?;
    Ok(build(&seen, numbers.split_at(cameras * CAMERA_NUMBERS), anchor))
}

fn header(text: &str) -> Result<BalCounts, Mistake> {
    let mut f = Fields::of(text, "cameras points observations")?;
    let mut count = || {
        let id = f.id()?;
        usize::try_from(id)
            .map_err(|_| Mistake::Field { expected: "a smaller number", found: id.to_string() })
    };
    Ok(BalCounts([count()?, count()?, count()?]))
}

/// Indices of a camera and a point, and the measured pixel.
type Observation = (usize, usize, Coordinates<2>);

fn observation(text: &str, BalCounts([cameras, points, _]): &BalCounts) -> Result<Observation, Mistake> {
    let mut f = Fields::of(text, "camera point x y")?;
    let mut below = |what, count: usize| {
        let id = f.id()?;
        let found = usize::try_from(id).ok().filter(|i| *i < count);
        found.ok_or(Mistake::NoSuch { what, id, count })
    };
    let (camera, point) = (below("camera", *cameras)?, below("point", *points)?);
    Ok((camera, point, Coordinates::new(Vector2::from(f.numbers::<2>()?))?))
}

#[allow(clippy::indexing_slicing, reason = "`observation` has checked the numbers")]
fn build(seen: &[Observation], (cameras, points): (&[f64], &[f64]), anchor: bool) -> BalProblem {
    let mut bundle = BalProblem::default();
    let camera_keys: Vec<Key> = (0..cameras.len() / CAMERA_NUMBERS).map(|i| Key::indexed("c", i)).collect();
    let point_keys: Vec<Key> = (0..points.len() / POINT_NUMBERS).map(|i| Key::indexed("p", i)).collect();
    for (key, x) in camera_keys.iter().zip(cameras.as_chunks::<CAMERA_NUMBERS>().0) {
        bundle.values.insert(key, camera(x));
    }
    for (key, x) in point_keys.iter().zip(points.as_chunks::<POINT_NUMBERS>().0) {
        bundle.values.insert(key, Point3::new(*x));
    }
    let mut observed = vec![false; bundle.values.len()];
    for (camera, point, pixel) in seen {
        bundle.graph.add([&camera_keys[*camera], &point_keys[*point]], ProjectionBal { pixel: *pixel });
        observed[*camera] = true;
        observed[camera_keys.len() + point] = true;
    }
    for ((key, _), _) in bundle.values.iter().zip(&observed).filter(|(_, observed)| !**observed) {
        bundle.graph.fix(key);
        bundle.report.unobserved.push(key.clone());
    }
    if anchor {
        bundle.report.anchored = fix_gauge(&mut bundle.graph, &bundle.values);
    }
    bundle
}

fn camera(x: &[f64; CAMERA_NUMBERS]) -> BalCamera {
    let &[rx, ry, rz, x, y, z, focal_length, k1, k2] = x;
    let camera_from_world = Se3::new(So3::exp(&Vector3::new(rx, ry, rz)), Vector3::new(x, y, z));
    BalCamera {
        world_from_camera: camera_from_world.inverse(),
        focal_length,
        distortion: Vector2::new(k1, k2),
    }
}
