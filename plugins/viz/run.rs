//! The pictures of a run, of its record.
mod error;
mod pose;
mod residual;

use crate::canvas::Ink;
use crate::drawing::{Chart, Curve, Palette, Picture, Scene, Viewpoint, figure, frames_seen, image, map};
use manifactor_slam::record::{RunRecord, VariantRecord};

pub(crate) use residual::{RESIDUALS, row as residual_row};

/// All pictures of a variant, at this width in pixels: the map from above and from the side, errors, trajectories, residuals,
/// cost, and some images.
pub fn run_pictures(run: &RunRecord, variant: &VariantRecord, width: f64) -> Vec<Picture> {
    let palette = Palette::of(run);
    let scene = Scene::of(format!("{}: {}", run.title, variant.name), variant);
    let mut pictures =
        vec![map(&scene, Viewpoint::Top, &palette, width), map(&scene, Viewpoint::Side, &palette, width)];
    pictures.extend(charts(variant, width));
    let frames = frames_seen(variant, variant.images).into_iter();
    let frames = frames.filter_map(|number| Some((number, variant.frames.get(number)?)));
    pictures.extend(frames.map(|(number, frame)| image(variant, number, frame, &palette, width)));
    pictures
}

/// The pictures that are charts.
pub(crate) fn charts(variant: &VariantRecord, width: f64) -> Vec<Picture> {
    let charts = [
        error::absolute(variant, width),
        error::relative(variant, width),
        pose::positions(variant, width),
        pose::angles(variant, width),
        residual::residuals(variant, width),
        cost(std::slice::from_ref(variant), width),
    ];
    charts.into_iter().flatten().collect()
}

/// The cost by iteration, a curve for each variant.
pub(crate) fn cost(variants: &[VariantRecord], width: f64) -> Option<Picture> {
    let curve = |(i, variant): (usize, &VariantRecord)| {
        let points = variant.cost.iter().enumerate().map(|(step, cost)| (step as f64, *cost)).collect();
        Curve::new(&variant.name, Ink::Series(i), points).with_dots()
    };
    let curves: Vec<Curve> = variants.iter().enumerate().map(curve).collect();
    let costs = || curves.iter().flat_map(|curve| &curve.points).map(|p| p.1);
    let log_y = costs().fold(0.0, f64::max) > 10.0 * costs().fold(f64::INFINITY, f64::min);
    let panel = Chart { y: "cost, ½ Σ ρ".into(), log_y, begun_at_zero: false, curves };
    let text = "cost by accepted step";
    let sheet = figure(text, "accepted steps", false, &[panel], width, 0.5 * width)?;
    Some(Picture::new("cost", text, sheet))
}

/// Seconds since the first frame.
fn clock(variant: &VariantRecord) -> impl Fn(f64) -> f64 {
    let start = variant.frames.first().map_or(0.0, |frame| frame.timestamp);
    move |timestamp| timestamp - start
}

const TIME: &str = "time (s)";
