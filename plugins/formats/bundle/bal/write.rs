//! Writes bundle adjustment problems as BAL files.
use crate::error::FormatError;
use crate::text::write_text;
use crate::words::omission_notes;
use manifactor_geometry::{BalCamera, Point3, ProjectionBal};
use manifactor_graph::{FactorEntry, Graph, Key, Values};
use std::collections::{BTreeMap, HashMap};
use std::fmt::Write;
use std::path::Path;

/// Parts of a graph that BAL cannot express and that were omitted.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BalOmissions {
    /// Factors that are not observations of a point by a camera, by type name.
    pub factors: BTreeMap<&'static str, usize>,
    /// Variables that are neither cameras nor points, by type name.
    pub variables: BTreeMap<&'static str, usize>,
    /// Robust losses; their observations are written without a loss.
    pub losses: usize,
    /// Noise models other than one pixel; their observations are written without noise.
    pub noise: usize,
    /// Variables that are held, wholly or in part; they are written as free.
    pub held: usize,
    /// Variables with bounds; they are written without.
    pub bounded: usize,
}

impl BalOmissions {
    /// Returns the omitted parts as text.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = omission_notes("BAL", &self.variables, &self.factors);
        let others = [
            ("robust losses", self.losses),
            ("noise", self.noise),
            ("what is held", self.held),
            ("bounds", self.bounded),
        ];
        for (what, n) in others.into_iter().filter(|(_, n)| *n > 0) {
            notes.push(format!("BAL cannot express {what}: {n} left out"));
        }
        notes
    }
}

/// Returns the BAL text of a graph, and the parts that could not be written. Cameras and points are numbered
/// in their order.
///
/// Numbers are written with all digits. Poses read back up to rounding, as the file contains their inverse.
pub fn format(graph: &Graph, values: &Values) -> (String, BalOmissions) {
    let cameras: Vec<_> = values.all::<BalCamera>().collect();
    let points: Vec<_> = values.all::<Point3>().collect();
    let camera_numbers: HashMap<&Key, usize> = cameras.iter().map(|(key, _)| *key).zip(0..).collect();
    let point_numbers: HashMap<&Key, usize> = points.iter().map(|(key, _)| *key).zip(0..).collect();
    let (held, bounded) = (graph.fixed().len(), graph.bounds().len());
    let mut omitted = BalOmissions { held, bounded, ..BalOmissions::default() };
    let mut observations = vec![];
    for entry in graph.factors() {
        match observation(entry, &camera_numbers, &point_numbers) {
            None => *omitted.factors.entry(entry.factor.typetag_name()).or_default() += 1,
            Some(line) => {
                omitted.losses += usize::from(entry.loss.is_some());
                let one_pixel = entry.noise.information_matrix(2).is_ok_and(|m| m.is_identity(1e-12));
                omitted.noise += usize::from(!one_pixel);
                observations.push(line);
            }
        }
    }
    for (key, variable) in values.iter() {
        if !camera_numbers.contains_key(key) && !point_numbers.contains_key(key) {
            *omitted.variables.entry(variable.typetag_name()).or_default() += 1;
        }
    }
    let mut text = format!("{} {} {}\n", cameras.len(), points.len(), observations.len());
    text.extend(observations);
    let numbers = cameras.iter().flat_map(|(_, camera)| numbers(camera));
    for number in numbers.chain(points.iter().flat_map(|(_, p)| p.iter().copied())) {
        // Debug writes all digits, with exponents for very small or large numbers. Writing to a String cannot
        // fail.
        let _ = writeln!(text, "{number:?}");
    }
    (text, omitted)
}

/// Writes a graph as a BAL file, and returns the parts that could not be written.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: impl AsRef<Path>, graph: &Graph, values: &Values) -> Result<BalOmissions, FormatError> {
    let (text, omitted) = format(graph, values);
    write_text(path.as_ref(), &text).map(|()| omitted)
}

/// Formats an observation; `None` if the factor is not an observation.
fn observation(
    entry: &FactorEntry,
    cameras: &HashMap<&Key, usize>,
    points: &HashMap<&Key, usize>,
) -> Option<String> {
    let factor: &ProjectionBal = entry.factor.erased().as_any().downcast_ref()?;
    let [camera, point] = entry.keys.as_slice() else { return None };
    let (camera, point) = (cameras.get(camera)?, points.get(point)?);
    Some(format!("{camera} {point} {:?} {:?}\n", factor.pixel.x, factor.pixel.y))
}

fn numbers(camera: &BalCamera) -> [f64; 9] {
    let camera_from_world = camera.world_from_camera.inverse();
    let ([rx, ry, rz], [x, y, z]) =
        (camera_from_world.rotation.log().into(), camera_from_world.translation.into());
    [rx, ry, rz, x, y, z, camera.focal_length, camera.distortion.x, camera.distortion.y]
}
