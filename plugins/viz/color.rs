//! A colour for each class.
use crate::scene::Scene;

/// Told apart on white, by eyes that see red and green alike too: Paul Tol's muted scheme, then darker ones.
const COLORS: [&str; 14] = [
    "#332288", "#cc6677", "#117733", "#88ccee", "#882255", "#ddaa33", "#44aa99", "#aa4499", "#999933",
    "#4477aa", "#bb5500", "#66aa33", "#775544", "#777777",
];

/// The classes of a scene in alphabetical order, each with its colour.
pub(crate) fn classes(scene: &Scene) -> Vec<(&str, &'static str)> {
    let mut names: Vec<&str> = scene.objects.iter().map(|o| o.class.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    names.into_iter().zip(COLORS.iter().copied().cycle()).collect()
}
