//! The settings of a run: how a sequence becomes a graph, and how the graph is solved.
use crate::gravity::{FromSource, Gravity};
use crate::motion::{MotionModel, Odometry};
use crate::semantics::{Rule, add_weak_shape, read_semantics};
use manifactor_association::{Association, Given};
use manifactor_config::{Diagnostics, Errors, Fault, Node, Section};
use manifactor_recording::class::Aliases;
use manifactor_recording::source::Source;
use manifactor_solve::{DiagonalLimits, LevenbergMarquardt, Optimizer};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::hash::Hasher;
use std::path::Path;
use std::sync::Arc;

mod detections;
mod evaluation;
mod holdout;
mod objects;
mod own;
mod poses;
mod prior_map;
mod report;
pub mod run_document;
mod variance;

pub use detections::{CutSides, DetectionSettings};
pub use evaluation::EvaluationSettings;
pub use holdout::Holdout;
pub use objects::{Degrees, ObjectSettings};
pub use own::OwnGraph;
pub use poses::{OdometrySettings, PriorSettings};
pub use prior_map::Anchor;
pub use prior_map::PriorMapSettings;
pub use report::ReportSettings;
pub use variance::{BoxGroups, VarianceSettings};

/// Settings of one estimate. Parser, defaults and schema of a document derive from this type; [`Settings::read`] adds the parts that need
/// the rest of the document: rules, and variables and factors of its own.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Where the sequence comes from.
    pub source: Arc<dyn Source>,
    /// What ties consecutive frames. Default: their odometry.
    #[serde(default = "by_odometry", skip_serializing_if = "is_by_odometry")]
    pub motion: Arc<dyn MotionModel>,
    /// Noise and loss of the odometry's relative poses.
    #[serde(default)]
    pub odometry: OdometrySettings,
    /// The factor that holds the first pose.
    #[serde(default)]
    pub prior: PriorSettings,
    /// A map that was made before. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior_map: Option<PriorMapSettings>,
    /// Which boxes are used, and how.
    #[serde(default)]
    pub detections: DetectionSettings,
    /// Which object a box shows. Default: the source says so.
    #[serde(default = "given")]
    pub association: Arc<dyn Association>,
    /// Which objects are mapped, and where they begin.
    #[serde(default)]
    pub objects: ObjectSettings,
    /// Which way is up.
    #[serde(default = "from_source")]
    pub gravity: Arc<dyn Gravity>,
    /// Which objects get which factors.
    #[serde(skip_deserializing)]
    pub semantics: Vec<Rule>,
    /// Variables and factors of the document's own.
    #[serde(flatten, skip_deserializing)]
    #[schemars(skip)]
    pub own: OwnGraph,
    /// Names of classes that mean the same, besides the usual ones.
    #[serde(default, skip_serializing_if = "no_aliases")]
    pub aliases: Aliases,
    /// How the noise is estimated. Default: it is as given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variance_components: Option<VarianceSettings>,
    /// How the graph is solved. Default: Levenberg-Marquardt that damps all directions alike.
    #[serde(default = "default_solver")]
    pub solver: Arc<dyn Optimizer>,
    /// How the graph is kept up to date while frames come in, by `manifactor online`.
    #[serde(default)]
    pub online: manifactor_smoother::Settings,
    /// What the estimate is compared with, and how.
    #[serde(default)]
    pub evaluation: EvaluationSettings,
    /// What is written besides the usual.
    #[serde(default)]
    pub report: ReportSettings,
}

fn no_aliases(aliases: &Aliases) -> bool {
    aliases.0.is_empty()
}

fn by_odometry() -> Arc<dyn MotionModel> {
    Arc::new(Odometry {})
}

/// Documents that name no model are written as before there was a choice.
fn is_by_odometry(motion: &Arc<dyn MotionModel>) -> bool {
    motion.typetag_name() == "odometry"
}

fn given() -> Arc<dyn Association> {
    Arc::new(Given {})
}

fn from_source() -> Arc<dyn Gravity> {
    Arc::new(FromSource {})
}

/// Damping of one size for all directions: in proportion to the diagonal of H, a semi-axis that has all but vanished
/// would go for good, since next to nothing is left of its derivative.
fn default_solver() -> Arc<dyn Optimizer> {
    Arc::new(LevenbergMarquardt { diagonal: DiagonalLimits::EVEN, ..LevenbergMarquardt::default() })
}

impl Settings {
    /// Reads settings; files are found from `folder`.
    ///
    /// # Errors
    /// Everything that is wrong with them, at its place.
    pub fn read(node: &Node, folder: &Path) -> Result<Self, Diagnostics> {
        let errors = Errors::new();
        let settings = Section::new(node, &errors).and_then(|mut section| {
            let own = OwnGraph::take(&mut section);
            let semantics = read_semantics(section.take("semantics"), folder, &own.values, &errors);
            let mut settings = Self { semantics, own, ..section.rest()? };
            if let Some(prior) = &mut settings.prior_map {
                prior.read(folder, &settings.aliases, node, &errors)?;
            }
            settings.check_motion(node, &errors);
            Some(settings)
        });
        errors.finish(settings)
    }

    /// Reports settings that do not go with the motion model.
    fn check_motion(&self, node: &Node, errors: &Errors) {
        let place = |field: &str| node.field(field).unwrap_or(node).place.clone();
        let model = self.motion.typetag_name();
        for (key, prefix) in self.own.numbered(self.motion.prefixes()) {
            let message = format!("`{key}` is the key of a variable of the motion model `{model}`");
            let help = format!("{prefix}0, {prefix}1, … are variables of the frames: choose another name");
            errors.report(place("variables"), Fault::with_help(message, help));
        }
        let is_estimated = self.variance_components.as_ref().is_some_and(|variance| variance.odometry);
        if is_estimated && !is_by_odometry(&self.motion) {
            let message =
                format!("the motion model `{model}` has no odometry whose noise could be estimated");
            let help = "set `variance_components.odometry = false`, or leave `motion` out";
            errors.report(place("variance_components"), Fault::with_help(message, help));
        }
    }

    /// These settings with what a stream adds: a weak `shape_prior` for all objects, unless a rule has one. While few boxes show an
    /// object, a semi-axis would otherwise shrink to nothing or grow without limit.
    #[must_use]
    pub fn for_stream(mut self) -> Self {
        add_weak_shape(&mut self.semantics);
        self
    }

    /// Tells these settings from others, and this program's version from others; the same on all machines.
    pub fn fingerprint(&self) -> String {
        let mut hash = fnv::FnvHasher::default();
        // what cannot be written has the version alone
        hash.write(serde_json::to_string(self).unwrap_or_default().as_bytes());
        if let Some(prior) = &self.prior_map {
            hash.write(serde_json::to_string(&prior.map).unwrap_or_default().as_bytes());
        }
        hash.write(env!("CARGO_PKG_VERSION").as_bytes());
        format!("{:016x}", hash.finish())
    }
}
