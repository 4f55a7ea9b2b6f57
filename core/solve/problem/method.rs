//! Construction of the linear solver of a problem from its settings.
use crate::linear::layout::Layout;
use crate::linear::ordering::Order;
use crate::linear::settings::{self as chosen, LinearSolver, Ordering, Preconditioner};
use crate::linear::{Cholesky, ConjugateGradients, Method, Qr, memory};
use crate::problem::CompileError;
use crate::problem::model::ProblemVariable;
use manifactor_graph::{Key, Values};
use std::collections::HashMap;

/// Systems with at most this number of unknowns are factorized as one dense matrix.
const MAX_DENSE_UNKNOWNS: usize = 24;

/// The blocks of a linear system, with their variables.
pub(crate) struct Blocks<'a> {
    keys: Vec<&'a Key>,
    /// Index of each block's type.
    kinds: Vec<usize>,
    /// Names of the types.
    names: Vec<&'static str>,
}

impl<'a> Blocks<'a> {
    pub(crate) fn new(places: &[&'a ProblemVariable], values: &Values) -> Self {
        let most = places.iter().map(|p| p.column + 1).max().unwrap_or(0);
        let mut names = vec![""; most];
        for place in places {
            if names[place.column].is_empty() {
                names[place.column] = values.variable(place.key.as_str()).map_or("", |v| v.typetag_name());
            }
        }
        let kinds = places.iter().map(|p| p.column).collect();
        Self { keys: places.iter().map(|p| &p.key).collect(), kinds, names }
    }

    /// Marks the blocks of these types.
    fn of_types(&self, types: &[String]) -> Result<Vec<bool>, CompileError> {
        let known = |name: &String| self.names.iter().any(|n| n == name);
        if let Some(name) = types.iter().find(|name| !known(name)) {
            let names: Vec<_> = self.names.iter().filter(|n| !n.is_empty()).copied().collect();
            return Err(CompileError::LinearSolver(format!(
                "ordering: no variable to solve for is of type `{name}`; there are {}",
                names.join(", ")
            )));
        }
        Ok(self.kinds.iter().map(|kind| types.iter().any(|t| t == self.names[*kind])).collect())
    }

    fn listed(&self, keys: &[Key]) -> Result<Vec<usize>, CompileError> {
        // the block of each key, until it is listed
        let mut blocks: HashMap<&Key, Option<usize>> =
            self.keys.iter().enumerate().map(|(block, key)| (*key, Some(block))).collect();
        let place = |key: &Key| {
            let error = |what: &str| CompileError::LinearSolver(format!("ordering: `{key}` {what}"));
            let block = blocks.get_mut(key).ok_or_else(|| error("is no variable to solve for"))?;
            block.take().ok_or_else(|| error("is listed twice"))
        };
        keys.iter().map(place).collect()
    }
}

/// Returns the ordering method for the blocks.
pub(crate) fn order(linear: &LinearSolver, blocks: &Blocks<'_>) -> Result<Order, CompileError> {
    Ok(match &linear.ordering {
        // an iterative method has no fill, and a dense factor has all of it
        _ if matches!(linear.method, chosen::Method::ConjugateGradients | chosen::Method::Dense) => {
            Order::Natural
        }
        Ordering::Auto => Order::Best,
        Ordering::Natural => Order::Natural,
        Ordering::Amd => Order::MinimumDegree,
        Ordering::Colamd => Order::ColumnDegree,
        Ordering::NestedDissection => Order::NestedDissection,
        Ordering::First(types) => Order::First(blocks.of_types(types)?),
        Ordering::Given(keys) => Order::Given(blocks.listed(keys)?),
    })
}

/// Returns the method, and allocates its memory.
pub(crate) fn method(
    linear: &LinearSolver,
    blocks: &Blocks<'_>,
    layout: &Layout,
) -> Result<Method, CompileError> {
    let dense = match linear.method {
        chosen::Method::Qr => return Ok(Method::Qr(Qr::default())),
        chosen::Method::ConjugateGradients => return iterative(linear, blocks, layout),
        chosen::Method::Dense => true,
        chosen::Method::Auto => layout.dim() <= MAX_DENSE_UNKNOWNS,
        chosen::Method::Cholesky => false,
    };
    let structure = layout.structure(dense);
    let needed = structure.bytes();
    let available = available(linear, needed, layout.row_idx.len());
    if needed > available && linear.method == chosen::Method::Auto {
        return iterative(linear, blocks, layout);
    }
    let error = CompileError::OutOfMemory { unknowns: layout.dim(), needed: Some(needed), available };
    if needed > available {
        return Err(error);
    }
    Cholesky::new(structure).map(Method::Cholesky).ok_or(error)
}

/// Returns the bytes available for a factor. For a small factor, the query of the available memory would
/// take longer than the allocation.
fn available(linear: &LinearSolver, needed: u64, entries: usize) -> u64 {
    const SMALL_FACTOR_BYTES: u64 = 256 << 20;
    match linear.memory_gib {
        Some(gib) => (*gib * f64::from(1 << 30)) as u64,
        None if needed <= SMALL_FACTOR_BYTES => SMALL_FACTOR_BYTES.min(memory::beside(entries)),
        None => memory::for_factor(entries),
    }
}

fn iterative(linear: &LinearSolver, blocks: &Blocks<'_>, layout: &Layout) -> Result<Method, CompileError> {
    let settings = linear.conjugate_gradients.clone();
    let eliminated = match (&linear.ordering, settings.preconditioner) {
        (_, Preconditioner::BlockJacobi) => vec![false; blocks.kinds.len()],
        (Ordering::First(types), _) => {
            let marked = blocks.of_types(types)?;
            if let Some((a, b)) = coupled(layout, &marked) {
                let key = |rank: usize| layout.rank.iter().position(|r| *r as usize == rank);
                let name = |rank| key(rank).map_or("", |block| blocks.keys[block].as_str());
                return Err(CompileError::LinearSolver(format!(
                    "ordering: `{}` and `{}` are coupled, so that their types cannot be eliminated block by block; \
                     name types whose variables share no factor",
                    name(a),
                    name(b)
                )));
            }
            marked
        }
        _ => largest_uncoupled(blocks, layout),
    };
    let mut by_rank = vec![false; eliminated.len()];
    layout.rank.iter().zip(eliminated).for_each(|(rank, mark)| by_rank[*rank as usize] = mark);
    Ok(Method::ConjugateGradients(ConjugateGradients::new(layout, by_rank, settings)))
}

/// Returns two marked blocks that are coupled, by their positions in the elimination order.
fn coupled(layout: &Layout, marked: &[bool]) -> Option<(usize, usize)> {
    let mut by_rank = vec![false; marked.len()];
    layout.rank.iter().zip(marked).for_each(|(rank, mark)| by_rank[*rank as usize] = *mark);
    let mut found = None;
    layout.couplings(|row, column, _| {
        if by_rank[row] && by_rank[column] {
            found = Some((row, column));
        }
    });
    found
}

/// Marks the blocks of one type: among the types without couplings between their own blocks, the one that
/// leaves the smallest system.
fn largest_uncoupled(blocks: &Blocks<'_>, layout: &Layout) -> Vec<bool> {
    let first = layout.first_scalars();
    let unknowns = |marked: &[bool]| -> usize {
        let marked = layout.rank.iter().zip(marked).filter(|(_, mark)| **mark);
        marked.map(|(rank, _)| first[*rank as usize + 1] - first[*rank as usize]).sum()
    };
    let of_kind = |kind: usize| -> Vec<bool> { blocks.kinds.iter().map(|k| *k == kind).collect() };
    let several = blocks.names.iter().filter(|n| !n.is_empty()).count() > 1;
    let kinds = (0..blocks.names.len()).filter(|_| several).map(of_kind);
    let uncoupled = kinds.filter(|marked| coupled(layout, marked).is_none());
    uncoupled.max_by_key(|marked| unknowns(marked)).unwrap_or_else(|| vec![false; blocks.kinds.len()])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_list_of_keys_is_looked_up_key_by_key() {
        let keys: Vec<Key> = (0..100_000).map(|i| Key::indexed("x", i)).collect();
        let blocks = Blocks { keys: keys.iter().collect(), kinds: vec![], names: vec![] };
        let backwards: Vec<Key> = keys.iter().rev().cloned().collect();
        let expected: Vec<usize> = (0..keys.len()).rev().collect();
        assert_eq!(blocks.listed(&backwards).unwrap(), expected);
        for (wrong, what) in [("y", "is no variable to solve for"), ("x7", "is listed twice")] {
            let mut listed = backwards.clone();
            listed.push(wrong.into());
            let error = blocks.listed(&listed).unwrap_err().to_string();
            assert!(error.contains(wrong) && error.contains(what), "{error}");
        }
    }
}
