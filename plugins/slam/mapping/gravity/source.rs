use super::{Gravity, GravityError, MapFrame};
use manifactor_graph::register;
use manifactor_recording::sequence::Sequence;
use manifactor_recording::source::SequenceSource;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The up direction comes from the data source. Simulators provide it, real data seldom do.
///
/// The map stays in the odometry frame.
///
/// ```toml
/// gravity = { type = "source" }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "FromSource")]
pub struct SourceGravity {}

#[typetag::serialize(name = "source")]
impl Gravity for SourceGravity {
    fn locate(&self, sequence: &Sequence) -> Result<MapFrame, GravityError> {
        Ok(MapFrame::of_odometry(sequence.up))
    }

    fn may_find_up(&self, source: &dyn SequenceSource) -> bool {
        source.may_have_up()
    }
}
register!(dyn Gravity, "source", SourceGravity);
