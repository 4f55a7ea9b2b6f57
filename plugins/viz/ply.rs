//! The map as PLY, for mesh viewers: ellipsoids as triangles, trajectories as edges, each vertex with its colour.
use crate::canvas::{Ink, Theme};
use crate::drawing::{Palette, Scene};
use manifactor_slam::record::{RunRecord, VariantRecord};
use nalgebra::Vector3;
use std::f64::consts::PI;
use std::fmt::Write as _;

/// From pole to pole, and around.
const RINGS: usize = 12;
const SECTORS: usize = 24;

/// The estimated objects and all trajectories of a variant, in metres, in the frame of its record.
pub fn ply(run: &RunRecord, variant: &VariantRecord) -> String {
    let palette = Palette::of(run);
    let scene = Scene::of("", variant);
    let (mut vertices, mut faces, mut edges) = (Lines::default(), Lines::default(), Lines::default());
    for object in &scene.objects {
        let Some(shape) = &object.estimate else { continue };
        let (first, ink) = (vertices.count, palette.ink(&object.class));
        for (ring, sector) in (0..=RINGS).flat_map(|ring| (0..SECTORS).map(move |sector| (ring, sector))) {
            let (polar, around) =
                (PI * ring as f64 / RINGS as f64, 2.0 * PI * sector as f64 / SECTORS as f64);
            let point = Vector3::new(polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos());
            vertices.vertex(&(shape.centroid + shape.axes * point), ink);
        }
        for (ring, sector) in (0..RINGS).flat_map(|ring| (0..SECTORS).map(move |sector| (ring, sector))) {
            let at = |ring: usize, sector: usize| first + ring * SECTORS + sector % SECTORS;
            let (a, b, c, d) =
                (at(ring, sector), at(ring + 1, sector), at(ring + 1, sector + 1), at(ring, sector + 1));
            faces.line(format_args!("3 {a} {b} {c}"));
            faces.line(format_args!("3 {a} {c} {d}"));
        }
    }
    for track in &scene.tracks {
        let first = vertices.count;
        track.positions.iter().for_each(|p| vertices.vertex(p, track.stroke.ink));
        (first + 1..vertices.count).for_each(|i| edges.line(format_args!("{} {i}", i - 1)));
    }
    format!(
        "ply\nformat ascii 1.0\ncomment manifactor {}\n\
         element vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\n\
         element face {}\nproperty list uchar int vertex_indices\n\
         element edge {}\nproperty int vertex1\nproperty int vertex2\nend_header\n{}{}{}",
        env!("CARGO_PKG_VERSION"),
        vertices.count,
        faces.count,
        edges.count,
        vertices.text,
        faces.text,
        edges.text
    )
}

#[derive(Default)]
struct Lines {
    text: String,
    count: usize,
}

impl Lines {
    fn line(&mut self, line: std::fmt::Arguments<'_>) {
        // writing to a String does not fail
        let _ = writeln!(self.text, "{line}");
        self.count += 1;
    }

    fn vertex(&mut self, p: &Vector3<f64>, ink: Ink) {
        let [red, green, blue] = ink.rgb(Theme::Light);
        self.line(format_args!("{:.5} {:.5} {:.5} {red} {green} {blue}", p.x, p.y, p.z));
    }
}
