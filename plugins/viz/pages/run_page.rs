//! The page of a run: the map in 3D, its variants side by side, and the factors of each object.
use super::page::{PRINT, Page, VALUES};
use super::run_tables::{held_out, noise, objects, overview, own_variables, words};
use super::{verdict::verdict, viewer};
use crate::drawing::{Palette, Picture, Scene, Viewpoint, map};
use crate::run::{RESIDUALS, cost, costs, images, maps_and_charts, residual_row};
use manifactor_slam::record::{RunRecord, VariantRecord};
use manifactor_slam::report::{RunReport, VariantReport};

/// Width of pictures, small enough for a phone. Unit: pixels.
pub(super) const WIDTH: f64 = 560.0;

/// Definitions of the terms in the overview.
const DEFINITIONS: [(&str, &str); 6] = [
    (
        "ATE",
        "absolute trajectory error: the root mean square of the distances between the estimated and the true positions of the camera, after alignment",
    ),
    ("position", "the root mean square of the distances between the centres of objects, estimated and true"),
    (
        "shape",
        "the mean Jaccard distance, 1 - IoU, of the axis-aligned boxes around the estimated and the true object when both are centred at the origin: 0 is perfect, 1 is no overlap; size and orientation count, place does not",
    ),
    ("quality", "the same where the objects stand: place counts as well"),
    (
        "volume error",
        "the mean of |ln(V / V_true)| over the objects that both variants have; V_true is the volume of the ellipsoid that fills the true cuboid",
    ),
    (
        "cost",
        "½ Σ ρ(‖r‖²) over all factors, r in standard deviations: comparable between variants of the same factors alone",
    ),
];

/// Returns the page. `record` and `report` have the same variants; `configs` are their resolved configs.
pub fn run_page(report: &RunReport, record: &RunRecord, configs: &[String]) -> String {
    let mut page = Page::new(&report.title);
    if let Some(text) = verdict(report, record) {
        page.verdict(&text);
    }
    let palette = Palette::of(record);
    in_3d(&mut page, record, &palette);
    page.contents().heading("Results");
    let (header, rows) = overview(report);
    page.cards(&header, &rows);
    if report.variants.len() > 1 {
        page.paragraph("In brackets: the change against the first variant. A negative number is better.");
    }
    page.definitions("Variants", &about(record));
    page.definitions("Definitions", &DEFINITIONS);
    side_by_side(&mut page, record, &palette);
    let reports = report.variants.iter().zip(&record.variants).zip(configs);
    for ((report, record), config) in reports {
        variant(&mut page, report, record, &palette, config);
    }
    page.heading("Files").files(&["report.json".to_owned(), "record.json".to_owned()]);
    page.own("", VALUES);
    page.own("", PRINT);
    page.paragraph(&version());
    page.html()
}

fn about(record: &RunRecord) -> Vec<(&str, &str)> {
    record.variants.iter().filter_map(|v| Some((v.name.as_str(), v.about.as_deref()?))).collect()
}

fn in_3d(page: &mut Page, record: &RunRecord, palette: &Palette) {
    let Some(last) = record.variants.last() else { return };
    let scene = Scene::of(format!("{}: {}", record.title, last.name), last);
    let picture = map(&scene, Viewpoint::Top, palette, 1.6 * WIDTH);
    page.own("<div id=\"static-map\">", "");
    page.picture(
        &picture,
        "The map from above. Where the browser has WebGL 2, it is a map in 3D that can be turned.",
    );
    page.own("</div>", "");
    page.data("run-data", &viewer::data(record, palette));
    page.own(viewer::MARKUP, &viewer::VIEW.concat()).own("", viewer::MAP).own("", &viewer::REPLAY.concat());
}

/// Adds each kind of picture once, with the variants next to each other.
fn side_by_side(page: &mut Page, record: &RunRecord, palette: &Palette) {
    page.heading("Variants side by side");
    if let Some(picture) = cost(&costs(&record.variants), WIDTH) {
        page.pictures([(&picture, CAPTIONS[0].1.to_owned())].into_iter());
    }
    let all: Vec<(&VariantRecord, Vec<Picture>)> = record
        .variants
        .iter()
        .map(|variant| (variant, maps_and_charts(variant.name.clone(), variant, palette, WIDTH)))
        .collect();
    for (name, caption) in CAPTIONS.iter().skip(1) {
        let of_name = all.iter().filter_map(|(variant, pictures)| {
            let picture = pictures.iter().find(|picture| picture.name == *name)?;
            Some((picture, format!("{}: {caption}", variant.name)))
        });
        page.pictures(of_name);
    }
}

/// Captions of the pictures by name.
const CAPTIONS: [(&str, &str); 8] = [
    (
        "cost",
        "The cost after each accepted step, as a share of the initial cost. Variants with different factors or noise have different costs, so only the shapes of the curves compare.",
    ),
    (
        "map_top",
        "the map from above. The true path is dashed. A dashed object is the ellipsoid that fills the true cuboid; an estimate encloses the whole solid and is therefore larger.",
    ),
    ("map_side", "the map from the side."),
    ("error_over_time", "distance of each position from the true one, after alignment of the whole path."),
    (
        "relative_error",
        "error of the motion between frames, in metres and in degrees: drift, whatever the alignment.",
    ),
    ("xyz", "the camera's position in the frame of the map's picture."),
    ("rpy", "the camera's orientation: turns about x, y and z."),
    (
        "residuals",
        "boxes reach from quartile to quartile, whiskers to the last value within one and a half times that; dots lie beyond, and an arrow says how many lie outside the picture and how far.",
    ),
];

/// Adds the section of one variant.
fn variant(page: &mut Page, report: &VariantReport, record: &VariantRecord, palette: &Palette, config: &str) {
    page.heading(&report.name);
    if let Some(about) = &record.about {
        page.paragraph(about);
    }
    page.warnings(&report.warnings.iter().map(ToString::to_string).collect::<Vec<_>>());
    let images = images(record, palette, WIDTH);
    let caption =
        "Boxes as the detector drew them are dashed; outlines of the estimated ellipsoids are filled.";
    page.pictures(images.iter().map(|picture| (picture, caption.to_owned())));
    page.subheading("Residuals")
        .paragraph("At the estimate, in standard deviations of their noise, row by row.");
    page.table(&words(RESIDUALS), &record.residuals.iter().map(residual_row).collect::<Vec<_>>());
    noise(page, report);
    held_out(page, report);
    own_variables(page, record);
    objects(page, report);
    page.subheading("Files of this variant").files(&files(record));
    page.folded("Config of this variant", config);
}

fn files(record: &VariantRecord) -> Vec<String> {
    const NAMES: [&str; 8] = [
        "config.toml",
        "trajectory.txt",
        "objects.json",
        "frames.jsonl",
        "map.ply",
        "graph.json",
        "iterations.csv",
        "metrics.json",
    ];
    NAMES.iter().map(|name| format!("{}/{name}", record.folder)).collect()
}

/// Returns the program and version that made a page.
pub(crate) fn version() -> String {
    format!("Made by manifactor {}.", env!("CARGO_PKG_VERSION"))
}
