//! Scores of a data association against the true objects.
//!
//! Object ids are arbitrary, so the scores compare which boxes are grouped together. Recall is the share of
//! *pairs* of boxes of one true object that are grouped together. Precision is the share of grouped pairs
//! that belong to one true object. Homogeneity and completeness follow Rosenberg and Hirschberg, V-Measure,
//! 2007. Switches and the identity F1 are measures of multiple object tracking (Bernardin and Stiefelhagen,
//! 2008; Ristani et al., 2016).
use super::matching::{largest_matching, largest_weight};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::hash::Hash;

/// Scores of a data association.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct IdentityScores {
    /// Number of boxes with a known true object. Only these count.
    pub boxes: usize,
    /// Share of the pairs of boxes in one object that belong to one true object.
    pub precision: f64,
    /// Share of the pairs of boxes of one true object that are in one object.
    pub recall: f64,
    /// Harmonic mean of precision and recall.
    pub f1: f64,
    /// 1 if each object has boxes of one true object only.
    pub homogeneity: f64,
    /// 1 if all boxes of each true object are in one object.
    pub completeness: f64,
    /// Share of boxes in the right object, under the one-to-one matching of objects that maximizes it.
    pub identity_f1: f64,
    /// Number of changes of the object between consecutive boxes of a true object.
    pub switches: usize,
    /// Number of true objects.
    pub true_objects: usize,
    /// Number of objects with at least three boxes.
    pub objects: usize,
}

/// Smallest number of boxes of an object that counts.
const MIN_OBJECT_BOXES: usize = 3;

/// Scores boxes in the order of time. Each has its true object and its assigned object; a box without an
/// assigned object is alone.
pub fn identity<T, P>(boxes: impl IntoIterator<Item = (T, Option<P>)>) -> IdentityScores
where
    T: Copy + Ord + Hash,
    P: Copy + Ord + Hash,
{
    /// An assigned object, or a box that is alone and counts as an object.
    #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    enum AssignedObject<P> {
        Into(P),
        Alone(usize),
    }
    let (mut cells, mut truths, mut found) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    let (mut last, mut switches, mut all) = (BTreeMap::new(), 0, 0);
    for (truth, put) in boxes {
        if let Some(put) = put
            && last.insert(truth, put).is_some_and(|before| before != put)
        {
            switches += 1;
        }
        let put = put.map_or(AssignedObject::Alone(all), AssignedObject::Into);
        *cells.entry((truth, put)).or_insert(0_usize) += 1;
        *truths.entry(truth).or_insert(0_usize) += 1;
        *found.entry(put).or_insert(0_usize) += 1;
        all += 1;
    }
    let pairs =
        |counts: &mut dyn Iterator<Item = &usize>| counts.map(|n| (n * (n - 1) / 2) as f64).sum::<f64>();
    let share = |part: f64, of: f64| if of > 0.0 { part / of } else { 1.0 };
    let right = pairs(&mut cells.values());
    let (precision, recall) =
        (share(right, pairs(&mut found.values())), share(right, pairs(&mut truths.values())));
    let f1 = if precision + recall > 0.0 { 2.0 * precision * recall / (precision + recall) } else { 0.0 };
    let total = all.max(1) as f64;
    let part = |n: usize, of: usize| -(n as f64 / total) * (n as f64 / of as f64).ln();
    let of_all = |counts: &mut dyn Iterator<Item = &usize>| counts.map(|n| part(*n, all)).sum::<f64>();
    let given_found = cells.iter().map(|((_, put), n)| part(*n, found[put])).sum::<f64>();
    let given_truth = cells.iter().map(|((truth, _), n)| part(*n, truths[truth])).sum::<f64>();
    let left = |given: f64, of: f64| if of > 0.0 { 1.0 - given / of } else { 1.0 };
    // of the boxes that are alone, a true object can be matched with at most one
    let mut shared = BTreeMap::new();
    for ((truth, put), n) in &cells {
        match put {
            AssignedObject::Into(put) => shared.insert((*truth, Some(*put)), *n),
            AssignedObject::Alone(_) => shared.insert((*truth, None), 1),
        };
    }
    IdentityScores {
        boxes: all,
        precision,
        recall,
        f1,
        homogeneity: left(given_found, of_all(&mut truths.values())),
        completeness: left(given_truth, of_all(&mut found.values())),
        identity_f1: best_match(&shared, &truths) as f64 / total,
        switches,
        true_objects: truths.len(),
        objects: found.values().filter(|n| **n >= MIN_OBJECT_BOXES).count(),
    }
}

/// Returns the number of boxes in the right object under the best one-to-one matching of objects. `None`
/// stands for one box that is alone, separately for each true object.
fn best_match<T: Copy + Ord, P: Copy + Ord>(
    shared: &BTreeMap<(T, Option<P>), usize>,
    truths: &BTreeMap<T, usize>,
) -> usize {
    let numbers: BTreeMap<T, usize> = truths.keys().copied().zip(0..).collect();
    let found: BTreeSet<P> = shared.keys().filter_map(|(_, put)| *put).collect();
    let columns: BTreeMap<P, usize> = found.into_iter().zip(numbers.len()..).collect();
    let mut rows = vec![vec![]; numbers.len()];
    for ((truth, put), n) in shared {
        let row = numbers[truth];
        rows[row].push((put.map_or(row, |put| columns[&put]), *n as i64));
    }
    usize::try_from(largest_weight(&rows, numbers.len() + columns.len())).unwrap_or(0)
}

/// Returns the assigned object of each true object, under the one-to-one matching with the largest number of boxes in the
/// right object. Each box has its true object and its assigned object; true objects without a partner are left out.
pub fn matched_objects<T: Copy + Ord, P: Copy + Ord>(
    boxes: impl IntoIterator<Item = (T, P)>,
) -> BTreeMap<T, P> {
    let mut shared: BTreeMap<T, BTreeMap<P, i64>> = BTreeMap::new();
    for (truth, put) in boxes {
        *shared.entry(truth).or_default().entry(put).or_insert(0) += 1;
    }
    let found: BTreeSet<P> = shared.values().flat_map(BTreeMap::keys).copied().collect();
    let columns: BTreeMap<P, usize> = found.iter().copied().zip(0..).collect();
    let row = |counts: &BTreeMap<P, i64>| counts.iter().map(|(put, n)| (columns[put], *n)).collect();
    let rows: Vec<Vec<(usize, i64)>> = shared.values().map(row).collect();
    let found: Vec<P> = found.into_iter().collect();
    let partners = largest_matching(&rows, found.len()).into_iter().map(|column| found.get(column?).copied());
    shared.into_keys().zip(partners).filter_map(|(truth, put)| Some((truth, put?))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scores(truth: &[u32], put: &[u32]) -> IdentityScores {
        let put = put.iter().map(|put| Some(*put).filter(|put| *put > 0));
        identity(truth.iter().copied().zip(put))
    }

    #[test]
    fn what_is_right_scores_one_whatever_the_names() {
        let right = scores(&[1, 1, 2, 2, 1, 2, 2], &[7, 7, 3, 3, 7, 3, 3]);
        for score in [right.precision, right.recall, right.f1, right.homogeneity, right.completeness] {
            assert!((score - 1.0).abs() < 1e-12);
        }
        assert_eq!((right.switches, right.true_objects, right.objects), (0, 2, 2));
        assert_eq!(right.identity_f1, 1.0);
    }

    #[test]
    fn pairs_are_counted_by_hand() {
        // true pairs: 3 + 1; grouped pairs: 1 + 3, of these 1 + 1 are right
        let some = scores(&[1, 1, 1, 2, 2], &[4, 4, 5, 5, 5]);
        assert_eq!((some.precision, some.recall, some.f1), (0.5, 0.5, 0.5));
        assert_eq!((some.switches, some.objects, some.boxes), (1, 1, 5));
        assert_eq!(some.identity_f1, 0.8);
    }

    #[test]
    fn one_object_for_all_is_complete_and_tells_nothing() {
        let one = scores(&[1, 1, 2, 2], &[9, 9, 9, 9]);
        assert!((one.completeness - 1.0).abs() < 1e-12 && one.homogeneity.abs() < 1e-12);
        assert_eq!((one.recall, one.identity_f1), (1.0, 0.5));
    }

    #[test]
    fn boxes_of_no_object_are_alone() {
        let none = scores(&[1, 1, 1], &[0, 0, 0]);
        assert_eq!((none.precision, none.recall, none.f1, none.objects), (1.0, 0.0, 0.0, 0));
        assert_eq!(scores(&[], &[]).f1, 1.0);
    }

    #[test]
    fn many_objects_need_no_matrix() {
        let boxes = (0..60_000_u32).map(|i| (i % 20_000, Some(20_000 - i % 20_000)));
        assert_eq!(identity(boxes).identity_f1, 1.0);
    }

    #[test]
    fn true_objects_are_matched_by_their_boxes() {
        // 1 is mostly in 20, 2 in 10; 3 shares 20 with 1, and a box of it is alone in 30
        let boxes = [(1, 20), (1, 20), (1, 20), (2, 10), (2, 20), (3, 20), (3, 20), (3, 30)];
        assert_eq!(matched_objects(boxes), BTreeMap::from([(1, 20), (2, 10), (3, 30)]));
        assert_eq!(matched_objects([(1, 5), (2, 5), (2, 5)]), BTreeMap::from([(2, 5)]));
        assert!(matched_objects::<u32, u32>([]).is_empty());
    }
}
