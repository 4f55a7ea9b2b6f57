//! Pairs of equal boxes in two files of detections.
use manifactor_formats::detections::DetectionRow;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::iter::repeat;

/// The object of a box, if it has one.
type Object = Option<u32>;

/// Boxes with equal timestamps and sides: their objects in the truth, and in the estimate.
#[derive(Default)]
struct EqualBoxes {
    timestamp: f64,
    truths: Vec<Object>,
    found: Vec<Object>,
}

/// Returns the true object of each box that has one, in order of time, with its object in the estimate if the
/// estimate has the box. Boxes are equal if their times and sides are; `object_key` 0 stands for no object.
///
/// The pairing of equal boxes with different objects does not depend on the order of the rows: first the
/// objects that share the most other boxes, then the rest by number.
pub fn pair_boxes(truth: &[DetectionRow], estimate: &[DetectionRow]) -> Vec<(u32, Option<Option<u32>>)> {
    // 0.0 and -0.0 are equal, but have different bits
    let bits = |x: f64| (x + 0.0).to_bits();
    let key = |d: &DetectionRow| [d.timestamp, d.xmin, d.ymin, d.xmax, d.ymax].map(bits);
    let object = |d: &DetectionRow| d.object_key.filter(|key| *key != 0);
    let mut boxes: HashMap<_, EqualBoxes> = HashMap::new();
    for d in truth {
        let equal = boxes.entry(key(d)).or_default();
        equal.timestamp = d.timestamp + 0.0;
        equal.truths.push(object(d));
    }
    estimate.iter().for_each(|d| boxes.entry(key(d)).or_default().found.push(object(d)));
    let boxes: Vec<EqualBoxes> = boxes.into_values().collect();
    let mut shared: BTreeMap<(Object, Object), usize> = BTreeMap::new();
    for equal in &boxes {
        if let ([truth], [found]) = (equal.truths.as_slice(), equal.found.as_slice()) {
            *shared.entry((*truth, *found)).or_default() += 1;
        }
    }
    let mut pairs = vec![];
    for EqualBoxes { timestamp, mut truths, mut found } in boxes {
        // boxes without an object come last
        let order = |object: &Object| (object.is_none(), *object);
        truths.sort_unstable_by_key(order);
        found.sort_unstable_by_key(order);
        for (truth, partner) in most_shared(&truths, &found, &shared) {
            let place = |list: &[Object], object| list.iter().position(|other| *other == object);
            while let (Some(i), Some(j)) = (place(&truths, truth), place(&found, partner)) {
                pairs.push((timestamp, truths.remove(i), Some(found.remove(j))));
            }
        }
        let rest = found.into_iter().map(Some).chain(repeat(None));
        pairs.extend(truths.into_iter().zip(rest).map(|(truth, found)| (timestamp, truth, found)));
    }
    pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then_with(|| (a.1, a.2).cmp(&(b.1, b.2))));
    pairs.into_iter().filter_map(|(_, truth, found)| Some((truth?, found))).collect()
}

/// Returns the pairs of a true and an estimated object that share other boxes, those with the most first.
/// Empty if there is no choice.
fn most_shared(
    truths: &[Object],
    found: &[Object],
    shared: &BTreeMap<(Object, Object), usize>,
) -> Vec<(Object, Object)> {
    if truths.len() < 2 && found.len() < 2 {
        return vec![];
    }
    let found: BTreeSet<Object> = found.iter().copied().collect();
    let truths: BTreeSet<Object> = truths.iter().copied().collect();
    let mut pairs: Vec<_> = truths
        .into_iter()
        .flat_map(|truth| shared.range((truth, None)..=(truth, Some(u32::MAX))))
        .filter(|((_, partner), _)| found.contains(partner))
        .map(|(pair, count)| (Reverse(*count), *pair))
        .collect();
    pairs.sort_unstable();
    pairs.into_iter().map(|(_, pair)| pair).collect()
}
