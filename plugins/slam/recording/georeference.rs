//! Place of a map on the Earth.
use manifactor_geometry::{Prior, Se3};
use manifactor_graph::{FactorEntry, Graph, Noise, Values};
use nalgebra::{DMatrix, Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Key of the pose of the map in the frame with east, north and up.
pub const ENU_FROM_MAP: &str = "enu_from_map";

/// Semi-major axis and flattening of the ellipsoid of WGS 84, in metres.
const SEMI_MAJOR_M: f64 = 6_378_137.0;
const FLATTENING: f64 = 1.0 / 298.257_223_563;

/// Standard deviations of the prior on the map in the frame with east, north and up: of a rotation that nothing is
/// known about, of the up direction of odometry whose frame is said to be level, and of the position.
const UNKNOWN_RAD: f64 = 1.0;
const LEVEL_RAD: f64 = 0.05;
const POSITION_M: f64 = 1000.0;

/// A position on the Earth, by WGS 84.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Geodetic {
    /// Unit: degrees, north of the equator.
    pub latitude: f64,
    /// Unit: degrees, east of Greenwich.
    pub longitude: f64,
    /// Height above the ellipsoid. Unit: metres.
    pub altitude: f64,
}

impl Geodetic {
    /// Returns the coordinates with the origin in the centre of the Earth, z to the north pole, and x to Greenwich.
    fn centered(&self) -> Vector3<f64> {
        let (sin, cos) = self.latitude.to_radians().sin_cos();
        let (sin_longitude, cos_longitude) = self.longitude.to_radians().sin_cos();
        let eccentricity_squared = FLATTENING * (2.0 - FLATTENING);
        let normal = SEMI_MAJOR_M / (1.0 - eccentricity_squared * sin * sin).sqrt();
        let from_axis = (normal + self.altitude) * cos;
        let along_axis = (normal * (1.0 - eccentricity_squared) + self.altitude) * sin;
        Vector3::new(from_axis * cos_longitude, from_axis * sin_longitude, along_axis)
    }

    /// Returns the coordinates of a position to the east, to the north and upwards of this one. Unit: metres.
    pub fn east_north_up(&self, of: &Self) -> Vector3<f64> {
        let (sin, cos) = self.latitude.to_radians().sin_cos();
        let (sin_longitude, cos_longitude) = self.longitude.to_radians().sin_cos();
        let up = Vector3::new(cos * cos_longitude, cos * sin_longitude, sin);
        let east = Vector3::new(-sin_longitude, cos_longitude, 0.0);
        let away = of.centered() - self.centered();
        Vector3::new(east.dot(&away), up.cross(&east).dot(&away), up.dot(&away))
    }
}

/// Place of the odometry on the Earth, as positions of a satellite receiver determine it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Georeference {
    /// Origin of the frame with east, north and up.
    pub origin: Geodetic,
    /// Pose of the odometry frame in the frame with east, north and up, from a first alignment.
    pub enu_from_odometry: Se3,
    /// True if the alignment is level, because the up direction of the odometry is known.
    pub is_level: bool,
}

impl Georeference {
    /// Adds [`ENU_FROM_MAP`] to a graph, with a weak prior: 57° about each axis, or 3° about horizontal axes of a level
    /// alignment, and 1 km.
    pub fn add_to(&self, map_from_odometry: &Se3, graph: &mut Graph, values: &mut Values) {
        let value = self.enu_from_odometry.compose(&map_from_odometry.inverse());
        let mut covariance = DMatrix::zeros(6, 6);
        // up in the map, whose rotation is the tangent of the variable
        let up = value.rotation.inverse().act(&Vector3::z());
        let about_up = up * up.transpose();
        let tilt = if self.is_level { LEVEL_RAD } else { UNKNOWN_RAD };
        let rotation = about_up * UNKNOWN_RAD.powi(2) + (Matrix3::identity() - about_up) * tilt.powi(2);
        covariance.view_mut((0, 0), (3, 3)).copy_from(&rotation);
        covariance.view_mut((3, 3), (3, 3)).fill_diagonal(POSITION_M.powi(2));
        values.insert(ENU_FROM_MAP, value);
        graph.push(FactorEntry {
            keys: vec![ENU_FROM_MAP.into()],
            name: None,
            factor: Arc::new(Prior { value }),
            // it is positive definite by construction
            noise: Noise::covariance(covariance).unwrap_or_default(),
            loss: None,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_graph::Manifold;
    use nalgebra::Vector6;

    #[test]
    fn positions_agree_with_pymap3d() {
        // pymap3d 3.2.0, geodetic2enu
        let origin = Geodetic { latitude: 48.137, longitude: 11.575, altitude: 519.0 };
        let other = Geodetic { latitude: 48.1465, longitude: 11.5602, altitude: 540.0 };
        let found = origin.east_north_up(&other);
        let expected = Vector3::new(-1101.4177309811791, 1056.5297254800234, 20.817486397893276);
        assert!((found - expected).norm() < 1e-6, "{found}");
        let south = Geodetic { latitude: -33.86, longitude: 151.21, altitude: 20.0 };
        let beside = Geodetic { latitude: -33.87, longitude: 151.2, altitude: 25.0 };
        let found = south.east_north_up(&beside);
        let expected = Vector3::new(-925.2564443879182, -1109.2488448660945, 4.836153860412651);
        assert!((found - expected).norm() < 1e-6, "{found}");
    }

    #[test]
    fn the_prior_is_strong_only_about_horizontal_axes() {
        let origin = Geodetic { latitude: 48.137, longitude: 11.575, altitude: 519.0 };
        let enu_from_odometry = Se3::exp(&Vector6::new(0.0, 0.0, 1.0, 3.0, 4.0, 5.0));
        let map_from_odometry = Se3::exp(&Vector6::new(0.9, -0.3, 0.4, 1.0, 2.0, 3.0));
        let georeference = Georeference { origin, enu_from_odometry, is_level: true };
        let (mut graph, mut values) = (Graph::new(), Values::new());
        georeference.add_to(&map_from_odometry, &mut graph, &mut values);
        let value = values.get::<Se3>(ENU_FROM_MAP).unwrap();
        assert!(value.compose(&map_from_odometry).local(&enu_from_odometry).norm() < 1e-12);
        let information = graph.factors()[0].noise.information_matrix(6).unwrap();
        let information: Matrix3<f64> = information.fixed_view::<3, 3>(0, 0).into();
        let up = map_from_odometry.rotation.act(&Vector3::z());
        assert!((up.dot(&(information * up)) - 1.0).abs() < 1e-9);
        let across = up.cross(&Vector3::x()).normalize();
        assert!((across.dot(&(information * across)) - 400.0).abs() < 1e-6);
    }
}
