//! Computation of a front: factor terms, updates of its children, and elimination of its columns.
use super::assembly::{FrontAssembly, Run, assemble};
use super::{Fronts, Numbers, Scalar};
use crate::elimination_tree::{Front, Tree};
use crate::model::{Blocks, Overflow};
use manifactor_solve::front::eliminate;
use pulp::{Simd, WithSimd};

/// Rounding error of a diagonal entry of H, as a share of it. If a pivot is smaller than its rounding error, no
/// factor constrains the direction. It is held at its linearization point. Batch solvers do not move such a
/// direction either, because it has no gradient.
const ROUNDING_SHARE: f64 = 1e-14;
/// A pivot above this share of the diagonal entry of H is not rounding error.
const CLEAR_PIVOT_SHARE: f64 = 1e-9;

/// Assembly and elimination of new fronts.
pub(super) struct Build<'a> {
    pub(super) fronts: &'a mut Fronts,
    pub(super) tree: &'a Tree,
    pub(super) blocks: &'a Blocks,
    /// Front numbers, children before parents.
    pub(super) new: &'a [u32],
}

impl WithSimd for Build<'_> {
    type Output = Result<(), Overflow>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        // a loop, because a closure would be compiled for the baseline instruction set
        for f in self.new {
            build(simd, self.fronts, self.tree, self.blocks, *f)?;
        }
        Ok(())
    }
}

/// Assembles and factorizes one front. Each unconstrained direction that it finds is held, and the front is
/// built again.
#[inline(always)]
fn build<S: Simd>(
    simd: S,
    fronts: &mut Fronts,
    tree: &Tree,
    blocks: &Blocks,
    f: u32,
) -> Result<(), Overflow> {
    let front = &tree.fronts[f as usize];
    let height = front.width + front.below + 1;
    let (entries, below) = (front.width * height, front.below + 1);
    let (mut panel, mut update) = (fronts.pool.acquire(entries), fronts.pool.acquire(below * below));
    let mut held: Vec<usize> = vec![];
    let built = loop {
        let (panel, update) = (&mut panel[..entries], &mut update[..below * below]);
        fill(fronts, blocks, front, panel);
        for c in &held {
            let precision = precision_of(blocks, front, *c);
            panel[c * (height + 1)] += if precision > 0.0 { precision * precision } else { 1.0 };
        }
        let mut open = FrontAssembly { panel, update, width: front.width, height };
        add_children::<true>(fronts, tree, blocks, front, &mut open);
        let eliminated =
            eliminate::<S, true>(simd, open.panel, open.update, front.width, &mut fronts.scratch);
        let failed = eliminated.err().or_else(|| first_unconstrained(blocks, front, open.panel, &held));
        match failed {
            None => {
                let is_finite = (0..front.width).all(|c| open.panel[(c + 1) * height - 1].is_finite());
                add_children::<false>(fronts, tree, blocks, front, &mut open);
                break if is_finite { Ok(()) } else { Err(front.width - 1) };
            }
            Some(column) if held.contains(&column) => break Err(column),
            Some(column) => held.push(column),
        }
    };
    // a failed front still owns its memory, so that dropping it returns the memory to the pool
    held.sort_unstable();
    let undetermined = held.iter().map(|c| scalar_of(blocks, front, *c)).collect();
    fronts.numbers[f as usize] = Numbers { panel, update, undetermined };
    built.map_err(|column| Overflow(scalar_of(blocks, front, column).0))
}

/// Returns the variable and the tangent direction of a column.
fn scalar_of(blocks: &Blocks, front: &Front, column: usize) -> Scalar {
    let mut first = 0;
    for v in &front.blocks {
        let dim = blocks.dim(*v);
        if column < first + dim {
            return (*v, (column - first) as u32);
        }
        first += dim;
    }
    (0, 0)
}

fn precision_of(blocks: &Blocks, front: &Front, column: usize) -> f64 {
    let (variable, direction) = scalar_of(blocks, front, column);
    blocks.precision(variable)[direction as usize]
}

/// Returns the first column of a factorized panel whose pivot is only rounding error.
#[inline(always)]
fn first_unconstrained(blocks: &Blocks, front: &Front, panel: &[f64], held: &[usize]) -> Option<usize> {
    let height = front.width + front.below + 1;
    let mut column = 0;
    for v in &front.blocks {
        for precision in blocks.precision(*v) {
            let (pivot, entry) = (panel[column * (height + 1)], precision * precision);
            if pivot * pivot < CLEAR_PIVOT_SHARE * entry
                && !held.contains(&column)
                && pivot * pivot < rounding_error(blocks, front, panel, column)
            {
                return Some(column);
            }
            column += 1;
        }
    }
    None
}

/// Returns the rounding error of the square of a pivot: that of its diagonal entry, and those of the earlier
/// pivots of the front, which grow by ℓ²ᵢⱼ/ℓ²ⱼⱼ as column j is subtracted.
#[cold]
fn rounding_error(blocks: &Blocks, front: &Front, panel: &[f64], column: usize) -> f64 {
    let height = front.width + front.below + 1;
    let entries =
        front.blocks.iter().flat_map(|v| blocks.precision(*v)).map(|precision| precision * precision);
    let mut errors: Vec<f64> = vec![];
    for (i, entry) in entries.take(column + 1).enumerate() {
        let growth = |j: usize| panel[j * height + i] / panel[j * (height + 1)];
        let earlier: f64 = errors.iter().enumerate().map(|(j, error)| growth(j).powi(2) * error).sum();
        errors.push(ROUNDING_SHARE * entry + earlier);
    }
    errors.last().copied().unwrap_or(0.0)
}

/// Fills a panel with the terms of the factors, and stores the first row of each variable.
#[inline(always)]
fn fill(fronts: &mut Fronts, blocks: &Blocks, front: &Front, panel: &mut [f64]) {
    let height = front.width + front.below + 1;
    fronts.stamp += 1;
    let stamp = fronts.stamp;
    let mut row = 0;
    for v in front.blocks.iter().chain(&front.rows) {
        fronts.place[*v as usize] = (stamp, row as u32);
        row += blocks.dim(*v);
    }
    panel.fill(0.0);
    let mut first = 0;
    for v in &front.blocks {
        let dim = blocks.dim(*v);
        let columns = &mut panel[first * height..(first + dim) * height];
        let (own, gradient) = (blocks.diagonal(*v), blocks.gradient(*v));
        for (c, column) in columns.chunks_exact_mut(height).enumerate() {
            column[first + c..first + dim].copy_from_slice(&own[c * dim + c..(c + 1) * dim]);
            column[height - 1] = -gradient[c];
        }
        for coupling in blocks.coupled(*v) {
            let (found, at) = fronts.place[coupling.other as usize];
            let at = at as usize;
            if found != stamp || at <= first {
                continue;
            }
            let (block, rows) = (blocks.block(coupling.pair), blocks.dim(coupling.other));
            for (c, column) in columns.chunks_exact_mut(height).enumerate() {
                let to = &mut column[at..at + rows];
                if *v < coupling.other {
                    to.copy_from_slice(&block[c * rows..(c + 1) * rows]);
                } else {
                    to.iter_mut().zip(block[c..].iter().step_by(dim)).for_each(|(to, x)| *to = *x);
                }
            }
        }
        first += dim;
    }
}

/// Adds the updates of a front's children: to its panel before elimination, or to its update afterwards. The
/// update therefore needs no fill with zeros.
#[inline(always)]
fn add_children<const PANEL: bool>(
    fronts: &mut Fronts,
    tree: &Tree,
    blocks: &Blocks,
    front: &Front,
    open: &mut FrontAssembly<'_>,
) {
    for c in &front.children {
        let child = &tree.fronts[*c as usize];
        fronts.runs.clear();
        let mut row = 0;
        for v in &child.rows {
            add_run(&mut fronts.runs, row, fronts.place[*v as usize].1 as usize, blocks.dim(*v));
            row += blocks.dim(*v);
        }
        add_run(&mut fronts.runs, row, open.height - 1, 1);
        let n = child.below + 1;
        assemble::<PANEL>(&fronts.numbers[*c as usize].update[..n * n], n, &fronts.runs, open);
    }
}

/// Appends rows to the last run if they continue it; starts a new run otherwise.
#[inline(always)]
fn add_run(runs: &mut Vec<Run>, row: usize, place: usize, rows: usize) {
    match runs.last_mut() {
        Some(run) if run.place + (run.end - run.start) == place => run.end += rows,
        _ => runs.push(Run { start: row, end: row + rows, place }),
    }
}
