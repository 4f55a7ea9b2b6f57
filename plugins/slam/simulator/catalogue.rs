//! Typical solids of the classes, in their usual resting position.
use super::solid::Solid;

/// A class with its solid. In the usual resting position z points up.
pub(super) struct ObjectKind {
    pub class: &'static str,
    pub solid: fn() -> Solid,
}

macro_rules! kinds {
    ($($class:literal => $solid:expr),+ $(,)?) => {
        /// COCO's class names, as in recorded detections, with typical sizes in metres.
        pub(super) const KINDS: &[ObjectKind] = &[$(ObjectKind { class: $class, solid: || $solid }),+];
    };
}
kinds! {
    "bottle" => Solid::frustum(0.04, 0.025, 0.28),
    "cup" => Solid::frustum(0.035, 0.045, 0.12),
    "vase" => Solid::frustum(0.05, 0.08, 0.30),
    "wine glass" => Solid::frustum(0.03, 0.04, 0.20),
    "pottedplant" => Solid::frustum(0.08, 0.14, 0.40),
    "teddy bear" => Solid::cuboid([0.22, 0.16, 0.34]),
    "backpack" => Solid::cuboid([0.30, 0.18, 0.45]),
    "chair" => Solid::folded([0.45, 0.45, 0.90], 0.06),
    "book" => Solid::cuboid([0.18, 0.26, 0.03]),
    "keyboard" => Solid::cuboid([0.44, 0.14, 0.03]),
    "mouse" => Solid::cuboid([0.06, 0.11, 0.04]),
    "cell phone" => Solid::cuboid([0.07, 0.15, 0.01]),
    "remote" => Solid::cuboid([0.05, 0.19, 0.02]),
    "laptop" => Solid::folded([0.34, 0.24, 0.22], 0.015),
    "tvmonitor" => Solid::cuboid([0.55, 0.16, 0.38]),
    "scissors" => Solid::cuboid([0.08, 0.20, 0.01]),
    "sports ball" => Solid::ball(0.11),
}

/// Returns the solid of a class.
pub(super) fn kind(class: &str) -> Option<&'static ObjectKind> {
    KINDS.iter().find(|kind| kind.class == class)
}
