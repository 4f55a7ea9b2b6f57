//! A colour for each class.
/// Told apart on white: Paul Tol's muted scheme, then darker and brighter ones.
const COLORS: [&str; 24] = [
    "#332288", "#cc6677", "#117733", "#88ccee", "#882255", "#ddaa33", "#44aa99", "#aa4499", "#999933",
    "#4477aa", "#bb5500", "#66aa33", "#775544", "#777777", "#ee3377", "#009988", "#7755cc", "#dd9988",
    "#225555", "#663333", "#0055ff", "#ccbb44", "#ff7700", "#555500",
];

/// The classes of objects in alphabetical order, each with its colour.
pub(crate) fn classes<'a>(of: impl Iterator<Item = &'a str>) -> Vec<(&'a str, &'static str)> {
    let mut names: Vec<&str> = of.collect();
    names.sort_unstable();
    names.dedup();
    names.into_iter().zip(COLORS.iter().copied().cycle()).collect()
}
