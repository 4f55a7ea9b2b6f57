//! A data source: a static camera without detections.
use manifactor::config::{Document, Format};
use manifactor::geometry::Se3;
use manifactor::prelude::*;
use manifactor::quadric::Camera;
use manifactor::slam::run::Run;
use manifactor::slam::run_document::RunDocument;
use manifactor::slam::sequence::{Frame, Sequence};
use manifactor::slam::source::{InputFolders, SequenceSource, SourceError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Empty frames.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Nothing {
    /// Number of frames.
    frames: usize,
}

#[typetag::serialize(name = "test_nothing")]
impl SequenceSource for Nothing {
    fn load(&self, _folders: &InputFolders) -> Result<Sequence, SourceError> {
        let frame = |i: usize| Frame::new(i as f64, Se3::identity());
        Ok(Sequence {
            cameras: Camera {
                fx: 320.0,
                fy: 320.0,
                cx: 320.0,
                cy: 240.0,
                skew: 0.0,
                width: 640,
                height: 480,
            }
            .into(),
            body_from_camera: None,
            frames: (0..self.frames).map(frame).collect(),
            detections: vec![],
            up: Some(Direction::Z),
            accelerometer: vec![],
            ground_truth: None,
            georeference: None,
            pose_factors: vec![],
            corrected_jumps: vec![],
            unused: vec![],
        })
    }
}
register!(dyn SequenceSource, "test_nothing", Nothing);

#[test]
fn a_run_names_it() {
    let text = "source = { type = \"test_nothing\", frames = 4 }";
    let document = Document::parse("run.toml", text, Format::Toml).unwrap();
    let document = RunDocument::read(&document).unwrap_or_else(|e| panic!("{e}"));
    let mut run = Run::new(&document, None);
    let (estimate, report) = run.run_variant(&document.variants[0], &mut Silent).unwrap();
    assert_eq!((report.counts.frames, report.counts.objects), (4, 0));
    assert_eq!(estimate.trajectory().len(), 4);
}
