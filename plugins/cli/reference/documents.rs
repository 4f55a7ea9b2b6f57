//! The kinds of documents, with their fields and an example of each.
use crate::input::graph_file;
use crate::reference::fields::{Field, fields};
use manifactor::config::Definitions;
use manifactor::inertial::visual::VisualInertialDocument;
use manifactor::slam::schema::{experiment_root, frame_root, rules_root, run_root};
use serde_json::Value;

/// A kind of document.
pub(crate) struct DocumentKind {
    /// The name in commands, such as `experiment`.
    pub name: &'static str,
    /// The name in texts, such as `An experiment`.
    pub title: &'static str,
    /// The purpose, in sentences.
    pub about: &'static str,
    /// A small document in TOML.
    pub example: &'static str,
    /// Adds the definitions of the schema, and returns its root.
    pub root: fn(&mut Definitions) -> Value,
}

/// All kinds of documents, in the order of the reference.
pub(crate) static DOCUMENTS: [DocumentKind; 6] = [
    DocumentKind {
        name: "graph",
        title: "A literal graph",
        about: "Variables with their initial values, and the factors between them. `manifactor solve` solves it, `manifactor \
                graph` lists its factors, and `manifactor replay` replays it pose by pose.",
        example: r#"[[variables]]
key = "x0"
value = { type = "se2", translation = [0.0, 0.0], angle = 0.0 }
fixed = true

[[variables]]
key = "x1"
value = { type = "se2", translation = [0.9, 0.1], angle = 0.1 }

[[factors]]
keys = ["x0", "x1"]
factor = { type = "between_se2", relative = { translation = [1.0, 0.0], angle = 0.0 } }
noise = { sigma = 0.1 }"#,
        root: graph_file::root,
    },
    DocumentKind {
        name: "run",
        title: "A run",
        about: "The source of the data, the settings of the map, and variants that differ in some of them. `manifactor run` \
                computes it as one batch, `manifactor online` frame by frame.",
        example: r#"title = "desk"
source = { type = "simulated", seed = 1 }
solver = { type = "levenberg_marquardt" }

[[variants]]
name = "boxes"

[[variants]]
name = "robust"
set = { detections = { loss = { type = "cauchy", scale = 2.8 } } }"#,
        root: run_root,
    },
    DocumentKind {
        name: "rules",
        title: "A file of semantic rules",
        about: "Rules that add factors to objects by class. A run names the file: semantics = \"rules.toml\". A run can also \
                hold the same table itself.",
        example: r#"[[semantics]]
classes = ["bottle", "cup"]
factor = { type = "vertical_orientation_smooth" }
noise = { sigma = 0.03 }"#,
        root: rules_root,
    },
    DocumentKind {
        name: "experiment",
        title: "An experiment",
        about: "A run that is repeated over a grid of settings and seeds, and the tables of its results. `manifactor \
                experiment` computes it.",
        example: r#"base = "run.toml"

[[axes]]
columns = { seed = "source.seed" }
rows = [1, 2, 3]

[[axes]]
name = "views"
options = [
    { name = "few", set = { objects = { min_views = 2 } } },
    { name = "many", set = { objects = { min_views = 5 } } },
]

[summary]
by = ["views"]
metrics = ["position", "shape"]"#,
        root: experiment_root,
    },
    DocumentKind {
        name: "visual-inertial",
        title: "A visual-inertial recording",
        about: "The readings of an IMU and the tracked points of a camera, in files beside the document. `manifactor vio` \
                estimates its motion.",
        example: r#"imu = "imu.csv"
tracks = "tracks.csv"
camera = { fx = 458.7, fy = 457.3, cx = 367.2, cy = 248.4, width = 752, height = 480 }
body_from_camera = { translation = [-0.022, -0.065, 0.01], rotation = [0.0, 0.0, 0.6, 0.8] }"#,
        root: |definitions| definitions.of::<VisualInertialDocument>(),
    },
    DocumentKind {
        name: "frame",
        title: "A frame of a stream",
        about: "A line of JSON that the source `json_lines` reads. `manifactor online` maps frames as they arrive.",
        example: r#"timestamp = 0.1
pose = { translation = [0.0, 0.0, 0.0], rotation = [0.0, 0.0, 0.0, 1.0] }
boxes = [{ box = [10.0, 20.0, 90.0, 80.0], class = "cup", score = 0.8 }]"#,
        root: frame_root,
    },
];

impl DocumentKind {
    /// Returns the JSON Schema.
    pub(crate) fn schema(&self) -> Value {
        let mut definitions = Definitions::new();
        let root = (self.root)(&mut definitions);
        definitions.document(root)
    }

    /// Returns the fields, including those of inner tables.
    pub(crate) fn fields(&self) -> Vec<Field> {
        fields(&self.schema())
    }
}
