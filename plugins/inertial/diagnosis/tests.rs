//! Faults that are planted in a simulated flight.
use super::*;
use crate::testing::SimulatedFlight;
use manifactor_geometry::{CameraModel, So3};
use nalgebra::Matrix3;

fn flight() -> Recording {
    let SimulatedFlight { readings, images, camera, body_from_camera, .. } = SimulatedFlight::new(8.0, 2);
    Recording::new(readings, images, camera, body_from_camera, 9.81)
}

fn gyroscope(recording: &mut Recording, change: impl Fn(Vector3<f64>) -> Vector3<f64>) {
    recording.readings.iter_mut().for_each(|reading| reading.gyroscope = change(reading.gyroscope));
}

fn accelerometer(recording: &mut Recording, change: impl Fn(Vector3<f64>) -> Vector3<f64>) {
    recording.readings.iter_mut().for_each(|reading| reading.accelerometer = change(reading.accelerometer));
}

fn pixels(recording: &mut Recording, mut change: impl FnMut(Vector2<f64>) -> Vector2<f64>) {
    let points = recording.images.iter_mut().flat_map(|(_, points)| points);
    points.for_each(|(_, pixel)| *pixel = change(*pixel));
}

/// Asserts that a planted fault is named first, by the beginning of its text.
fn assert_named(expected: &str, plant: impl FnOnce(&mut Recording)) {
    let mut recording = flight();
    plant(&mut recording);
    let findings = recording.diagnose().unwrap().findings;
    let named: Vec<String> = findings.iter().map(|finding| finding.fault.to_string()).collect();
    assert!(named.first().is_some_and(|named| named.starts_with(expected)), "{expected}: {named:#?}");
}

#[test]
fn a_recording_without_a_fault_has_none() {
    let diagnosis = flight().diagnose().unwrap();
    assert!(diagnosis.findings.is_empty(), "{diagnosis:?}");
    assert!(diagnosis.pairs > 30 && diagnosis.residual < 0.5, "{diagnosis:?}");
    assert!((diagnosis.gravity - 9.81).abs() < 0.2, "{diagnosis:?}");
}

#[test]
fn parts_of_a_recording_without_a_fault_have_none() {
    for (from, to) in [(0.0, 2.5), (0.0, 3.0), (0.0, 3.5), (0.0, 4.0), (3.0, 8.0), (4.0, 8.0), (2.0, 6.0)] {
        for seed in [3, 6] {
            let SimulatedFlight { readings, images, camera, body_from_camera, .. } =
                SimulatedFlight::new(8.0, seed);
            let within = |time: f64| (from..=to).contains(&time);
            let readings = readings.into_iter().filter(|reading| within(reading.timestamp)).collect();
            let images = images.into_iter().filter(|(time, _)| within(*time)).collect();
            let recording = Recording::new(readings, images, camera, body_from_camera, 9.81);
            match recording.diagnose() {
                Ok(diagnosis) => {
                    let Diagnosis { findings, damage, .. } = diagnosis;
                    assert!(findings.is_empty() && damage.is_empty(), "{from} {to} {seed}: {findings:#?}");
                }
                Err(DiagnosisError::FewPairs { .. }) => {}
                Err(other) => panic!("{from} {to} {seed}: {other}"),
            }
        }
    }
}

#[test]
fn units_and_signs_of_the_gyroscope_are_named() {
    assert_named("the gyroscope is in degrees", |r| gyroscope(r, |x| x * 57.295_78));
    assert_named("the gyroscope turns the other way", |r| gyroscope(r, |x| -x));
    assert_named("the gyroscope has other axes", |r| gyroscope(r, |x| Vector3::new(x.y, -x.x, x.z)));
}

#[test]
fn units_and_signs_of_the_accelerometer_are_named() {
    assert_named("the accelerometer is in g", |r| accelerometer(r, |x| x / 9.806_65));
    assert_named("the accelerometer is in thousandths of g", |r| accelerometer(r, |x| x / 9.806_65e-3));
    assert_named("the accelerometer is in mm/s²", |r| accelerometer(r, |x| x * 1e3));
    assert_named("the accelerometer has the opposite sign", |r| accelerometer(r, |x| -x));
    assert_named("the accelerometer has other axes", |r| accelerometer(r, |x| Vector3::new(x.z, x.x, x.y)));
    assert_named("the accelerometer has other axes", |r| accelerometer(r, |x| Vector3::new(-x.x, -x.y, x.z)));
    assert_named("the accelerometer shows a gravity of 9.", |r| r.gravity = 1.62);
}

#[test]
fn gravity_that_was_subtracted_is_named() {
    assert_named("gravity was subtracted", |r| {
        let mut at = So3::identity();
        let bias = Vector3::new(0.01, -0.02, 0.03);
        for reading in &mut r.readings {
            reading.accelerometer -= at.inverse().act(&Vector3::new(0.0, 0.0, 9.81));
            at = at.compose(&So3::exp(&((reading.gyroscope - bias) * 0.005)));
        }
    });
}

#[test]
fn faults_of_the_mounting_are_named() {
    assert_named("`body_from_camera` is the inverse", |r| r.body_from_camera = r.body_from_camera.inverse());
    assert_named("the translation of `body_from_camera` is in millimetres", |r| {
        r.body_from_camera.translation *= 1e3;
    });
    let optical = Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);
    assert_named("the camera's axes follow", |r| {
        r.body_from_camera.rotation = r.body_from_camera.rotation.compose(&So3::from_matrix(&optical));
    });
    assert_named("the camera is turned by", |r| {
        let turn = So3::exp(&Vector3::new(0.1, 0.1, -0.1));
        r.body_from_camera.rotation = r.body_from_camera.rotation.compose(&turn);
    });
}

#[test]
fn faults_of_the_clocks_are_named() {
    assert_named("the timestamps of the IMU", |r| r.readings.iter_mut().for_each(|x| x.timestamp *= 1e9));
    assert_named("the timestamps of the camera", |r| r.images.iter_mut().for_each(|(time, _)| *time *= 1e3));
    assert_named("IMU and camera have no time in common", |r| {
        r.images.iter_mut().for_each(|(time, _)| *time += 1.6e9);
    });
    assert_named("the clocks of IMU and camera differ: add -50", |r| {
        r.images.iter_mut().for_each(|(time, _)| *time += 0.05);
    });
    assert_named("the time between readings", |r| r.readings.iter_mut().for_each(|x| x.timestamp *= 2.0));
    assert_named("the images are in reverse order", |r| {
        let end = r.images.last().unwrap().0;
        r.images.reverse();
        r.images.iter_mut().for_each(|(time, _)| *time = end - *time);
    });
}

#[test]
fn faults_of_the_camera_are_named() {
    let scale = |r: &mut Recording, focal: f64, centre: f64| {
        let camera = &mut r.camera;
        [&mut camera.fx, &mut camera.fy].into_iter().for_each(|x| *x *= focal);
        [&mut camera.cx, &mut camera.cy].into_iter().for_each(|x| *x *= centre);
    };
    assert_named("the focal lengths are wrong: multiply fx and fy by 0.7", |r| scale(r, 1.3, 1.0));
    assert_named("the calibration belongs to images of a different size", |r| scale(r, 0.5, 0.5));
    assert_named("cx and cy are exchanged", |r| std::mem::swap(&mut r.camera.cx, &mut r.camera.cy));
    assert_named("the pixels have different axes: v is counted from below", |r| {
        pixels(r, |pixel| Vector2::new(pixel.x, 480.0 - pixel.y));
    });
    assert_named("the pixels have different axes: u and v are exchanged", |r| pixels(r, |pixel| pixel.yx()));
    let camera = flight().camera;
    assert_named("the points are distorted", |r| {
        pixels(r, |pixel| {
            let point = camera.ray(pixel).xy();
            camera.project(&(point * (1.0 - 0.25 * point.norm_squared())).push(1.0))
        });
    });
    assert_named("the points lie within a few pixels", |r| pixels(r, |pixel| camera.ray(pixel).xy()));
}

#[test]
fn a_recording_without_pairs_of_images_is_an_error() {
    let mut recording = flight();
    recording.images.truncate(3);
    let error = recording.diagnose().unwrap_err();
    assert!(error.to_string().contains("expected at least 10 pairs of images"), "{error}");
    recording.readings.clear();
    assert!(recording.diagnose().is_err());
}

#[test]
fn a_dead_sensor_and_extreme_numbers_are_errors() {
    let complaint = |plant: &dyn Fn(&mut Recording)| {
        let mut recording = flight();
        plant(&mut recording);
        recording.diagnose().unwrap_err().to_string()
    };
    let dead = complaint(&|r| gyroscope(r, |_| Vector3::new(0.1, 0.0, 0.0)));
    assert!(dead.starts_with("all readings of the gyroscope are equal"), "{dead}");
    let dead = complaint(&|r| accelerometer(r, |_| Vector3::zeros()));
    assert!(dead.starts_with("all readings of the accelerometer are equal"), "{dead}");
    for focal in [1e-300, 1e300] {
        assert!(complaint(&|r| r.camera.fx = focal).contains("is not finite"));
    }
    assert!(complaint(&|r| r.gravity = 1e300).contains("is not finite"));
}

#[test]
fn a_unit_of_time_does_not_explain_a_recording_that_is_too_short() {
    let mut recording = flight();
    recording.images.truncate(12);
    recording.images.iter_mut().for_each(|(time, _)| *time *= 1e3);
    let diagnosis = recording.diagnose().unwrap();
    assert!(diagnosis.findings.len() == 1 && !diagnosis.is_explained, "{diagnosis:?}");
}

#[test]
fn readings_in_no_order_are_no_panic() {
    let mut recording = flight();
    recording.readings.swap(0, 700);
    let _ = recording.diagnose();
    recording.readings[3].timestamp = f64::NAN;
    let _ = recording.diagnose();
}

#[test]
fn images_of_something_else_are_not_explained() {
    let mut recording = flight();
    let mut seed = 1_u64;
    pixels(&mut recording, |_| {
        let mut next = |size: f64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 * size
        };
        Vector2::new(next(752.0), next(480.0))
    });
    let diagnosis = recording.diagnose().unwrap();
    assert!(!diagnosis.is_explained, "{diagnosis:?}");
}
