//! Series with gaps, or with more points than are visible.

/// Smallest gap, as a multiple of the usual step between two values.
const GAP: usize = 5;
/// Smallest distance of two points on a path. Unit: pixels.
const SPACING: f64 = 0.5;

/// Splits a series at its gaps, because a line across a gap would show unknown values.
pub(crate) fn stretches<T: Copy>(series: impl IntoIterator<Item = Option<T>>) -> Vec<Vec<T>> {
    let series = series.into_iter().enumerate();
    let known: Vec<(usize, T)> = series.filter_map(|(i, value)| Some((i, value?))).collect();
    let mut steps: Vec<usize> = known.iter().zip(known.iter().skip(1)).map(|(a, b)| b.0 - a.0).collect();
    steps.sort_unstable();
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(1);
    let parts = known.chunk_by(|a, b| b.0 - a.0 <= GAP * usual);
    parts.map(|part| part.iter().map(|(_, value)| *value).collect()).collect()
}

/// Removes the points of a path that are too close to the previous one; keeps both ends.
pub(crate) fn spaced(points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let (Some(mut kept), Some(last)) = (points.first().copied(), points.last().copied()) else {
        return points;
    };
    let is_apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) >= SPACING;
    let mut thin = vec![kept];
    for point in points.into_iter().skip(1) {
        if is_apart(kept, point) {
            kept = point;
            thin.push(point);
        }
    }
    if thin.last() != Some(&last) {
        thin.push(last);
    }
    thin
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_is_longer_than_steps_usually_are() {
        let known = |places: &[usize]| -> Vec<Option<usize>> {
            (0..200).map(|i| places.contains(&i).then_some(i)).collect()
        };
        let mut places: Vec<usize> = (0..50).chain(150..200).collect();
        assert_eq!(stretches(known(&places)).iter().map(Vec::len).collect::<Vec<_>>(), [50, 50]);
        // a truth at a tenth of the rate of the frames has no gaps
        places = (0..20).map(|i| 10 * i).collect();
        assert_eq!(stretches(known(&places)).len(), 1);
        assert!(stretches(known(&[])).is_empty());
    }

    #[test]
    fn a_path_keeps_its_ends() {
        let path: Vec<[f64; 2]> = (0..=1000).map(|i| [f64::from(i) * 0.01, 0.0]).collect();
        let thin = spaced(path.clone());
        assert!(thin.len() <= 21 && thin.first() == path.first() && thin.last() == path.last());
        assert_eq!(spaced(vec![]), Vec::<[f64; 2]>::new());
    }
}
