//! One-to-one matching of maximum weight, in memory proportional to the number of positive weights.
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

/// Returns the largest sum of weights of a matching, see [`largest_matching`].
pub(super) fn largest_weight(rows: &[Vec<(usize, i64)>], columns: usize) -> i64 {
    let weight = |(row, column): (&Vec<(usize, i64)>, Option<usize>)| {
        row.iter().find(|(other, _)| Some(*other) == column).map_or(0, |(_, weight)| *weight)
    };
    rows.iter().zip(largest_matching(rows, columns)).map(weight).sum()
}

/// Returns the column of each row in a matching with the largest sum of weights, with at most one column per row, and
/// at most one row per column. `None`: the row is not matched.
///
/// `rows` has the columns and weights of each row; a pair that is not listed has weight zero. Rows are added
/// one by one along the shortest augmenting path (Jonker and Volgenant, 1987).
pub(super) fn largest_matching(rows: &[Vec<(usize, i64)>], columns: usize) -> Vec<Option<usize>> {
    // an extra column per row allows the row to stay unmatched
    let edges = |row: usize| rows[row].iter().copied().chain([(columns + row, 0)]);
    let largest = |row: usize| edges(row).map(|(_, weight)| weight).max().unwrap_or(0);
    // duals: row + column ≥ weight for each pair, with equality if it is matched
    let mut row_duals: Vec<i64> = (0..rows.len()).map(largest).collect();
    let mut column_duals = vec![0_i64; columns + rows.len()];
    let mut row_of: Vec<Option<usize>> = vec![None; column_duals.len()];
    let mut column_of: Vec<Option<usize>> = vec![None; rows.len()];
    for added in 0..rows.len() {
        // for each column that the search reached: its distance, and the row before it
        let mut reached: BTreeMap<usize, (i64, usize)> = BTreeMap::new();
        let mut passed: Vec<(usize, usize, i64)> = vec![];
        let mut queue = BinaryHeap::new();
        let (mut row, mut length) = (added, 0);
        let end = loop {
            for (column, weight) in edges(row) {
                let distance = length + row_duals[row] + column_duals[column] - weight;
                if reached.get(&column).is_none_or(|(known, _)| distance < *known) {
                    reached.insert(column, (distance, row));
                    queue.push(Reverse((distance, column)));
                }
            }
            let Some(Reverse((distance, column))) = queue.pop() else { break None };
            if distance > reached[&column].0 {
                continue;
            }
            length = distance;
            let Some(next) = row_of[column] else { break Some(column) };
            passed.push((next, column, distance));
            row = next;
        };
        row_duals[added] -= length;
        for (row, column, distance) in passed {
            row_duals[row] -= length - distance;
            column_duals[column] += length - distance;
        }
        let mut free = end;
        while let Some(column) = free {
            let row = reached[&column].1;
            row_of[column] = Some(row);
            // only the added row had no column
            free = column_of[row].replace(column);
        }
    }
    column_of.into_iter().map(|column| column.filter(|column| *column < columns)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use pathfinding::prelude::{Matrix, kuhn_munkres};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_sum_is_that_of_the_dense_method(
            weights in prop::collection::vec(prop::collection::vec(prop_oneof![Just(0), 1_i64..6], 7), 1..8)
        ) {
            let listed = |row: &Vec<i64>| row.iter().copied().enumerate().filter(|(_, weight)| *weight > 0).collect();
            let rows: Vec<Vec<(usize, i64)>> = weights.iter().map(listed).collect();
            let dense = Matrix::from_rows(weights).unwrap();
            prop_assert_eq!(largest_weight(&rows, 7), kuhn_munkres(&dense).0);
        }
    }

    #[test]
    fn many_rows_that_share_one_column_need_no_matrix() {
        let rows: Vec<Vec<(usize, i64)>> = (0..20_000).map(|row| vec![(0, 1 + row % 7), (1, 3)]).collect();
        assert_eq!(largest_weight(&rows, 2), 10);
        assert_eq!(largest_weight(&[], 0), 0);
    }
}
