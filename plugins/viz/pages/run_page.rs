//! The page of a run: what came in, what came out, and what was done with each object.
use crate::drawing::picture::Picture;
use crate::drawing::{Chart, Distribution};
use crate::pages::page::Page;
use crate::{Scene, View, frames_seen, image, plot};
use indexmap::IndexMap;
use manifactor_formats::tum::StampedPose;
use manifactor_graph::Key;
use manifactor_slam::estimate::Estimate;
use manifactor_slam::mapping::MappedObject;
use manifactor_slam::metrics::{Alignment, align, associate};
use manifactor_slam::report::{ObjectReport, RunReport, VariantReport};
use manifactor_slam::settings::{EvaluationSettings, Settings};

/// The page of a run, made variant by variant.
#[derive(Debug, Clone)]
pub struct RunPage {
    variants: Page,
}

/// All pictures of an estimate: the map from above and from the side, errors over time, residuals, and some images.
pub fn run_pictures(title: &str, estimate: &Estimate, settings: &Settings) -> Vec<Picture> {
    let evaluation = &settings.evaluation;
    let scene = Scene::of_estimate(title, estimate, evaluation.max_time_difference);
    let mut pictures = vec![plot(&scene, View::Top), plot(&scene, View::Side)];
    pictures.extend(error_over_time(estimate, evaluation).picture("error_over_time"));
    pictures.extend(residuals(estimate).picture("residuals"));
    pictures.extend(
        frames_seen(estimate, settings.report.images).into_iter().map(|frame| image(estimate, frame)),
    );
    pictures
}

impl Default for RunPage {
    fn default() -> Self {
        Self { variants: Page::part() }
    }
}

impl RunPage {
    /// Adds a variant: its [pictures](run_pictures), residuals, objects, and the config that makes it again.
    pub fn variant(
        &mut self,
        estimate: &Estimate,
        report: &VariantReport,
        pictures: &[Picture],
        config: &str,
    ) -> &mut Self {
        let page = &mut self.variants;
        page.heading(&report.name);
        page.warnings(&report.warnings.iter().map(ToString::to_string).collect::<Vec<_>>());
        pictures.iter().for_each(|picture| _ = page.picture(picture));
        page.paragraph("Residuals at the estimate, in standard deviations of their noise, row by row.");
        page.table(&words(RESIDUALS), &residual_rows(estimate));
        if let Some(noise) = report.variance_components.last() {
            page.paragraph(&format!(
                "Noise as it was estimated, in {} rounds.",
                report.variance_components.len()
            ));
            let mut rows = vec![];
            if let Some([turn, shift]) = noise.odometry {
                rows.push(vec![
                    "odometry, rotation (rad)".into(),
                    format!("{turn:.3e}"),
                    String::new(),
                    String::new(),
                ]);
                rows.push(vec![
                    "odometry, translation (m)".into(),
                    format!("{shift:.3e}"),
                    String::new(),
                    String::new(),
                ]);
            }
            rows.extend(noise.boxes.iter().map(|(name, c)| {
                let numbers = [c.sigma_px, c.correlation_time, c.effective_px].map(|x| format!("{x:.2}"));
                std::iter::once(format!("boxes: {name} (px)")).chain(numbers).collect()
            }));
            page.table(&words(["noise", "σ", "correlation time", "σ in the graph"]), &rows);
        }
        page.paragraph("Objects, and what was applied to each.");
        page.table(&words(OBJECTS), &report.objects.iter().map(object_row).collect::<Vec<_>>());
        page.folded("Config of this variant", config);
        self
    }

    /// The page, with the table of all variants above them.
    pub fn html(&self, report: &RunReport) -> String {
        let mut page = Page::new(&report.title);
        let header = [
            "variant",
            "odometry ATE (m)",
            "ATE (m)",
            "position (m)",
            "shape",
            "quality",
            "objects",
            "boxes",
            "factors",
            "cost",
            "iterations",
            "converged",
        ];
        let number = |x: Option<f64>| x.map_or_else(|| "-".into(), |x| format!("{x:.5}"));
        let row = |row: manifactor_slam::report::Row| {
            vec![
                row.variant,
                number(row.odometry_ate),
                number(row.ate),
                number(row.position),
                number(row.shape),
                number(row.quality),
                row.objects.to_string(),
                row.boxes.to_string(),
                row.semantic_factors.to_string(),
                format!("{:.3}", row.final_cost),
                row.iterations.to_string(),
                if row.converged { "yes" } else { "no" }.into(),
            ]
        };
        page.table(&words(header), &report.table().into_iter().map(row).collect::<Vec<_>>());
        page.paragraph(&version());
        page.append(&self.variants);
        page.html()
    }
}

/// What made a page.
pub(crate) fn version() -> String {
    format!("Made by manifactor {}.", env!("CARGO_PKG_VERSION"))
}

fn words<const N: usize>(words: [&str; N]) -> Vec<String> {
    words.map(str::to_owned).into()
}

const RESIDUALS: [&str; 7] = ["factor", "count", "inactive", "RMS", "median", "largest", "mean weight"];
const OBJECTS: [&str; 9] = [
    "object",
    "class",
    "score",
    "detections",
    "boxes",
    "applied",
    "semi-axes (m)",
    "position error (m)",
    "not mapped because",
];

fn object_row(report: &ObjectReport) -> Vec<String> {
    let object = &report.object;
    let axes = |q: &manifactor_quadric::DualQuadric| {
        q.semi_axes.iter().map(|s| format!("{s:.3}")).collect::<Vec<_>>().join(" × ")
    };
    vec![
        object.key.to_string(),
        object.class.as_ref().map_or("-".into(), |class| class.name.clone()),
        object.class.as_ref().map_or("-".into(), |class| format!("{:.2}", class.score)),
        object.detections.to_string(),
        object.boxes.to_string(),
        applied(object),
        report.estimate.as_ref().map_or(String::new(), axes),
        report.error.as_ref().map_or(String::new(), |error| format!("{:.4}", error.position)),
        report.rejected_because.clone().unwrap_or_default(),
    ]
}

/// Each semantic factor with its reason, then what might have been one, and why it is none.
fn applied(object: &MappedObject) -> String {
    let own = |key: &&Key| **key != object.key;
    let applied = object.semantic_factors.iter().map(|a| {
        let others: Vec<_> = a.keys.iter().filter(own).map(|key| format!(" with {key}")).collect();
        format!("{}{}: {}", a.factor, others.concat(), a.because)
    });
    let left_out = object.left_out.iter().map(|l| format!("not {}: {}", l.factor, l.because));
    applied.chain(left_out).collect::<Vec<_>>().join("; ")
}

/// Whitened residuals by type of factor.
fn whitened(estimate: &Estimate) -> IndexMap<&'static str, (Vec<f64>, Vec<f64>, usize)> {
    let mut all: IndexMap<&'static str, (Vec<f64>, Vec<f64>, usize)> = IndexMap::new();
    for state in &estimate.solution.factors {
        let Some(entry) = estimate.mapping.graph.factors().get(state.entry) else { continue };
        let (rows, weights, inactive) = all.entry(entry.factor.typetag_name()).or_default();
        if state.defined {
            rows.extend(&state.whitened);
            weights.push(state.weight);
        } else {
            *inactive += 1;
        }
    }
    all
}

fn residuals(estimate: &Estimate) -> Distribution {
    let groups = whitened(estimate).into_iter().map(|(name, (rows, _, _))| (name.to_owned(), rows)).collect();
    Distribution { title: "whitened residuals".into(), y: "standard deviations".into(), groups }
}

fn residual_rows(estimate: &Estimate) -> Vec<Vec<String>> {
    let row = |(name, (rows, weights, inactive)): (&str, (Vec<f64>, Vec<f64>, usize))| {
        let mut sizes: Vec<f64> = rows.iter().map(|x| x.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let n = sizes.len().max(1) as f64;
        let rms = (sizes.iter().map(|x| x * x).sum::<f64>() / n).sqrt();
        let median = sizes.get(sizes.len() / 2).copied().unwrap_or_default();
        let largest = sizes.last().copied().unwrap_or_default();
        let weight = weights.iter().sum::<f64>() / weights.len().max(1) as f64;
        let counts = [weights.len() + inactive, inactive].map(|n| n.to_string());
        let numbers = [rms, median, largest, weight].map(|x| format!("{x:.4}"));
        std::iter::once(name.to_owned()).chain(counts).chain(numbers).collect()
    };
    whitened(estimate).into_iter().map(row).collect()
}

fn error_over_time(estimate: &Estimate, evaluation: &EvaluationSettings) -> Chart {
    let truth = estimate.sequence.ground_truth.as_ref();
    let curve = |name: &str, poses: &[StampedPose]| {
        let pairs = associate(&truth?.trajectory, poses, evaluation.max_time_difference).ok()?;
        let (_, aligned) = align(&pairs, Alignment::Se3).ok()?;
        let start = aligned.first()?.timestamp;
        let point = |p: &manifactor_slam::metrics::PosePair| {
            (p.timestamp - start, (p.truth.translation - p.estimate.translation).norm())
        };
        Some((name.to_owned(), aligned.iter().map(point).collect()))
    };
    let curves = [curve("odometry", &estimate.odometry()), curve("estimated", &estimate.trajectory())];
    Chart {
        title: "error of position over time".into(),
        x: "time (s)".into(),
        y: "error (m), aligned by SE(3)".into(),
        log_x: false,
        curves: curves.into_iter().flatten().collect(),
    }
}
