use super::{Association, Associator, Image, Learned, Map};
use manifactor_graph::register;
use manifactor_quadric::Camera;
use manifactor_recording::class::Aliases;
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
pub struct Given {}

#[typetag::serialize(name = "given")]
impl Association for Given {
    fn begin(&self, _: Camera, _: &Aliases, _: &[Arc<PriorObject>]) -> Box<dyn Associator> {
        Box::new(Self {})
    }

    fn uses_names(&self) -> bool {
        true
    }
}
register!(dyn Association, "given", Given);

impl Associator for Given {
    fn associate(&self, image: &Image<'_>, _map: &dyn Map) -> Vec<Option<ObjectId>> {
        image.detections.iter().map(|detection| detection.object).collect()
    }

    fn learn(&mut self, _image: &Image<'_>, _names: &[Option<ObjectId>], _map: &dyn Map) -> Learned {
        Learned::default()
    }
}
