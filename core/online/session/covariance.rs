//! Covariances from the fronts at hand: along paths of the tree, without a factorization.
use super::Session;
use crate::tree::NONE;
use manifactor_graph::Key;
use nalgebra::DMatrix;

/// Why there is no covariance.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CovarianceError {
    /// A variable that is not there.
    #[error("there is no variable `{key}`")]
    NoVariable {
        /// What was asked for.
        key: Key,
    },
    /// A variable that waits for factors to determine it.
    #[error("the covariance of `{key}` is infinite: its factors do not determine it yet")]
    Parked {
        /// The variable.
        key: Key,
    },
    /// A direction that nothing constrains, on which the variables depend.
    #[error("the covariance is infinite: nothing constrains `{key}.{direction}`; add a prior, or fix it")]
    Undetermined {
        /// A variable that can move.
        key: Key,
        /// How: name of the tangent direction.
        direction: &'static str,
    },
}

impl Session {
    /// The joint covariance of a few variables, in the order of `keys` and of their tangent directions, in the units of the
    /// noise; what is held has zeros. It is that of the last linearization points, robust weights included.
    ///
    /// # Errors
    /// Where a variable is not there or parked, or something that it hangs on is undetermined.
    pub fn covariance(&self, keys: &[&str]) -> Result<DMatrix<f64>, CovarianceError> {
        let mut variables = vec![];
        for key in keys {
            let missing = || CovarianceError::NoVariable { key: Key::from(*key) };
            let v = self.model.variable(key).ok_or_else(missing)?;
            let place = self.model.place(v);
            if place.parked {
                return Err(CovarianceError::Parked { key: self.key(v) });
            }
            variables.push(v);
        }
        // Σᵢⱼ = (L⁻¹eᵢ)ᵀ(L⁻¹eⱼ), and such a column is zero but on the path from its front to the root
        let path = self.path(&variables);
        for f in &path.fronts {
            if let Some((v, direction)) = self.fronts.open(*f).first() {
                let direction = self.model.place(*v).tangent[*direction as usize];
                return Err(CovarianceError::Undetermined { key: self.key(*v), direction });
            }
        }
        let mut columns = vec![];
        for v in &variables {
            let held = self.model.place(*v).held;
            for d in 0..self.dim(*v) {
                let is_free = held >> d & 1 == 0;
                columns.push(if is_free { self.column(&path, *v, d) } else { vec![0.0; path.scalars] });
            }
        }
        let dot = |r: usize, c: usize| columns[r].iter().zip(&columns[c]).map(|(a, b)| a * b).sum::<f64>();
        Ok(DMatrix::from_fn(columns.len(), columns.len(), |r, c| dot(r.max(c), r.min(c))))
    }

    /// The fronts on the way from variables to their roots.
    fn path(&self, variables: &[u32]) -> Path {
        let mut path = Path { first: vec![NONE; self.model.variables()], ..Path::default() };
        // from each variable up to where the path is joined; what is found later stands before it
        for v in variables {
            let (mut f, mut way) = (self.tree.front_of(*v), vec![]);
            while f != NONE && !path.fronts.contains(&f) {
                way.push(f);
                f = self.tree.fronts[f as usize].parent;
            }
            way.append(&mut path.fronts);
            path.fronts = way;
        }
        for f in &path.fronts {
            for v in &self.tree.fronts[*f as usize].blocks {
                path.first[*v as usize] = path.scalars as u32;
                path.scalars += self.dim(*v);
            }
        }
        path
    }

    /// L⁻¹e along the path, e for one direction of a variable.
    fn column(&self, path: &Path, variable: u32, direction: usize) -> Vec<f64> {
        let mut x = vec![0.0; path.scalars];
        x[path.first[variable as usize] as usize + direction] = 1.0;
        let mut f = self.tree.front_of(variable);
        let mut below = vec![];
        while f != NONE {
            let front = &self.tree.fronts[f as usize];
            let first = path.first[front.blocks[0] as usize] as usize;
            below.clear();
            below.resize(front.below, 0.0);
            self.fronts.forward(front, f, &mut x[first..first + front.width], &mut below);
            let mut rest = &below[..];
            for row in &front.rows {
                let (of_row, after) = rest.split_at(self.dim(*row));
                rest = after;
                let at = path.first[*row as usize] as usize;
                x[at..at + of_row.len()].iter_mut().zip(of_row).for_each(|(x, b)| *x += b);
            }
            f = front.parent;
        }
        x
    }
}

/// Fronts on paths to the root, children before parents.
#[derive(Default)]
struct Path {
    fronts: Vec<u32>,
    /// By variable, its first scalar among those of the path.
    first: Vec<u32>,
    scalars: usize,
}
