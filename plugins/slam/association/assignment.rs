//! Optimal assignment of detections to objects.
use pathfinding::prelude::{Matrix, kuhn_munkres};

/// Resolution of the gains. The solver works with integers.
const GAIN_RESOLUTION: f64 = 1e-6;

/// Matches each row with at most one column, and each column with at most one row, so that the sum of the
/// gains is largest (the Hungarian method).
///
/// `gains` are (row, column, gain), for example detection, object and overlap. A pair that is not listed, or
/// whose gain is not positive, is not matched. Gains are rounded down to multiples of 1e-6. Returns the
/// column of each row.
///
/// ```
/// use manifactor_association::best_assignment;
///
/// let gains = [(0, 0, 3.0), (0, 1, 2.5), (1, 0, 2.8)];
/// assert_eq!(best_assignment(2, 2, &gains), [Some(1), Some(0)]);
/// ```
pub fn best_assignment(rows: usize, columns: usize, gains: &[(usize, usize, f64)]) -> Vec<Option<usize>> {
    if rows == 0 {
        return vec![];
    }
    // one extra column without gain per row, for rows that stay unmatched
    let mut weights = Matrix::new(rows, columns + rows, 0_i64);
    for (row, column, gain) in gains {
        weights[(*row, *column)] = (gain / GAIN_RESOLUTION).max(0.0) as i64;
    }
    let (_, matched) = kuhn_munkres(&weights);
    let is_match = |(row, column): &(usize, usize)| *column < columns && weights[(*row, *column)] > 0;
    matched
        .into_iter()
        .enumerate()
        .map(|pair| Some(pair).filter(is_match).map(|(_, column)| column))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_counts_and_not_the_first_best() {
        assert_eq!(best_assignment(2, 2, &[(0, 0, 3.0), (0, 1, 2.5), (1, 0, 2.8)]), [Some(1), Some(0)]);
        assert_eq!(best_assignment(2, 1, &[(0, 0, 1.0), (1, 0, 2.0)]), [None, Some(0)]);
        assert_eq!(best_assignment(1, 3, &[(0, 2, -1.0)]), [None]);
        assert!(best_assignment(0, 2, &[]).is_empty());
    }
}
