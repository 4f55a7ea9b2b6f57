//! Free directions of a factor, which do not change its residual.
use manifactor_graph::Linearization;
use nalgebra::DMatrix;

/// A direction with a singular value below this share of the largest one is free.
const FREE_SINGULAR_VALUE: f64 = 1e-9;

/// The rank of a Jacobian over all variables, and the structure of its null space.
#[derive(Debug, Clone, PartialEq)]
pub struct Freedom {
    /// Number of directions of all variables together.
    pub directions: usize,
    /// Number of directions that change the residual.
    pub rank: usize,
    /// Free directions and free combinations of several directions. Positions count over all variables, in
    /// order.
    pub free: Vec<Free>,
}

/// A part of a null space.
#[derive(Debug, Clone, PartialEq)]
pub struct Free {
    /// Number of free combinations. If it equals the number of directions, all of them are free.
    pub count: usize,
    /// Directions, by position over all variables.
    pub among: Vec<usize>,
}

impl Freedom {
    /// Returns the number of free directions.
    pub fn count(&self) -> usize {
        self.directions - self.rank
    }
}

/// Returns the free directions of a residual, to first order, from Jacobians at several points.
///
/// The rank is the largest one at any of the points. At the remaining points a derivative vanishes, so they
/// are not used. Directions belong together if the null space at one of the points mixes them.
pub fn freedom(linearizations: &[Linearization]) -> Option<Freedom> {
    let spaces: Vec<_> = linearizations.iter().filter_map(null_space).collect();
    let usual = spaces.iter().map(|(rank, _)| *rank).max()?;
    let projections: Vec<_> = spaces.into_iter().filter(|(rank, _)| *rank == usual).map(|(_, p)| p).collect();
    let first = projections.first()?;
    let directions = first.nrows();
    let mixed = |i: usize, j: usize| projections.iter().any(|p| p[(i, j)].abs() > 1e-6);
    let mut free: Vec<Free> = vec![];
    let mut seen = vec![false; directions];
    for start in 0..directions {
        let mut among = vec![];
        let mut open = vec![start];
        while let Some(i) = open.pop() {
            if !seen[i] && mixed(i, i) {
                seen[i] = true;
                among.push(i);
                open.extend((0..directions).filter(|j| mixed(i, *j)));
            }
        }
        among.sort_unstable();
        let count = among.iter().map(|i| first[(*i, *i)]).sum::<f64>().round() as usize;
        if count > 0 {
            free.push(Free { count, among });
        }
    }
    Some(Freedom { directions, rank: usual, free })
}

/// Returns the rank and the projection onto the null space; `None` if an entry is not finite.
fn null_space(linearization: &Linearization) -> Option<(usize, DMatrix<f64>)> {
    let blocks = &linearization.jacobians;
    let columns: usize = blocks.iter().map(DMatrix::ncols).sum();
    let rows = linearization.residual.len();
    // add rows of zeros to get all right singular vectors
    let mut j = DMatrix::zeros(rows.max(columns), columns);
    let mut at = 0;
    for block in blocks {
        j.view_mut((0, at), block.shape()).copy_from(block);
        at += block.ncols();
    }
    if j.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let svd = j.svd(false, true);
    let v_t = svd.v_t?;
    let largest = svd.singular_values.max();
    let seen = |i: usize| svd.singular_values[i] > FREE_SINGULAR_VALUE * largest;
    let rank = (0..columns).filter(|i| seen(*i)).count();
    let mut projection = DMatrix::zeros(columns, columns);
    for row in (0..columns).filter(|i| !seen(*i)).map(|i| v_t.row(i)) {
        projection += row.transpose() * row;
    }
    Some((rank, projection))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jacobian(rows: usize, entries: &[f64]) -> Linearization {
        let j = DMatrix::from_row_slice(rows, entries.len() / rows, entries);
        Linearization { residual: vec![0.0; rows], jacobians: vec![j] }
    }

    #[test]
    fn a_direction_that_no_row_sees_is_free_alone_and_a_sum_leaves_a_combination() {
        let j = jacobian(1, &[1.0, 1.0, 0.0, 2.0]);
        let found = freedom(&[j]).unwrap();
        assert_eq!((found.rank, found.directions), (1, 4));
        let expected = [Free { count: 2, among: vec![0, 1, 3] }, Free { count: 1, among: vec![2] }];
        assert_eq!(found.free, expected);
    }

    #[test]
    fn the_rank_is_the_largest_at_any_point() {
        let flat = jacobian(2, &[0.0, 0.0, 0.0, 0.0]);
        let sound = jacobian(2, &[1.0, 0.0, 0.0, 3.0]);
        let found = freedom(&[flat.clone(), sound, flat]).unwrap();
        assert_eq!((found.rank, found.count(), found.free.len()), (2, 0, 0));
    }

    #[test]
    fn a_combination_that_turns_from_point_to_point_keeps_its_directions_together() {
        let found = freedom(&[jacobian(1, &[1.0, 0.0]), jacobian(1, &[1.0, 0.5])]).unwrap();
        assert_eq!(found.free, [Free { count: 1, among: vec![0, 1] }]);
    }
}
