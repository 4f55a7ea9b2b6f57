//! The scene of an estimate.
use crate::drawing::outline::Shape;
use crate::drawing::scene::{Object, Scene, Track, TrackKind};
use manifactor_formats::tum::StampedPose;
use manifactor_graph::Direction;
use manifactor_quadric::DualQuadric;
use manifactor_slam::estimate::Estimate;
use manifactor_slam::metrics::{Alignment, Similarity, align, associate};
use manifactor_slam::sequence::TrueObject;
use nalgebra::{Matrix3, Vector3};

impl Scene {
    /// What there is to see of an estimate.
    ///
    /// Drawn in the frame of the truth, where there is one: simulated trajectories as they stand, as their landmarks
    /// are measured; recorded ones each aligned to the truth by SE(3), poses within `max_time_difference` seconds.
    /// Else in the frame of the map.
    pub fn of_estimate(title: impl Into<String>, estimate: &Estimate, max_time_difference: f64) -> Self {
        let (odometry, trajectory) = (estimate.odometry(), estimate.trajectory());
        let truth = estimate.sequence.ground_truth.as_ref();
        let to_truth = |poses: &[StampedPose]| -> Similarity {
            let frame = &estimate.mapping.frame;
            match truth {
                None => identity(),
                Some(truth) if !truth.objects.is_empty() => {
                    Similarity::rigid(frame.map_from_odometry.inverse())
                }
                Some(truth) => associate(&truth.trajectory, poses, max_time_difference)
                    .and_then(|pairs| align(&pairs, Alignment::Se3))
                    .map_or_else(|_| identity(), |(similarity, _)| similarity),
            }
        };
        let (odometry_frame, frame) = (to_truth(&odometry), to_truth(&trajectory));
        let mut tracks = Vec::new();
        if let Some(truth) = truth {
            tracks.push(track(TrackKind::Truth, "true", &truth.trajectory, &identity()));
        }
        tracks.push(track(TrackKind::Odometry, "odometry", &odometry, &odometry_frame));
        tracks.push(track(TrackKind::Estimate, "estimated", &trajectory, &frame));
        let up = up(estimate, &frame);
        Self { title: title.into(), up, tracks, objects: objects(estimate, &frame) }
    }
}

fn identity() -> Similarity {
    Similarity::rigid(manifactor_geometry::Se3::identity())
}

fn track(kind: TrackKind, name: &str, poses: &[StampedPose], frame: &Similarity) -> Track {
    let positions = poses.iter().map(|p| frame.act(&p.pose.translation)).collect();
    Track { kind, name: name.into(), positions }
}

/// Up in the frame of the picture. If it is unknown, up in the first image is the best guess.
fn up(estimate: &Estimate, frame: &Similarity) -> Direction {
    let image_up = || estimate.trajectory().first().map(|p| p.pose.rotation.act(&-Vector3::y()));
    let known = estimate.mapping.frame.up.map(|up| *up);
    let up = known.or_else(image_up).and_then(|up| Direction::new(frame.rotation.act(&up)).ok());
    up.unwrap_or_default()
}

fn objects(estimate: &Estimate, frame: &Similarity) -> Vec<Object> {
    let landmarks = estimate.landmarks();
    let known = landmarks.iter().map(|landmark| Object {
        class: landmark.object.class.as_ref().map_or("unknown", |class| class.name.as_str()).into(),
        truth: landmark.truth.map(solid),
        estimate: Some(ellipsoid(landmark.quadric, frame)),
    });
    // what is there and was not mapped is worth seeing too
    let truths = estimate.sequence.ground_truth.iter().flat_map(|truth| &truth.objects);
    let missed = truths.filter(|truth| !landmarks.iter().any(|l| l.object.id == truth.id));
    let missed = missed.map(|t| Object { class: t.class.clone(), truth: Some(solid(t)), estimate: None });
    known.chain(missed).collect()
}

fn ellipsoid(quadric: &DualQuadric, frame: &Similarity) -> Shape {
    let pose = frame.act_on_pose(&quadric.pose);
    let axes = pose.rotation.matrix() * Matrix3::from_diagonal(&(quadric.semi_axes * frame.scale));
    Shape { centroid: pose.translation, axes }
}

/// The ellipsoid that fills the cuboid of a solid.
fn solid(truth: &TrueObject) -> Shape {
    let axes = truth.world_from_object.rotation.matrix() * Matrix3::from_diagonal(&truth.half_extents);
    Shape { centroid: truth.world_from_object.translation, axes }
}
