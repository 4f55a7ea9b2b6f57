//! The map as PLY for mesh viewers: ellipsoids as triangles, trajectories as edges, each vertex with a
//! colour.
use crate::canvas::{Ink, Theme};
use crate::drawing::{Palette, Scene, stretches};
use manifactor_slam::record::{RunRecord, VariantRecord};
use nalgebra::Vector3;
use std::f64::consts::PI;
use std::fmt::Write as _;

/// Number of rings of an ellipsoid from pole to pole, normally and with more than `MANY` objects. There are
/// twice as many sectors.
const RINGS: [usize; 2] = [12, 5];
const MANY: usize = 500;

/// Returns the estimated objects and all trajectories of a variant, in the frame of its record. Unit:
/// metres.
pub fn ply(run: &RunRecord, variant: &VariantRecord) -> String {
    let palette = Palette::of(run);
    let scene = Scene::of("", variant);
    let (mut vertices, mut faces, mut edges) = (Lines::default(), Lines::default(), Lines::default());
    let rings = RINGS[usize::from(scene.objects.len() > MANY)];
    let sectors = 2 * rings;
    for object in &scene.objects {
        let Some(shape) = &object.estimate else { continue };
        let (first, ink) = (vertices.count, palette.ink(&object.class));
        for (ring, sector) in (0..=rings).flat_map(|ring| (0..sectors).map(move |sector| (ring, sector))) {
            let (polar, around) =
                (PI * ring as f64 / rings as f64, 2.0 * PI * sector as f64 / sectors as f64);
            let point = Vector3::new(polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos());
            vertices.vertex(&(shape.centroid + shape.axes * point), ink);
        }
        for (ring, sector) in (0..rings).flat_map(|ring| (0..sectors).map(move |sector| (ring, sector))) {
            let at = |ring: usize, sector: usize| first + ring * sectors + sector % sectors;
            let (a, b, c, d) =
                (at(ring, sector), at(ring + 1, sector), at(ring + 1, sector + 1), at(ring, sector + 1));
            faces.line(format_args!("3 {a} {b} {c}"));
            faces.line(format_args!("3 {a} {c} {d}"));
        }
    }
    for track in &scene.tracks {
        for stretch in stretches(track.positions.iter().copied()) {
            let first = vertices.count;
            stretch.iter().for_each(|p| vertices.vertex(p, track.stroke.ink));
            (first + 1..vertices.count).for_each(|i| edges.line(format_args!("{} {i}", i - 1)));
        }
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
        // writing to a String cannot fail
        let _ = writeln!(self.text, "{line}");
        self.count += 1;
    }

    fn vertex(&mut self, p: &Vector3<f64>, ink: Ink) {
        let [red, green, blue] = ink.rgb(Theme::Light);
        self.line(format_args!("{:.5} {:.5} {:.5} {red} {green} {blue}", p.x, p.y, p.z));
    }
}
