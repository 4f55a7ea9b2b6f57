//! Draws the figures of the book that come from the repository's own code.
//!
//! ```sh
//! cargo run --release -p manifactor-viz --example figures              # all
//! cargo run --release -p manifactor-viz --example figures -- losses    # some
//! ```
//! The table in `docs/figures/README.md` has all names. The documents of the runs are in `examples/figures`.
#![allow(clippy::print_stdout)]
use manifactor_config::Document;
use manifactor_geometry::{Between, Prior, Se2, Se3, So2};
use manifactor_graph::loss::{Cauchy, ErasedLoss, GemanMcClure, Huber, L2, Tukey};
use manifactor_graph::{Graph, Noise, Values};
use manifactor_quadric::DualQuadric;
use manifactor_semantic as _;
use manifactor_slam::experiment::{self, Experiment, ExperimentSummary, TrialLog, trials_table};
use manifactor_slam::mapping::measurements::ObjectMeasurements;
use manifactor_slam::output::OutputFolder;
use manifactor_slam::record::VariantRecord;
use manifactor_slam::run::{MappedFrame, Run, StreamEvent, StreamWatcher};
use manifactor_slam::run_document::RunDocument;
use manifactor_slam::source::InputFolders;
use manifactor_solve::{
    Dogleg, GaussNewton, Interrupt, LevenbergMarquardt, Optimizer, Silent, Solution, solve,
};
use manifactor_viz::figures::{self, Movie, Plot, beside};
use manifactor_viz::{Picture, Theme, experiment_pictures, latencies};
use nalgebra::{Vector2, Vector3};
use std::error::Error;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

type Fallible<T> = Result<T, Box<dyn Error>>;
/// Draws one figure, and returns its SVG.
type Draw = fn() -> Fallible<String>;

const FIGURES: [(&str, Draw); 12] = [
    ("ellipsoid_and_box", ellipsoid_and_box),
    ("factor_graph", factor_graph),
    ("growing", growing),
    ("outliers", outliers),
    ("short_arc", short_arc),
    ("latency", latency),
    ("cost", cost),
    ("pose_graph", pose_graph),
    ("losses", losses),
    ("association", association),
    ("differences", differences),
    ("noise", noise),
];

/// Width of the figures. Unit: pixels.
const WIDTH: f64 = 900.0;

fn main() -> Fallible<()> {
    let names: Vec<String> = std::env::args().skip(1).collect();
    if let Some(unknown) = names.iter().find(|name| FIGURES.iter().all(|(own, _)| own != name)) {
        let known: Vec<&str> = FIGURES.iter().map(|(name, _)| *name).collect();
        return Err(format!("unknown figure {unknown}; there are {}", known.join(", ")).into());
    }
    for (name, draw) in FIGURES.iter().filter(|(name, _)| names.is_empty() || names.iter().any(|n| n == name))
    {
        let svg = draw()?;
        println!("{name}.svg: {} kB", svg.len() / 1000);
        std::fs::write(root().join("docs/figures").join(format!("{name}.svg")), svg)?;
    }
    Ok(())
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn document(name: &str) -> Fallible<Document> {
    Ok(Document::open(root().join("examples/figures").join(name))?)
}

fn svg(picture: Option<Picture>) -> Fallible<String> {
    Ok(picture.ok_or("there is nothing to draw")?.svg(Theme::Light))
}

fn ellipsoid_and_box() -> Fallible<String> {
    svg(figures::ellipsoid_and_box(WIDTH))
}

fn factor_graph() -> Fallible<String> {
    svg(Some(figures::factor_graph(WIDTH)))
}

/// Runs all variants of a document.
fn records(name: &str) -> Fallible<Vec<VariantRecord>> {
    let document = RunDocument::read(&document(name)?)?;
    let mut run = Run::new(&document, None);
    let mut record = |variant| -> Fallible<VariantRecord> {
        Ok(VariantRecord::new(variant, &run.run_variant(variant, &mut Silent)?.0))
    };
    document.variants.iter().map(&mut record).collect()
}

/// Draws the objects of all variants next to each other.
fn objects_beside(document: &str, name: &str, text: &str) -> Fallible<String> {
    let records = records(document)?;
    let width = WIDTH / records.len().max(1) as f64;
    let pictures = records.iter().filter_map(|record| figures::objects(record, &record.name, width));
    svg(Some(beside(name, text, &pictures.collect::<Vec<_>>())))
}

fn outliers() -> Fallible<String> {
    objects_beside("outliers.toml", "outliers", "A bad run and its repair: without and with a Cauchy loss")
}

fn short_arc() -> Fallible<String> {
    objects_beside(
        "short_arc.toml",
        "short_arc",
        "Objects seen from a short arc, without and with orientation factors",
    )
}

/// Keeps snapshots of a growing map.
struct Snapshots {
    movie: Option<Movie>,
    seen: usize,
}

/// Number of frames between two snapshots.
const EVERY: usize = 4;

impl StreamWatcher for Snapshots {
    fn event(&mut self, event: StreamEvent<'_>) -> ControlFlow<()> {
        let StreamEvent::Frame(MappedFrame { report: Ok(report), mapper, .. }) = event else {
            return ControlFlow::Continue(());
        };
        self.seen += 1;
        if self.seen % EVERY != 1 {
            return ControlFlow::Continue(());
        }
        let up = mapper.up().unwrap_or_default();
        let movie = self.movie.get_or_insert_with(|| Movie::new("A map grows, frame by frame", up));
        let path: Vec<Se3> = (0..=report.frame).filter_map(|frame| mapper.pose_of(frame)).collect();
        let objects: Vec<(String, DualQuadric)> =
            mapper.objects().map(|(object, quadric)| (class(object), quadric)).collect();
        movie.add(report.timestamp, &path, objects.iter().map(|(class, quadric)| (class.as_str(), quadric)));
        ControlFlow::Continue(())
    }
}

fn class(object: &ObjectMeasurements) -> String {
    object.class_name().unwrap_or("unknown").to_owned()
}

/// A map that has grown frame by frame.
struct Grown {
    movie: Movie,
    /// Record of the batch solve after the last frame.
    record: VariantRecord,
    /// Time of each frame. Unit: seconds.
    seconds: Vec<f64>,
}

/// Maps the frames of `growing.toml` one by one, once for all figures.
fn grown() -> Fallible<&'static Grown> {
    static GROWN: OnceLock<Grown> = OnceLock::new();
    if let Some(grown) = GROWN.get() {
        return Ok(grown);
    }
    let document = RunDocument::read(&document("growing.toml")?)?;
    let variant = document.variants.first().ok_or("the document has no variant")?;
    let mut snapshots = Snapshots { movie: None, seen: 0 };
    let mut run = Run::new(&document, None);
    let (estimate, report) = run.run_variant_online(variant, &mut snapshots)?;
    let seconds = report.online.map(|online| online.seconds).unwrap_or_default();
    let movie = snapshots.movie.ok_or("no frame was mapped")?;
    let record = VariantRecord::new(variant, &estimate);
    Ok(GROWN.get_or_init(|| Grown { movie, record, seconds }))
}

fn growing() -> Fallible<String> {
    Ok(grown()?.movie.svg(800.0, 6.0, Theme::Light).ok_or("there is nothing to draw")?)
}

fn association() -> Fallible<String> {
    let text = "Data association over time: the frames in which each object is detected";
    svg(figures::association(&grown()?.record, text, WIDTH))
}

fn latency() -> Fallible<String> {
    svg(latencies("Latency of the smoother: time of each frame", &grown()?.seconds, WIDTH))
}

/// Number of poses on a side of the square that the simulated robot drives around, and number of rounds.
const SIDE: usize = 15;
const ROUNDS: usize = 4;

/// Pseudorandom numbers with mean 0 and standard deviation 1, the same on every machine.
struct Normal(u64);

impl Normal {
    fn next(&mut self) -> f64 {
        // the sum of twelve uniform numbers has variance 1; constants of the generator: Knuth, MMIX
        let mut sum = 0.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 11) as f64 / (1u64 << 53) as f64;
        }
        sum - 6.0
    }
}

/// A pose graph of a robot that drives around a square: the graph, its values by odometry, and its edges.
fn square() -> Fallible<(Graph, Values, Vec<[usize; 2]>)> {
    let mut normal = Normal(7);
    let count = 4 * SIDE * ROUNDS;
    let turn = |i: usize| if i % SIDE == SIDE - 1 { std::f64::consts::FRAC_PI_2 } else { 0.0 };
    let motion = |i: usize| {
        let rotation = So2::exp(turn(i));
        Se2 { rotation, translation: Vector2::new(1.0, 0.0) }
    };
    let mut truth = vec![Se2::identity()];
    for i in 1..count {
        let before = truth.last().copied().unwrap_or_else(Se2::identity);
        truth.push(before.compose(&motion(i - 1)));
    }
    let mut measured = |from: usize, to: usize| {
        let noise = Vector3::new(0.03 * normal.next(), 0.03 * normal.next(), 0.02 * normal.next());
        truth[from].between(&truth[to]).compose(&Se2::exp(&noise))
    };
    let noise = Noise::sigmas(&[0.03, 0.03, 0.02])?;
    let (mut graph, mut values, mut edges) = (Graph::new(), Values::new(), vec![]);
    graph.add(["x0"], Prior { value: Se2::identity() });
    values.insert("x0", Se2::identity());
    let mut pose = Se2::identity();
    for i in 1..count {
        let relative = measured(i - 1, i);
        pose = pose.compose(&relative);
        values.insert(format!("x{i}").as_str(), pose);
        edges.push([i - 1, i]);
        let keys = [format!("x{}", i - 1), format!("x{i}")];
        graph.add(keys, Between { relative }).noise(noise.clone());
        // a loop closure at every fifth pose of the later rounds
        if i >= 4 * SIDE && i % 5 == 0 {
            let closed = i - 4 * SIDE;
            edges.push([closed, i]);
            let keys = [format!("x{closed}"), format!("x{i}")];
            graph.add(keys, Between { relative: measured(closed, i) }).noise(noise.clone());
        }
    }
    Ok((graph, values, edges))
}

fn positions(values: &Values) -> Fallible<Vec<[f64; 2]>> {
    let position = |i: usize| -> Fallible<[f64; 2]> {
        let pose = values.get::<Se2>(format!("x{i}").as_str())?;
        Ok([pose.translation.x, pose.translation.y])
    };
    (0..4 * SIDE * ROUNDS).map(position).collect()
}

fn solved(solver: &dyn Optimizer) -> Fallible<(Solution, Vec<[usize; 2]>, Values)> {
    let (graph, values, edges) = square()?;
    Ok((solve(&graph, &values, solver, &mut Silent)?, edges, values))
}

fn pose_graph() -> Fallible<String> {
    let (solution, edges, before) = solved(&LevenbergMarquardt::default())?;
    let half = WIDTH / 2.0;
    let before = figures::pose_graph("before: odometry alone", &positions(&before)?, &edges, half);
    let after = figures::pose_graph("after the solve", &positions(&solution.values)?, &edges, half);
    let parts: Vec<Picture> = [before, after].into_iter().flatten().collect();
    svg(Some(beside("pose_graph", "A pose graph before and after the solve", &parts)))
}

fn cost() -> Fallible<String> {
    let solvers: [(&str, Box<dyn Optimizer>); 3] = [
        ("Gauss-Newton", Box::new(GaussNewton::default())),
        ("Levenberg-Marquardt", Box::new(LevenbergMarquardt::default())),
        ("Dogleg", Box::new(Dogleg::default())),
    ];
    let curve = |(name, solver): &(&str, Box<dyn Optimizer>)| -> Fallible<(String, Vec<(f64, f64)>)> {
        let outcome = solved(&**solver)?.0.outcome;
        let accepted = outcome.history.iter().filter(|step| step.accepted);
        let costs = std::iter::once(outcome.initial_cost).chain(accepted.filter_map(|step| step.trial_cost));
        Ok(((*name).to_owned(), costs.enumerate().map(|(i, cost)| (i as f64, cost)).collect()))
    };
    let curves = solvers.iter().map(curve).collect::<Fallible<Vec<_>>>()?;
    let text = "Cost over accepted steps, from odometry alone";
    svg(Plot::over("accepted steps").panel("cost, ½ Σ ρ", true, curves).picture("cost", text, WIDTH, 420.0))
}

fn losses() -> Fallible<String> {
    let losses: [(&str, Box<dyn ErasedLoss>); 5] = [
        ("none", Box::new(L2 {})),
        ("huber", Box::new(Huber::new(1.0)?)),
        ("cauchy", Box::new(Cauchy::new(1.0)?)),
        ("geman_mcclure", Box::new(GemanMcClure::new(1.0)?)),
        ("tukey", Box::new(Tukey::new(3.0)?)),
    ];
    let residuals: Vec<f64> = (-60..=60).map(|i| f64::from(i) / 10.0).collect();
    let curves = |of: fn((f64, f64)) -> f64| {
        let curve = |(name, loss): &(&str, Box<dyn ErasedLoss>)| {
            let points = residuals.iter().map(|r| (*r, of(loss.rho(r * r))));
            ((*name).to_owned(), points.filter(|(_, y)| *y <= 12.0).collect())
        };
        losses.iter().map(curve).collect()
    };
    let plot = Plot::over("residual r (standard deviations)")
        .panel("ρ(r²)", false, curves(|(rho, _)| rho))
        .panel("weight ρ'(r²)", false, curves(|(_, weight)| weight));
    svg(plot.picture("losses", "Robust losses and the weights that they give to residuals", WIDTH, 560.0))
}

/// Draws the means that `examples/experiments/tum/noise.toml` has measured on public recordings.
fn noise() -> Fallible<String> {
    let text = std::fs::read_to_string(root().join("examples/figures/noise.csv"))?;
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<&str>>());
    let names = lines.next().ok_or("noise.csv is empty")?;
    let mut curves: Vec<(String, Vec<(f64, f64)>)> =
        names.iter().skip(1).map(|name| ((*name).to_owned(), vec![])).collect();
    for row in lines {
        let numbers = row.iter().map(|cell| cell.parse()).collect::<Result<Vec<f64>, _>>()?;
        let Some((sigma, gains)) = numbers.split_first() else { continue };
        curves.iter_mut().zip(gains).for_each(|((_, points), gain)| points.push((*sigma, 100.0 * gain)));
    }
    let plot = Plot::over("σ of the orientation factors").logarithmic();
    let plot = plot.panel("removed share of the ATE (%)", false, curves);
    svg(plot.picture("noise", "Gain over the noise of the orientation factors", WIDTH, 420.0))
}

fn differences() -> Fallible<String> {
    let mut sweep = Experiment::read(&document("orientation.toml")?)?;
    let folder = root().join("target/figures/orientation");
    sweep.output.clone_from(&folder);
    let folders = InputFolders { data: None, document: sweep.folder.clone() };
    let claimed =
        OutputFolder::claim(&folder, "experiment", &root().join("examples/figures/orientation.toml"), true)?;
    let mut journal = TrialLog::open(claimed)?;
    experiment::run(&sweep, &folders, &mut journal, 1, &Interrupt::default(), |_| {})?;
    let (summary, trials) = (ExperimentSummary::new(&sweep, &journal), trials_table(&sweep, &journal));
    let pictures = experiment_pictures(&sweep, &summary, &trials, WIDTH / 2.0);
    let differences = pictures.into_iter().filter(|picture| picture.name.ends_with("_differences"));
    let parts: Vec<Picture> = differences.take(2).collect();
    svg(Some(beside("differences", "Means of an experiment with their 95 % intervals", &parts)))
}
