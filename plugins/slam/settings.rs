//! The settings of a run: how a sequence becomes a graph, and how the graph is solved.
use crate::gravity::{FromSource, Gravity};
use crate::input::class::Aliases;
use crate::input::source::Source;
use crate::number;
use crate::semantics::{Rule, read_semantics};
use manifactor_config::{Diagnostics, Errors, Node, Problem, Section};
use manifactor_graph::Noise;
use manifactor_graph::loss::Loss;
use manifactor_solve::{LevenbergMarquardt, Optimizer};
use serde::Serialize;
use std::hash::Hasher;
use std::path::Path;
use std::sync::Arc;

mod detections;
mod evaluation;
mod objects;
mod own;
mod report;
pub mod run_document;
mod variance;

pub use detections::{CutSides, DetectionSettings};
pub use evaluation::EvaluationSettings;
pub use objects::ObjectSettings;
pub use own::OwnGraph;
pub use report::ReportSettings;
pub use variance::{BoxGroups, VarianceSettings};

/// Everything that is to be known to make an estimate.
#[derive(Debug, Clone, Serialize)]
pub struct Settings {
    /// Where the sequence comes from.
    pub source: Arc<dyn Source>,
    /// Factors between consecutive poses.
    pub odometry: OdometrySettings,
    /// The factor that holds the first pose.
    pub prior: PriorSettings,
    /// Which boxes are used, and how.
    pub detections: DetectionSettings,
    /// Which objects are mapped, and where they begin.
    pub objects: ObjectSettings,
    /// Which way is up.
    pub gravity: Arc<dyn Gravity>,
    /// Which objects get which factors.
    pub semantics: Vec<Rule>,
    /// Variables and factors of the document's own.
    #[serde(flatten)]
    pub own: OwnGraph,
    /// Names of classes that mean the same, besides the usual ones.
    #[serde(skip_serializing_if = "no_aliases")]
    pub aliases: Aliases,
    /// How the noise is estimated. Default: it is as given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variance_components: Option<VarianceSettings>,
    /// How the graph is solved.
    pub solver: Arc<dyn Optimizer>,
    /// What the estimate is compared with, and how.
    pub evaluation: EvaluationSettings,
    /// What is written besides the usual.
    pub report: ReportSettings,
}

fn no_aliases(aliases: &Aliases) -> bool {
    aliases.0.is_empty()
}

/// `[odometry]`: r = Log(Z⁻¹ Xᵢ⁻¹ Xᵢ₊₁), rotation before translation.
#[derive(Debug, Clone, Serialize)]
pub struct OdometrySettings {
    /// Of a relative pose: rad, then m. Default: σ = 0.01.
    pub noise: Noise,
    /// How much of a large error counts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss: Option<Arc<dyn Loss>>,
}

/// `[prior]`: r = Log(Z⁻¹ X₀).
#[derive(Debug, Clone, Serialize)]
pub struct PriorSettings {
    /// Of the first pose: rad, then m. Default: σ = 0.001.
    pub noise: Noise,
}

impl Settings {
    /// Reads settings; files are found from `folder`.
    ///
    /// # Errors
    /// Everything that is wrong with them, at its place.
    pub fn read(node: Node, folder: &Path) -> Result<Self, Diagnostics> {
        let errors = Errors::new();
        let settings = Section::new(node, &errors).and_then(|mut section| {
            let settings = Self::take(&mut section, folder);
            section.finish();
            settings
        });
        errors.finish(settings)
    }

    /// Tells these settings from others, and this program's version from others; the same on all machines.
    pub fn fingerprint(&self) -> String {
        let mut hash = fnv::FnvHasher::default();
        // what cannot be written has the version alone
        hash.write(serde_json::to_string(self).unwrap_or_default().as_bytes());
        hash.write(env!("CARGO_PKG_VERSION").as_bytes());
        format!("{:016x}", hash.finish())
    }

    /// Takes all settings out of a document.
    pub(crate) fn take(section: &mut Section<'_>, folder: &Path) -> Option<Self> {
        let source = section.required::<Box<dyn Source>>("source");
        let odometry = OdometrySettings::take(section);
        let prior = PriorSettings::take(section);
        let detections = DetectionSettings::take(section);
        let objects = ObjectSettings::take(section);
        let gravity = section.optional::<Box<dyn Gravity>>("gravity");
        let own = OwnGraph::take(section);
        let semantics = read_semantics(section, folder, &own.values);
        let aliases = section.or_default("aliases");
        let variance_components = section.optional("variance_components");
        let solver = section.optional::<Box<dyn Optimizer>>("solver");
        let evaluation = section.or_default("evaluation");
        let report = section.or_default("report");
        Some(Self {
            source: Arc::from(source?),
            odometry: odometry?,
            prior: prior?,
            detections: detections?,
            objects: objects?,
            gravity: gravity.map_or_else(|| Arc::new(FromSource {}) as Arc<dyn Gravity>, Arc::from),
            semantics,
            own,
            aliases,
            variance_components,
            solver: solver.map_or_else(default_solver, Arc::from),
            evaluation,
            report,
        })
    }
}

/// Damping of one size for all directions: in proportion to the diagonal of H, a semi-axis that has all but vanished
/// would go for good, since next to nothing is left of its derivative.
fn default_solver() -> Arc<dyn Optimizer> {
    Arc::new(LevenbergMarquardt { diagonal: [1.0, 1.0], ..LevenbergMarquardt::default() })
}

/// The noise of a section, or one of σ in every row.
fn noise(section: &mut Section<'_>, sigma: f64, rows: usize) -> Noise {
    let given = section.optional::<Noise>("noise");
    check_rows(section, given.as_ref(), rows);
    // a literal that is positive
    given.unwrap_or_else(|| Noise::sigma(sigma).unwrap_or_default())
}

/// Reports a section's noise that does not fit a residual of `rows` rows: once, and not for each factor that gets it.
pub(crate) fn check_rows(section: &Section<'_>, noise: Option<&Noise>, rows: usize) {
    if let Some(Err(error)) = noise.map(|noise| noise.whitener(rows)) {
        section.report("noise", Problem::invalid(error.to_string()));
    }
}

/// Rows of a pose's residual: rotation, translation.
const POSE_ROWS: usize = 6;

fn loss(section: &mut Section<'_>) -> Option<Arc<dyn Loss>> {
    section.optional::<Box<dyn Loss>>("loss").map(Arc::from)
}

impl OdometrySettings {
    fn take(parent: &mut Section<'_>) -> Option<Self> {
        number::table(parent, "odometry", |section| Self {
            noise: noise(section, 0.01, POSE_ROWS),
            loss: loss(section),
        })
    }
}

impl PriorSettings {
    fn take(parent: &mut Section<'_>) -> Option<Self> {
        number::table(parent, "prior", |section| Self { noise: noise(section, 0.001, POSE_ROWS) })
    }
}
