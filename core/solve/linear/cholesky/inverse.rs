//! Selected inversion: the entries of the inverse in the pattern of the factor.
//!
//! The method of Takahashi, Fagan and Chin (1973), by supernodes. From the root down, each front reads the
//! entries of the inverse that it needs from its parent.
use crate::linear::cholesky::Cholesky;
use crate::linear::cholesky::structure::Structure;
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// H⁻¹ in the pattern of H's factor, in panels like the factor's.
pub(crate) struct SelectedInverse<'a> {
    structure: &'a Structure,
    panels: Vec<f64>,
    /// The node of each column.
    node_of: Vec<u32>,
}

impl Cholesky {
    /// Returns the inverse of the last factorized matrix in the pattern of its factor; `None` if there is
    /// no memory.
    pub(crate) fn selected_inverse(&self) -> Option<SelectedInverse<'_>> {
        let structure = &self.structure;
        let mut panels = crate::linear::cholesky::zeros(structure.values)?;
        let mut node_of = vec![];
        for (n, node) in structure.nodes.iter().enumerate() {
            node_of.extend(std::iter::repeat_n(n as u32, node.width));
        }
        // children of each node; and for each pending node, the inverse at its rows below
        let mut children: Vec<Vec<usize>> = vec![];
        let mut open: Vec<usize> = vec![];
        for (n, node) in structure.nodes.iter().enumerate() {
            children.push(open.split_off(open.len() - node.children));
            open.push(n);
        }
        let mut waiting: Vec<Mat<f64>> = open.iter().map(|_| Mat::new()).collect();
        for (n, node) in structure.nodes.iter().enumerate().rev() {
            let range = node.panel..node.panel + node.height() * node.width;
            let l = MatRef::from_column_major_slice(&self.values[range.clone()], node.height(), node.width);
            let below = waiting.pop().unwrap_or_else(Mat::new);
            let to = MatMut::from_column_major_slice_mut(&mut panels[range], node.height(), node.width);
            invert(l, below.as_ref(), to);
            let panel = &panels[node.panel..];
            let at = |i: usize, j: usize| {
                let (i, j) = (i.max(j), i.min(j));
                if j < node.width {
                    panel[j * node.height() + i]
                } else {
                    below[(i - node.width, j - node.width)]
                }
            };
            for child in &children[n] {
                let places = structure.nodes[*child].rows(&structure.places);
                let size = places.len();
                waiting.push(Mat::from_fn(size, size, |i, j| at(places[i] as usize, places[j] as usize)));
            }
        }
        Some(SelectedInverse { structure, panels, node_of })
    }
}

/// Computes a front's columns of the inverse, from its factor and the inverse at its rows below (Σ₂₂): Y =
/// L₂₁L₁₁⁻¹, Σ₂₁ = −Σ₂₂Y, Σ₁₁ = L₁₁⁻ᵀL₁₁⁻¹ − YᵀΣ₂₁.
fn invert(l: MatRef<'_, f64>, below: MatRef<'_, f64>, mut to: MatMut<'_, f64>) {
    let width = l.ncols();
    let (l11, l21) = l.split_at_row(width);
    let mut inverse = Mat::zeros(width, width);
    invert_lower_triangular(inverse.as_mut(), l11, Par::Seq);
    let y = l21 * &inverse;
    let (mut s11, mut s21) = to.as_mut().split_at_row_mut(width);
    matmul(s21.as_mut(), Accum::Replace, below, &y, -1.0, Par::Seq);
    matmul(s11.as_mut(), Accum::Replace, inverse.transpose(), &inverse, 1.0, Par::Seq);
    matmul(s11, Accum::Add, y.transpose(), s21.as_ref(), -1.0, Par::Seq);
}

impl SelectedInverse<'_> {
    /// Returns entry (i, j); `None` if it is not in the pattern.
    pub(crate) fn get(&self, i: usize, j: usize) -> Option<f64> {
        let (i, j) = (i.max(j), i.min(j));
        let node = &self.structure.nodes[*self.node_of.get(j)? as usize];
        let row = match i.checked_sub(node.first + node.width) {
            None => i - node.first,
            Some(_) => node.width + node.rows(&self.structure.rows).binary_search(&(i as u32)).ok()?,
        };
        self.panels.get(node.panel + (j - node.first) * node.height() + row).copied()
    }
}

#[cfg(test)]
mod tests {
    use crate::linear::Cholesky;
    use crate::linear::layout::Layout;
    use crate::linear::ordering::Order;
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    /// Makes a positive definite matrix for a layout, as the values of its lower triangle and as a dense
    /// matrix.
    fn matrix(layout: &Layout, seed: u64) -> (Vec<f64>, DMatrix<f64>) {
        let n = layout.dim();
        let mut state = seed;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1u64 << 31) as f64 - 0.5
        };
        let mut dense = DMatrix::zeros(n, n);
        let mut values = vec![0.0; layout.row_idx.len()];
        for c in 0..n {
            for i in layout.col_ptr[c]..layout.col_ptr[c + 1] {
                let r = layout.row_idx[i] as usize;
                values[i] = if r == c { n as f64 } else { random() };
                (dense[(r, c)], dense[(c, r)]) = (values[i], values[i]);
            }
        }
        (values, dense)
    }

    fn agrees(dims: &[usize], pairs: Vec<(u32, u32)>, seed: u64) {
        let layout = Layout::new(dims, pairs, &Order::Best).unwrap();
        let (values, dense) = matrix(&layout, seed);
        let mut cholesky = Cholesky::new(layout.structure(false)).unwrap();
        let added: Vec<f64> = (0..layout.dim()).map(|i| i as f64).collect();
        for added in [None, Some(&added[..])] {
            let right: Vec<f64> = (0..layout.dim()).map(|i| (i as f64).cos()).collect();
            let mut halfway = right.clone();
            cholesky.factorize(&values, added, &mut halfway).unwrap();
            let shift = DMatrix::from_diagonal(&added.unwrap_or(&vec![0.0; layout.dim()]).to_vec().into());
            let inverse = (&dense + shift).try_inverse().unwrap();
            let expected = &inverse * DMatrix::from_column_slice(right.len(), 1, &right);
            let mut x = right;
            cholesky.solve(&mut x);
            cholesky.solve_upper(&mut halfway);
            assert_eq!(x, halfway, "one way and the other make the same sums");
            assert!(x.iter().zip(expected.iter()).all(|(a, b)| (a - b).abs() < 1e-12));
            let selected = cholesky.selected_inverse().unwrap();
            for c in 0..layout.dim() {
                for i in layout.col_ptr[c]..layout.col_ptr[c + 1] {
                    let entry = selected.get(layout.row_idx[i] as usize, c).unwrap();
                    assert!((entry - inverse[(layout.row_idx[i] as usize, c)]).abs() < 1e-12);
                }
            }
        }
    }

    proptest! {
        #[test]
        fn solutions_and_inverses_are_those_of_the_dense_matrix(
            dims in prop::collection::vec(1..7usize, 1..30),
            raw in prop::collection::vec((0..30u32, 0..30u32), 0..80),
            seed in any::<u64>(),
        ) {
            let n = dims.len() as u32;
            agrees(&dims, raw.into_iter().map(|(a, b)| (a % n, b % n)).collect(), seed);
        }
    }

    #[test]
    fn large_fronts_and_long_chains_agree_with_the_dense_matrix() {
        // all pairs of blocks coupled: a single front, which faer eliminates
        let all: Vec<_> = (0..40).flat_map(|a| (0..a).map(move |b| (a, b))).collect();
        agrees(&[6; 40], all, 1);
        agrees(&[3; 60], (1..60).map(|i| (i - 1, i)).collect(), 2);
        // a grid
        let right = (0..100).filter(|i| i % 10 != 9).map(|i| (i, i + 1));
        agrees(&[3; 100], right.chain((0..90).map(|i| (i, i + 10))).collect(), 3);
    }

    #[test]
    fn fronts_that_take_updates_as_they_come_agree_with_the_dense_matrix() {
        // as in bundle adjustment: a row of cameras, and many points with three neighbouring views each
        let (cameras, points) = (8, 150);
        let dims: Vec<usize> = [vec![5; cameras], vec![2; points]].concat();
        let seen = |p: u32| (0..3).map(move |k| (p % (cameras as u32 - 2) + k, cameras as u32 + p));
        let pairs: Vec<_> = (0..points as u32).flat_map(seen).collect();
        let structure = Layout::new(&dims, pairs.clone(), &Order::Best).unwrap().structure(false);
        let early = |inside: bool| structure.nodes.iter().any(|n| n.early && (n.below > 0) == inside);
        assert!(early(true) && early(false), "{} fronts are early", structure.early.len());
        agrees(&dims, pairs, 4);
    }
}
