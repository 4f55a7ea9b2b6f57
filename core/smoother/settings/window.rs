//! Settings of the window.
use manifactor_graph::checked::Positive;
use manifactor_graph::{Key, TypeName, Variable};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::num::NonZeroUsize;

/// A window that moves with the newest variables. Older variables are marginalized at the end of an update,
/// as by [`Smoother::marginalize`](crate::Smoother::marginalize), in groups: a window is longer by up to an eighth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "WindowDocument", into = "WindowDocument")]
#[schemars(with = "WindowDocument")]
pub struct Window {
    /// Length of the window.
    pub span: Span,
    /// Types whose variables always stay.
    pub keep: Vec<TypeName<dyn Variable>>,
    /// Keys of variables that always stay.
    pub keep_keys: Vec<Key>,
}

/// Length of a window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Span {
    /// Number of variables that stay: the newest ones, without the types that are kept.
    Poses(NonZeroUsize),
    /// Seconds for which a variable stays after it was pushed. The newest variable always stays. The current
    /// time is the last [`Smoother::set_time`](crate::Smoother::set_time).
    Seconds(Positive),
}

/// The window as written in a document.
#[derive(Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Window")]
struct WindowDocument {
    /// Number of variables that stay, at least one: the newest ones, without the types of `keep`. Older ones
    /// are marginalized at the end of an update, as by `Smoother::marginalize`, once they are more than an eighth
    /// of this number. Either this or `seconds`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    poses: Option<NonZeroUsize>,
    /// Time for which a variable stays after it was pushed, by the clock of `Smoother::set_time`. The newest
    /// variable always stays. Older ones are marginalized once the oldest exceeds the time by an eighth. Either this
    /// or `poses`. Unit: seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    seconds: Option<Positive>,
    /// Names of types whose variables always stay, for example `"dual_quadric"`. Default: none.
    #[serde(default)]
    keep: Vec<TypeName<dyn Variable>>,
    /// Keys of variables that always stay, for example `"enu_from_map"`. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    keep_keys: Vec<Key>,
}

/// A window with both `poses` and `seconds`, or with neither.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected either `poses` or `seconds`, found {}; give one of them: `poses = 200`, or `seconds = 60.0`",
    if *both { "both" } else { "neither" }
)]
pub struct NotOneSpan {
    both: bool,
}

impl TryFrom<WindowDocument> for Window {
    type Error = NotOneSpan;
    fn try_from(
        WindowDocument { poses, seconds, keep, keep_keys }: WindowDocument,
    ) -> Result<Self, NotOneSpan> {
        let span = match (poses, seconds) {
            (Some(poses), None) => Span::Poses(poses),
            (None, Some(seconds)) => Span::Seconds(seconds),
            (poses, _) => return Err(NotOneSpan { both: poses.is_some() }),
        };
        Ok(Self { span, keep, keep_keys })
    }
}

impl From<Window> for WindowDocument {
    fn from(Window { span, keep, keep_keys }: Window) -> Self {
        let (poses, seconds) = match span {
            Span::Poses(poses) => (Some(poses), None),
            Span::Seconds(seconds) => (None, Some(seconds)),
        };
        Self { poses, seconds, keep, keep_keys }
    }
}

impl From<Span> for Window {
    /// Returns a window without variables that always stay.
    fn from(span: Span) -> Self {
        Self { span, keep: vec![], keep_keys: vec![] }
    }
}
