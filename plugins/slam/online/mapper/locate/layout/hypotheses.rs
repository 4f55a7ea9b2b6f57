//! Pose hypotheses from a few matching marks.
use super::{CandidateMatch, Layout};
use manifactor_geometry::Se3;

/// Maximum number of hypotheses.
const MAX_HYPOTHESES: usize = 4000;
/// Maximum number of groups of local marks.
const MAX_GROUPS: usize = 2000;

impl Layout {
    /// Returns poses at which two local marks match known ones; three if the up direction is unknown.
    /// Each group of local marks is tried with all possible matches. Sampling a few pairs per mark would
    /// rarely contain two right ones if many objects share a class.
    pub(super) fn hypotheses(&self) -> Vec<Se3> {
        let (options, size) = (self.options(), if self.up.is_some() { 2 } else { 3 });
        let mut places = vec![];
        for group in groups(options.len(), size).take(MAX_GROUPS) {
            let mut chosen: Vec<Vec<CandidateMatch>> = vec![vec![]];
            for member in group {
                chosen = chosen.iter().flat_map(|some| self.with_one_more(some, &options[member])).collect();
            }
            places.extend(chosen.iter().filter_map(|pairs| self.fit_pose(pairs)));
            if places.len() >= MAX_HYPOTHESES {
                break;
            }
        }
        places.truncate(MAX_HYPOTHESES);
        places
    }

    /// Returns the candidate matches of each local mark. Marks with the most distinctive classes come first.
    fn options(&self) -> Vec<Vec<CandidateMatch>> {
        let mut options = vec![vec![]; self.local.len()];
        for pair in &self.pairs {
            options[pair.local].push(*pair);
        }
        options.retain(|pairs| !pairs.is_empty());
        // the matches of a mark are already sorted, and the sort is stable
        options.sort_by(|a, b| b[0].evidence.total_cmp(&a[0].evidence));
        options
    }

    /// Extends compatible pairs by each further pair that is compatible with all of them.
    fn with_one_more<'a>(
        &'a self,
        pairs: &'a [CandidateMatch],
        more: &'a [CandidateMatch],
    ) -> impl Iterator<Item = Vec<CandidateMatch>> + 'a {
        let fits = more.iter().filter(|new| pairs.iter().all(|pair| self.are_compatible(pair, new)));
        fits.map(|new| pairs.iter().chain([new]).copied().collect())
    }
}

/// Returns groups of two or three marks, each in ascending order. Groups of the first marks come first, but
/// no mark is in all of the first groups.
fn groups(marks: usize, size: usize) -> impl Iterator<Item = Vec<usize>> {
    let pairs = move |sum: usize, from: usize| {
        let firsts = from..sum.div_ceil(2);
        firsts.map(move |a| [a, sum - a]).filter(move |[_, b]| *b < marks)
    };
    (1..size * marks).flat_map(move |sum| -> Box<dyn Iterator<Item = Vec<usize>>> {
        if size == 2 {
            return Box::new(pairs(sum, 0).map(Vec::from));
        }
        let with_first = move |a: usize| pairs(sum - a, a + 1).map(move |[b, c]| vec![a, b, c]);
        Box::new((0..sum.min(marks)).flat_map(with_first))
    })
}

#[cfg(test)]
mod tests {
    use super::groups;
    use std::collections::BTreeSet;

    #[test]
    fn each_group_comes_once_and_the_first_marks_first() {
        for (marks, size, expected) in [(0, 2, 0), (1, 2, 0), (5, 2, 10), (8, 2, 28), (2, 3, 0), (6, 3, 20)] {
            let all: Vec<_> = groups(marks, size).collect();
            let distinct: BTreeSet<_> = all.iter().collect();
            assert_eq!((all.len(), distinct.len()), (expected, expected), "{all:?}");
            assert!(all.iter().all(|group| group.len() == size && group.is_sorted_by(|a, b| a < b)));
            assert!(all.iter().map(|group| group.iter().sum::<usize>()).is_sorted());
        }
    }
}
