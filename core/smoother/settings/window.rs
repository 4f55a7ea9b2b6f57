//! What a window keeps, and how long.
use manifactor_graph::catalogue;
use manifactor_graph::checked::Positive;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::num::NonZeroUsize;

/// A window that moves with the newest variables. Older ones leave at the end of an update, as
/// [`Session::marginalize`](crate::Session::marginalize) takes them out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Document", into = "Document")]
#[schemars(with = "Document")]
pub struct Window {
    /// How far back it reaches.
    pub span: Span,
    /// Types whose variables never leave.
    pub keep: Vec<ManifoldType>,
}

/// How far back a window reaches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Span {
    /// So many variables stay, the newest of those whose type is not kept.
    Poses(NonZeroUsize),
    /// Variables stay that came within so many seconds before now, and always the newest. Now is the last
    /// [`Session::set_time`](crate::Session::set_time).
    Seconds(Positive),
}

/// The window as it is written.
#[derive(Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Window")]
struct Document {
    /// Variables that stay, the newest of those whose type is not kept; at least one. Older ones leave at the end of an update,
    /// as `Session::marginalize` takes them out. Either this or `seconds`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    poses: Option<NonZeroUsize>,
    /// Seconds for which a variable stays after it came, by the times of `Session::set_time`; the newest always stays. Either this or
    /// `poses`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    seconds: Option<Positive>,
    /// Names of types whose variables never leave: `"dual_quadric"`, say. Default: none.
    #[serde(default)]
    keep: Vec<ManifoldType>,
}

/// A window by poses and by seconds, or by neither.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected either `poses` or `seconds`, found {}; give one of them: `poses = 200`, or `seconds = 60.0`",
    if *both { "both" } else { "neither" }
)]
pub struct NotOneSpan {
    both: bool,
}

impl TryFrom<Document> for Window {
    type Error = NotOneSpan;
    fn try_from(Document { poses, seconds, keep }: Document) -> Result<Self, NotOneSpan> {
        let span = match (poses, seconds) {
            (Some(poses), None) => Span::Poses(poses),
            (None, Some(seconds)) => Span::Seconds(seconds),
            (poses, _) => return Err(NotOneSpan { both: poses.is_some() }),
        };
        Ok(Self { span, keep })
    }
}

impl From<Window> for Document {
    fn from(Window { span, keep }: Window) -> Self {
        let (poses, seconds) = match span {
            Span::Poses(poses) => (Some(poses), None),
            Span::Seconds(seconds) => (None, Some(seconds)),
        };
        Self { poses, seconds, keep }
    }
}

impl From<Span> for Window {
    /// With no type that is kept.
    fn from(span: Span) -> Self {
        Self { span, keep: vec![] }
    }
}

/// The name of a registered type of variables.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub struct ManifoldType(String);

/// A name that no type of variables has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown type of variables `{name}`: {}", advice(.name))]
pub struct UnknownManifold {
    name: String,
}

fn advice(name: &str) -> String {
    let known: Vec<String> = catalogue::entries(KIND).iter().map(|entry| entry.name.to_owned()).collect();
    let advice = manifactor_document::advice(name, &known);
    advice.unwrap_or_else(|| "this program has none; link the crate that registers it".to_owned())
}

/// What the catalogue calls a type of variables.
const KIND: &str = <dyn manifactor_graph::Variable as catalogue::Kind>::NAME;

impl TryFrom<String> for ManifoldType {
    type Error = UnknownManifold;
    fn try_from(name: String) -> Result<Self, UnknownManifold> {
        match catalogue::find(KIND, &name) {
            Some(_) => Ok(Self(name)),
            None => Err(UnknownManifold { name }),
        }
    }
}

impl From<ManifoldType> for String {
    fn from(name: ManifoldType) -> Self {
        name.0
    }
}

impl ManifoldType {
    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}
