//! The pictures of a run, from its record.
mod error;
mod pose;
mod residual;

use crate::canvas::Ink;
use crate::drawing::{Chart, Curve, Palette, Picture, Scene, Viewpoint, figure, frames_seen, image, map};
use manifactor_slam::record::{RunRecord, VariantRecord};

pub(crate) use residual::{RESIDUALS, row as residual_row};

/// Draws all pictures of a variant: the map from above and from the side, errors, trajectories, residuals,
/// cost, and some images. Unit of `width`: pixels.
pub fn run_pictures(run: &RunRecord, variant: &VariantRecord, width: f64) -> Vec<Picture> {
    let palette = Palette::of(run);
    let mut pictures = maps_and_charts(format!("{}: {}", run.title, variant.name), variant, &palette, width);
    pictures.extend(images(variant, &palette, width));
    pictures
}

/// Draws the maps with this title, and the charts of a variant.
pub(crate) fn maps_and_charts(
    title: String,
    variant: &VariantRecord,
    palette: &Palette,
    width: f64,
) -> Vec<Picture> {
    let scene = Scene::of(title, variant);
    let maps = [Viewpoint::Top, Viewpoint::Side].map(|view| Some(map(&scene, view, palette, width)));
    let charts = [
        error::absolute(variant, width),
        error::relative(variant, width),
        pose::positions(variant, width),
        pose::angles(variant, width),
        residual::residuals(variant, width),
        cost(&costs(std::slice::from_ref(variant)), width),
    ];
    maps.into_iter().chain(charts).flatten().collect()
}

/// Draws some images of a variant, with the predictions of the estimate.
pub(crate) fn images(variant: &VariantRecord, palette: &Palette, width: f64) -> Vec<Picture> {
    let frames = frames_seen(variant, variant.images).into_iter();
    frames
        .filter_map(|number| Some(image(variant, number, variant.frames.get(number)?, palette, width)))
        .collect()
}

/// Returns the costs of variants, with their names.
pub(crate) fn costs(variants: &[VariantRecord]) -> Vec<(&str, &[f64])> {
    variants.iter().map(|variant| (variant.name.as_str(), &variant.cost[..])).collect()
}

/// Draws the cost by accepted step, with a curve for each name. Several solves may have different factors, so
/// their costs are shares of the initial cost.
pub(crate) fn cost(solves: &[(&str, &[f64])], width: f64) -> Option<Picture> {
    let is_shared = solves.len() > 1;
    let curve = |(i, (name, costs)): (usize, &(&str, &[f64]))| {
        let unit = costs.first().copied().filter(|cost| is_shared && *cost > 0.0).unwrap_or(1.0);
        let points = costs.iter().enumerate().map(|(step, cost)| (step as f64, cost / unit)).collect();
        Curve::new(name, Ink::Series(i), points).with_dots()
    };
    let curves: Vec<Curve> = solves.iter().enumerate().map(curve).collect();
    let costs = || curves.iter().flat_map(|curve| &curve.points).map(|p| p.1);
    let log_y = costs().fold(0.0, f64::max) > 10.0 * costs().fold(f64::INFINITY, f64::min);
    let y = if is_shared { "cost / initial cost" } else { "cost, ½ Σ ρ" };
    let panel = Chart { y: y.into(), log_y, begun_at_zero: false, curves };
    let text = "cost by accepted step";
    let sheet = figure(text, "accepted steps", false, &[panel], width, 0.5 * width)?;
    Some(Picture::new("cost", text, sheet))
}

/// Returns the time since the first frame. Unit: seconds.
fn clock(variant: &VariantRecord) -> impl Fn(f64) -> f64 {
    let start = variant.frames.first().map_or(0.0, |frame| frame.timestamp);
    move |timestamp| timestamp - start
}
