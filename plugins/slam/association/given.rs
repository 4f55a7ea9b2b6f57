use super::{Association, Associator, Corrections, FrameDetections, MapEstimate};
use manifactor_graph::register;
use manifactor_recording::class::ClassAliases;
use manifactor_recording::prior_map::PriorObject;
use manifactor_recording::sequence::ObjectId;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The source names the object of each detection. Detections without a name are skipped.
///
/// ```toml
/// association = { type = "given" }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Given")]
pub struct GivenAssociation {}

#[typetag::serialize(name = "given")]
impl Association for GivenAssociation {
    fn create_associator(&self, _: &ClassAliases, _: &[Arc<PriorObject>]) -> Box<dyn Associator> {
        Box::new(Self {})
    }

    fn uses_source_ids(&self) -> bool {
        true
    }
}
register!(dyn Association, "given", GivenAssociation);

impl Associator for GivenAssociation {
    fn associate(&self, image: &FrameDetections<'_>, _map: &dyn MapEstimate) -> Vec<Option<ObjectId>> {
        image.detections.iter().map(|detection| detection.object).collect()
    }

    fn learn_from_frame(
        &mut self,
        _image: &FrameDetections<'_>,
        _names: &[Option<ObjectId>],
        _map: &dyn MapEstimate,
    ) -> Corrections {
        Corrections::default()
    }
}
