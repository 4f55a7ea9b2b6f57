//! The model of a graph.
use super::build::{camera_key, image_key, point_key};
use super::lens::each_lens;
use super::{Camera, Image, ImagePoint, Lens, Model, Point};
use crate::text::words::{ByName, count, omission_notes};
use manifactor_geometry::{
    CameraModel, Coordinates, Intrinsics, KannalaBrandt, Point3, Radial, RadialTangential, Se3,
    UncalibratedModel, UncalibratedProjection,
};
use manifactor_graph::{FactorEntry, Graph, Key, Values, Variable};
use std::collections::{HashMap, HashSet};

/// Mean distance of points that COLMAP has not measured yet.
const NO_ERROR: f64 = -1.0;

impl Model {
    /// Returns the model with the values of a graph that was read from it, and notes about what has no value.
    pub(super) fn with_values(mut self, values: &Values) -> (Self, Vec<String>) {
        let mut kept = 0;
        for camera in &mut self.cameras {
            match values.variable(camera_key(camera.id).as_str()).and_then(lens_of) {
                Some(lens) => {
                    // the model of the file, unless it cannot express the estimate
                    let same = Lens::new(camera.model.name(), lens.size(), &lens.parameters(camera.model));
                    if !same.is_ok_and(|(same, _)| same == lens) {
                        camera.model = lens.model();
                    }
                    camera.lens = lens;
                }
                None => kept += 1,
            }
        }
        for image in &mut self.images {
            match values.get::<Se3>(image_key(image.id)) {
                Ok(pose) => image.world_from_camera = *pose,
                Err(_) => kept += 1,
            }
        }
        for point in &mut self.points {
            match values.get::<Point3>(point_key(point.id)) {
                Ok(position) => point.position = position.0,
                Err(_) => kept += 1,
            }
        }
        self.measure();
        let note = || format!("{} of the model without a value: written as they were", count(kept, "part"));
        let notes = if kept > 0 { vec![note()] } else { vec![] };
        (self, notes)
    }

    /// Returns the model of a graph of uncalibrated cameras, and notes about what it cannot express. Images are named by
    /// the keys of their poses; points are grey.
    pub(super) fn of_graph(graph: &Graph, values: &Values) -> (Self, Vec<String>) {
        let mut model = Self::default();
        let (mut camera_numbers, mut point_numbers) = (HashMap::new(), HashMap::new());
        let mut variables = ByName::new();
        for ((key, variable), number) in values.iter().zip(1..) {
            if let Some(lens) = lens_of(variable) {
                camera_numbers.insert(key, number);
                model.cameras.push(Camera { id: number, model: lens.model(), lens });
            } else if let Some(point) = variable.erased().as_any().downcast_ref::<Point3>() {
                point_numbers.insert(key, number);
                let (position, track) = (point.0, vec![]);
                model.points.push(Point { id: number, position, colour: [128; 3], error: NO_ERROR, track });
            } else if !variable.erased().as_any().is::<Se3>() {
                *variables.entry(variable.typetag_name()).or_default() += 1;
            }
        }
        let mut image_numbers: HashMap<[&Key; 2], usize> = HashMap::new();
        let (mut factors, mut weighted, mut points_of) =
            (ByName::new(), 0, HashMap::<u64, Vec<(u64, u64)>>::new());
        for entry in graph.factors() {
            let seen = observation(entry).and_then(|(keys, pixel)| {
                let [pose, point, camera] = keys;
                let (point, camera_number) = (*point_numbers.get(point)?, *camera_numbers.get(camera)?);
                Some(([pose, camera], *values.get::<Se3>(pose).ok()?, point, camera_number, pixel))
            });
            let Some((keys, pose, point, camera, pixel)) = seen else {
                *factors.entry(entry.factor.typetag_name()).or_default() += 1;
                continue;
            };
            let is_plain =
                entry.loss.is_none() && entry.noise.information_matrix(2).is_ok_and(|m| m.is_identity(1e-12));
            weighted += usize::from(!is_plain);
            let place = *image_numbers.entry(keys).or_insert_with(|| {
                let (id, name) = (model.images.len() as u64 + 1, keys[0].to_string());
                model.images.push(Image { id, world_from_camera: pose, camera, name, points: vec![] });
                model.images.len() - 1
            });
            let Some(image) = model.images.get_mut(place) else { continue };
            points_of.entry(point).or_default().push((image.id, image.points.len() as u64));
            image.points.push(ImagePoint { pixel, point: Some(point) });
        }
        for point in &mut model.points {
            point.track = points_of.remove(&point.id).unwrap_or_default();
        }
        // names of images have to differ, also if a body has several cameras
        let mut names = HashMap::<String, usize>::new();
        for image in &mut model.images {
            let before = names.entry(image.name.clone()).or_default();
            *before += 1;
            if *before > 1 {
                image.name = format!("{}_{before}", image.name);
            }
        }
        let used: HashSet<u64> = model.images.iter().map(|image| image.camera).collect();
        model.cameras.retain(|camera| used.contains(&camera.id));
        model.measure();
        let mut notes = omission_notes("COLMAP", &variables, &factors);
        if weighted > 0 {
            notes.push(format!(
                "COLMAP cannot express noise and losses: {} left out",
                count(weighted, "noise model")
            ));
        }
        (model, notes)
    }

    /// Measures the mean distance of the image points of each point from its projections.
    fn measure(&mut self) {
        let mut sums: HashMap<u64, (f64, f64)> = HashMap::new();
        let positions: HashMap<u64, _> = self.points.iter().map(|point| (point.id, point.position)).collect();
        let lenses: HashMap<u64, Lens> = self.cameras.iter().map(|camera| (camera.id, camera.lens)).collect();
        for image in &self.images {
            let Some(lens) = lenses.get(&image.camera) else { continue };
            for ImagePoint { pixel, point } in &image.points {
                let Some((id, position)) = point.and_then(|id| Some((id, positions.get(&id)?))) else {
                    continue;
                };
                let local = image.world_from_camera.inverse_act(position);
                let distance = each_lens!(lens, camera => {
                    camera.sees(&local).then(|| (camera.project(&local) - **pixel).norm())
                });
                let (sum, n) = sums.entry(id).or_default();
                *sum += distance.unwrap_or_default();
                *n += f64::from(distance.is_some());
            }
        }
        for point in &mut self.points {
            let measured = sums.get(&point.id).filter(|(_, n)| *n > 0.0);
            point.error = measured.map_or(NO_ERROR, |(sum, n)| sum / n);
        }
    }
}

/// Returns the camera of a variable; `None` if it is no camera, or none of COLMAP's.
fn lens_of(variable: &dyn Variable) -> Option<Lens> {
    let any = variable.erased().as_any();
    None.or_else(|| any.downcast_ref().map(|Intrinsics(camera)| Lens::Pinhole(*camera)))
        .or_else(|| any.downcast_ref().map(|Intrinsics(camera)| Lens::Radial(*camera)))
        .or_else(|| any.downcast_ref().map(|Intrinsics(camera)| Lens::RadialTangential(*camera)))
        .or_else(|| any.downcast_ref().map(|Intrinsics(camera)| Lens::KannalaBrandt(*camera)))
}

/// Returns the keys of pose, point and camera of an observation, and its pixel; `None` for other factors.
fn observation(entry: &FactorEntry) -> Option<([&Key; 3], Coordinates<2>)> {
    fn pixel<M: UncalibratedModel>(entry: &FactorEntry) -> Option<Coordinates<2>> {
        let factor: &UncalibratedProjection<M> = entry.factor.erased().as_any().downcast_ref()?;
        factor.body_from_camera.is_none().then_some(factor.pixel)
    }
    let [pose, point, camera] = entry.keys.as_slice() else { return None };
    let pixel = pixel::<manifactor_geometry::Camera>(entry)
        .or_else(|| pixel::<Radial>(entry))
        .or_else(|| pixel::<RadialTangential>(entry))
        .or_else(|| pixel::<KannalaBrandt>(entry))?;
    Some(([pose, point, camera], pixel))
}
