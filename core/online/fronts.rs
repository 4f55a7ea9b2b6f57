//! The numbers of fronts: panels of the factor, and the updates that fronts hand up, which are kept.
//!
//! The right-hand side −g is the last row of each front: elimination solves for it on the way, and a front that is kept has
//! its part of it at hand.
mod assembly;
mod pool;
mod substitution;

use crate::model::Blocks;
use crate::tree::{Affected, Front, Tree};
use assembly::{Open, Run, assemble};
use manifactor_solve::front::{Scratch, eliminate};
use pool::Pool;
use pulp::{Arch, Simd, WithSimd};
use substitution::Backward;

/// A scalar unknown: a variable, and a direction of its tangent space.
pub(crate) type Scalar = (u32, u32);

/// What a front has computed.
#[derive(Debug, Default)]
struct Numbers {
    /// Column-major, `width` columns of `width + below + 1` rows.
    panel: Vec<f64>,
    /// The lower triangle of a square of `below + 1` columns.
    update: Vec<f64>,
    /// Directions that nothing constrains, as far as f64 can tell, once what is eliminated before is gone.
    open: Vec<Scalar>,
}

/// The numbers of all fronts of a tree.
#[derive(Debug)]
pub(crate) struct Fronts {
    numbers: Vec<Numbers>,
    pool: Pool,
    /// By variable, its first row in the front that has this stamp.
    place: Vec<(u64, u32)>,
    stamp: u64,
    runs: Vec<Run>,
    x: Vec<f64>,
    scratch: Scratch,
    arch: Arch,
}

/// A sum that is not finite, though its terms are: at this variable.
#[derive(Debug)]
pub(crate) struct Overflow(pub u32);

/// A pivot below this share of a diagonal entry of H is rounding: nothing constrains the direction. It is held at its
/// linearization point, as a direction without a gradient is left alone by a batch solver.
const OPEN: f64 = 1e-14;
/// Widest front that needs less room of the dense kernels than any wider one.
const WIDEST: usize = 1 << 10;

impl Default for Fronts {
    fn default() -> Self {
        Self {
            numbers: vec![],
            pool: Pool::default(),
            place: vec![],
            stamp: 0,
            runs: vec![],
            x: vec![],
            scratch: Scratch::new(WIDEST),
            arch: Arch::new(),
        }
    }
}

impl Fronts {
    /// Makes room for so many variables.
    pub(crate) fn resize(&mut self, variables: usize) {
        self.place.resize(variables, (0, 0));
    }

    /// Assembles and factorizes new fronts, children before parents.
    ///
    /// # Errors
    /// Where a sum is not finite. The fronts are dropped then.
    pub(crate) fn build(&mut self, tree: &Tree, blocks: &Blocks, new: &[u32]) -> Result<(), Overflow> {
        self.numbers.resize_with(tree.fronts.len(), Numbers::default);
        let arch = self.arch;
        let built = arch.dispatch(Build { fronts: self, tree, blocks, new });
        if built.is_err() {
            self.release(new);
        }
        built
    }

    /// Gives back the memory of fronts that are gone.
    pub(crate) fn drop_all(&mut self, affected: &Affected) {
        self.release(&affected.0);
    }

    fn release(&mut self, fronts: &[u32]) {
        for f in fronts {
            let Numbers { panel, update, .. } = std::mem::take(&mut self.numbers[*f as usize]);
            self.pool.give(panel);
            self.pool.give(update);
        }
    }

    /// Directions of a front's variables that nothing constrains.
    pub(crate) fn open(&self, front: u32) -> &[Scalar] {
        &self.numbers[front as usize].open
    }

    /// The steps of a front's variables, one after the other, from those of its rows: `delta` by scalar of all variables.
    pub(crate) fn solve(&mut self, front: &Front, number: u32, blocks: &Blocks, delta: &[f64]) -> &[f64] {
        self.x.resize(front.width, 0.0);
        for row in &front.rows {
            self.x.extend_from_slice(&delta[blocks.range(*row)]);
        }
        let panel = &self.numbers[number as usize].panel[..front.width * (front.width + front.below + 1)];
        self.arch.dispatch(Backward { panel, width: front.width, x: &mut self.x });
        self.x.truncate(front.width);
        &self.x
    }

    /// x ← L⁻¹ x of one front: see [`substitution::forward`].
    pub(crate) fn forward(&self, front: &Front, number: u32, x: &mut [f64], below: &mut [f64]) {
        let panel = &self.numbers[number as usize].panel[..front.width * (front.width + front.below + 1)];
        substitution::forward(panel, x, below);
    }

    /// Bytes of all fronts, and of memory that waits for others.
    pub(crate) fn bytes(&self) -> usize {
        self.pool.bytes()
    }
}

struct Build<'a> {
    fronts: &'a mut Fronts,
    tree: &'a Tree,
    blocks: &'a Blocks,
    new: &'a [u32],
}

impl WithSimd for Build<'_> {
    type Output = Result<(), Overflow>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        // a loop: a closure would be compiled for the least processor
        for f in self.new {
            build(simd, self.fronts, self.tree, self.blocks, *f)?;
        }
        Ok(())
    }
}

/// Assembles and factorizes one front. Where a direction turns out to be open, once more, with that direction held.
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
    let (mut panel, mut update) = (fronts.pool.take(entries), fronts.pool.take(below * below));
    let mut held: Vec<usize> = vec![];
    let built = loop {
        let (panel, update) = (&mut panel[..entries], &mut update[..below * below]);
        fill(fronts, blocks, front, panel);
        for c in &held {
            let precision = precision_of(blocks, front, *c);
            panel[c * (height + 1)] += if precision > 0.0 { precision * precision } else { 1.0 };
        }
        let mut open = Open { panel, update, width: front.width, height };
        take_children::<true>(fronts, tree, blocks, front, &mut open);
        let eliminated =
            eliminate::<S, true>(simd, open.panel, open.update, front.width, &mut fronts.scratch);
        let failed = eliminated.err().or_else(|| first_open(blocks, front, open.panel, &held));
        match failed {
            None => {
                let is_finite = (0..front.width).all(|c| open.panel[(c + 1) * height - 1].is_finite());
                take_children::<false>(fronts, tree, blocks, front, &mut open);
                break if is_finite { Ok(()) } else { Err(front.width - 1) };
            }
            Some(column) if held.contains(&column) => break Err(column),
            Some(column) => held.push(column),
        }
    };
    // even a front that failed owns its memory, so that dropping it gives that back
    held.sort_unstable();
    let open = held.iter().map(|c| scalar_of(blocks, front, *c)).collect();
    fronts.numbers[f as usize] = Numbers { panel, update, open };
    built.map_err(|column| Overflow(scalar_of(blocks, front, column).0))
}

/// The variable and direction of a front's column.
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

/// The first column of a factorized panel whose pivot is rounding.
#[inline(always)]
fn first_open(blocks: &Blocks, front: &Front, panel: &[f64], held: &[usize]) -> Option<usize> {
    let height = front.width + front.below + 1;
    let mut column = 0;
    for v in &front.blocks {
        for precision in blocks.precision(*v) {
            let pivot = panel[column * (height + 1)];
            if pivot * pivot < OPEN * precision * precision && !held.contains(&column) {
                return Some(column);
            }
            column += 1;
        }
    }
    None
}

/// Fills a panel with what factors say, and notes where the front's variables have their rows.
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

/// Adds what a front's children hand up to its panel, before elimination; or to its update, after it, so that the update
/// need not be filled with zeros.
#[inline(always)]
fn take_children<const PANEL: bool>(
    fronts: &mut Fronts,
    tree: &Tree,
    blocks: &Blocks,
    front: &Front,
    open: &mut Open<'_>,
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

/// Appends rows to the last run, where they follow it.
#[inline(always)]
fn add_run(runs: &mut Vec<Run>, row: usize, place: usize, rows: usize) {
    match runs.last_mut() {
        Some(run) if run.place + (run.end - run.start) == place => run.end += rows,
        _ => runs.push(Run { start: row, end: row + rows, place }),
    }
}
