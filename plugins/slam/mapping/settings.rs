//! The settings of a run: how a sequence becomes a graph, and how the graph is solved.
use crate::gravity::{Gravity, SourceGravity};
use crate::motion::{MotionModel, OdometryMotion};
use crate::semantics::{RuleError, SemanticRule, add_shape_prior, read_semantics, read_sizes};
use manifactor_association::{Association, GivenAssociation};
use manifactor_config::{Diagnostics, Errors, Fault, Node, Section};
use manifactor_recording::class::ClassAliases;
use manifactor_recording::source::SequenceSource;
use manifactor_solve::{DiagonalLimits, LevenbergMarquardt, Optimizer};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::hash::Hasher;
use std::path::Path;
use std::sync::Arc;

mod completion;
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

pub use completion::CompletionSettings;
pub use detections::{CutSides, DetectionSettings};
pub use evaluation::EvaluationSettings;
pub use holdout::Holdout;
pub use objects::{Degrees, ObjectSettings};
pub use own::OwnGraph;
pub use poses::{OdometrySettings, PriorSettings};
pub use prior_map::MapAnchor;
pub use prior_map::PriorMapSettings;
pub use report::ReportSettings;
pub use variance::{BoxGroups, VarianceSettings};

/// Settings of one estimate. Parser, defaults and schema of a document derive from this type.
/// [`RunSettings::read`] adds the parts that need the rest of the document: semantic rules, and the document's
/// own variables and factors.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Settings")]
pub struct RunSettings {
    /// Source of the sequence.
    pub source: Arc<dyn SequenceSource>,
    /// Motion model between consecutive frames. Default: odometry.
    #[serde(default = "by_odometry", skip_serializing_if = "is_by_odometry")]
    pub motion: Arc<dyn MotionModel>,
    /// Noise and loss of the odometry's relative poses.
    #[serde(default)]
    pub odometry: OdometrySettings,
    /// Prior factor of the first pose.
    #[serde(default)]
    pub prior: PriorSettings,
    /// Map of an earlier run. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior_map: Option<PriorMapSettings>,
    /// Selection, noise and loss of the bounding boxes.
    #[serde(default)]
    pub detections: DetectionSettings,
    /// Data association: the object that each detection shows. Default: given by the source.
    #[serde(default = "given")]
    pub association: Arc<dyn Association>,
    /// Selection and initialization of objects.
    #[serde(default)]
    pub objects: ObjectSettings,
    /// Up direction of the world.
    #[serde(default = "from_source")]
    pub gravity: Arc<dyn Gravity>,
    /// Rules that assign factors to objects, followed by those of `sizes`.
    #[serde(skip_deserializing)]
    pub semantics: Vec<SemanticRule>,
    /// Variables and factors that the document declares itself.
    #[serde(flatten, skip_deserializing)]
    #[schemars(skip)]
    pub own: OwnGraph,
    /// Class names with the same meaning, in addition to the built-in ones.
    #[serde(default, skip_serializing_if = "no_aliases")]
    pub aliases: ClassAliases,
    /// Estimation of the noise. Default: none; the noise is used as given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variance_components: Option<VarianceSettings>,
    /// Second stage: all objects from all boxes, with fixed poses.
    #[serde(default)]
    pub completion: CompletionSettings,
    /// Solver of the graph. Default: Levenberg-Marquardt with equal damping in all directions.
    #[serde(default = "default_solver")]
    pub solver: Arc<dyn Optimizer>,
    /// Incremental smoother that `manifactor online` updates with each frame.
    #[serde(default)]
    pub online: manifactor_smoother::SmootherSettings,
    /// Comparison of the estimate with ground truth and with held-out boxes.
    #[serde(default)]
    pub evaluation: EvaluationSettings,
    /// Additional output.
    #[serde(default)]
    pub report: ReportSettings,
}

fn no_aliases(aliases: &ClassAliases) -> bool {
    aliases.0.is_empty()
}

fn by_odometry() -> Arc<dyn MotionModel> {
    Arc::new(OdometryMotion {})
}

/// Returns whether this is the default model, which is left out of a written document. Documents from before
/// motion models could be chosen stay the same.
fn is_by_odometry(motion: &Arc<dyn MotionModel>) -> bool {
    motion.typetag_name() == "odometry"
}

fn given() -> Arc<dyn Association> {
    Arc::new(GivenAssociation {})
}

fn from_source() -> Arc<dyn Gravity> {
    Arc::new(SourceGravity {})
}

/// Levenberg-Marquardt with equal damping in all directions. If damping were proportional to the diagonal of
/// H, a semi-axis that has almost vanished could not recover, because its derivative is nearly zero.
fn default_solver() -> Arc<dyn Optimizer> {
    Arc::new(LevenbergMarquardt { diagonal: DiagonalLimits::EVEN, ..LevenbergMarquardt::default() })
}

/// Ways to set the up direction.
const UP_HELP: &str = "set `[gravity]`, for example gravity = { type = \"vector\", up = [0.0, 0.0, 1.0] } in the odometry \
                       frame; the sources `recorded` and `json_lines` also have a field `up`";

impl RunSettings {
    /// Reads settings. Paths are relative to `folder`.
    ///
    /// # Errors
    /// All errors in the settings, each with its position in the document.
    pub fn read(node: &Node, folder: &Path) -> Result<Self, Diagnostics> {
        let errors = Errors::new();
        let settings = Section::new(node, &errors).and_then(|mut section| {
            let own = OwnGraph::read_section(&mut section);
            let semantics = section.optional_node("semantics");
            let mut semantics = read_semantics(semantics, folder, &own.values, &errors);
            semantics.extend(read_sizes(section.optional_node("sizes"), folder, &errors));
            let mut settings = Self { semantics, own, ..section.rest()? };
            if let Some(prior) = &mut settings.prior_map {
                prior.read(folder, &settings.aliases, node, &errors)?;
            }
            settings.check_motion(node, &errors);
            settings.check_up(node, &errors);
            Some(settings)
        });
        errors.finish(settings)
    }

    /// Reports settings that do not fit the motion model.
    fn check_motion(&self, node: &Node, errors: &Errors) {
        let place = |field: &str| node.field(field).unwrap_or(node).place.clone();
        let model = self.motion.typetag_name();
        for (key, prefix) in self.own.numbered_variables(self.motion.prefixes()) {
            let message = format!("`{key}` is the key of a variable of the motion model `{model}`");
            let help = format!("{prefix}0, {prefix}1, … are variables of the frames: choose another name");
            errors.report(place("variables"), Fault::with_help(message, help));
        }
        let is_estimated = self.variance_components.as_ref().is_some_and(|variance| variance.odometry);
        if is_estimated && !is_by_odometry(&self.motion) {
            let message =
                format!("the noise of the odometry cannot be estimated with the motion model `{model}`");
            let help = "set `variance_components.odometry = false`, or leave `motion` out";
            errors.report(place("variance_components"), Fault::with_help(message, help));
        }
    }

    /// Reports rules that need the up direction if nothing can determine it.
    fn check_up(&self, node: &Node, errors: &Errors) {
        let map_has_up = self.anchor().is_some_and(|anchor| anchor.map.up.is_some());
        if map_has_up || self.gravity.may_find_up(&*self.source) {
            return;
        }
        if let Some(rule) = self.semantics.iter().find(|rule| rule.needs_up()) {
            let error = RuleError::NoUp { factor: rule.factor.factor_type().to_owned() };
            let place = node.field("semantics").unwrap_or(node).place.clone();
            errors.report(place, Fault::with_help(error.to_string(), UP_HELP));
        }
    }

    /// Returns these settings with a weak `shape_prior` for all objects, unless a rule has one already.
    /// Streams need this prior: while few boxes show an object, a semi-axis would shrink to zero or grow
    /// without limit.
    #[must_use]
    pub fn for_stream(mut self) -> Self {
        add_shape_prior(&mut self.semantics);
        self
    }

    /// Returns a hash of these settings and of the program version. The hash is equal on all machines.
    pub fn fingerprint(&self) -> String {
        let mut hash = fnv::FnvHasher::default();
        // settings that cannot be serialized are identified by the version alone
        hash.write(serde_json::to_string(self).unwrap_or_default().as_bytes());
        if let Some(prior) = &self.prior_map {
            hash.write(serde_json::to_string(&prior.map).unwrap_or_default().as_bytes());
        }
        hash.write(env!("CARGO_PKG_VERSION").as_bytes());
        format!("{:016x}", hash.finish())
    }
}
