//! Compilation of a graph from its dynamic view to the columnar one.
use crate::linear::layout::Layout;
use crate::linear::memory::{self, Bytes};
use crate::linear::settings::LinearSolver;
use crate::linear::system::LinearSystem;
use crate::outcome::Times;
use crate::problem::Problem;
use crate::problem::bounds::BoundedUnknowns;
use crate::problem::constraints::Constraints;
use crate::problem::method::{self, Blocks};
use crate::problem::model::{Model, ProblemFactor, ProblemVariable};
use manifactor_graph::batch::{Batch, Batches, Member};
use manifactor_graph::column::{Columns, FIXED};
use manifactor_graph::{Graph, GraphError, Key, Resolved, Values};
use std::time::Instant;

/// The error of a compilation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompileError {
    /// Factors, values and fixed variables do not fit each other. Lists all errors.
    #[error("the graph does not fit its values:{}", GraphError::list(.0))]
    Graph(Vec<GraphError>),
    /// There is no free variable.
    #[error("there is no variable to solve for: {0}")]
    Empty(&'static str),
    /// The linear solver does not fit the graph.
    #[error("the linear solver does not fit the graph: {0}")]
    LinearSolver(String),
    /// A solver names a factor that does not exist.
    #[error("there is no factor {factor}: the graph has {factors}, from 0")]
    NoFactor {
        /// The requested factor.
        factor: usize,
        /// Number of factors.
        factors: usize,
    },
    /// The graph does not fit into memory.
    #[error("no memory for a graph of {factors} factors: it takes at least {}, and there are {}; allow more, or take fewer threads", Bytes(*.needed), Bytes(*.available))]
    TooLarge {
        /// Number of factors.
        factors: usize,
        /// Memory of the compiled graph in bytes, without a factorization.
        needed: u64,
        /// Available bytes.
        available: u64,
    },
    /// The linear system does not fit into memory.
    #[error("no memory for a linear system of {unknowns} unknowns{}", shortage(*.needed, *.available))]
    OutOfMemory {
        /// Number of scalar unknowns.
        unknowns: usize,
        /// Memory of its factor in bytes, if known.
        needed: Option<u64>,
        /// Bytes available for the factor.
        available: u64,
    },
}

fn shortage(needed: Option<u64>, available: u64) -> String {
    needed.map_or(String::new(), |needed| {
        let (needed, available) = (Bytes(needed), Bytes(available));
        format!(
            ": its factor takes {needed}, and there are {available}; \
             take another ordering, or linear = {{ method = \"conjugate_gradients\" }}, or allow more by memory_gib"
        )
    })
}

pub(crate) fn compile(
    graph: &Graph,
    values: &Values,
    linear: &LinearSolver,
) -> Result<Problem, CompileError> {
    let clock = Instant::now();
    check_memory(graph, values)?;
    let resolved = graph.resolve(values).map_err(CompileError::Graph)?;
    let (mut variables, columns) = columns(graph, values);

    // the free variables are the blocks of the linear system
    let is_free = |place: &ProblemVariable| place.held.count_ones() < place.tangent.len() as u32;
    let free: Vec<usize> = (0..variables.len()).filter(|i| is_free(&variables[*i])).collect();
    if free.is_empty() {
        let why = if variables.is_empty() { "there are no values" } else { "all are held fixed" };
        return Err(CompileError::Empty(why));
    }
    let mut block = vec![None; variables.len()];
    free.iter().enumerate().for_each(|(b, v)| block[*v] = Some(b));
    let dims: Vec<usize> = free.iter().map(|v| variables[*v].tangent.len()).collect();
    let unknowns = dims.iter().sum();
    let count = |factor: &Resolved| factor.variables.len() * factor.variables.len().saturating_sub(1) / 2;
    let mut pairs = Vec::with_capacity(resolved.iter().map(count).sum());
    let mut blocks: Vec<u32> = vec![];
    for factor in &resolved {
        blocks.clear();
        blocks.extend(factor.variables.iter().filter_map(|i| block[*i as usize].map(|b| b as u32)));
        for (n, &a) in blocks.iter().enumerate() {
            pairs.extend(blocks[..n].iter().map(|&b| (a, b)));
        }
    }
    let of_block: Vec<&ProblemVariable> = free.iter().map(|v| &variables[*v]).collect();
    let blocks = Blocks::new(&of_block, values);
    let order = method::order(linear, &blocks)?;
    let out_of_memory = CompileError::OutOfMemory { unknowns, needed: None, available: 0 };
    let layout = Layout::new(&dims, pairs, &order).ok_or(out_of_memory)?;
    let method = method::method(linear, &blocks, &layout)?;
    for (variable, block) in variables.iter_mut().zip(&block) {
        variable.start = block.map(|b| layout.start[b] as usize);
    }
    let mut starts: Vec<Vec<u32>> = vec![vec![]; columns.len()];
    let mut held = vec![];
    for place in &variables {
        starts[place.column].push(place.start.map_or(FIXED, |s| s as u32));
        if let Some(start) = place.start {
            held.extend((0..place.tangent.len()).filter(|d| place.held >> d & 1 == 1).map(|d| start + d));
        }
    }
    let (batches, factors) = batches(graph, resolved, &variables, &block, &layout);
    let times = Times { compile: clock.elapsed().as_secs_f64(), ..Times::default() };
    let (count, entries) = (factors.len(), layout.row_idx.len());
    tracing::debug!(
        variables = variables.len(),
        factors = count,
        unknowns,
        entries,
        seconds = times.compile,
        "compiled"
    );
    let model = Model::new(variables, factors, columns, starts, batches);
    let system = LinearSystem::new(layout, held, method, linear.refinements);
    let mut problem = Problem::new(model, system, graph.version(), times);
    problem.bounds = BoundedUnknowns::new(graph, values, &problem.model);
    let constraints = problem.model.factors.iter().enumerate().filter(|(_, factor)| factor.is_constraint);
    problem.constraints = Constraints::of(constraints.map(|(i, factor)| (i, factor.all_rows as usize)));
    Ok(problem)
}

/// Rejects a graph that does not fit into memory, before allocating any of it.
fn check_memory(graph: &Graph, values: &Values) -> Result<(), CompileError> {
    // below this number, the query of the available memory takes longer than the allocation
    const UNCHECKED_FACTORS: usize = 100_000;
    let factors = graph.factors().len();
    if factors < UNCHECKED_FACTORS && memory::memory_limit().is_none() {
        return Ok(());
    }
    let (needed, available) = (memory::of_graph(graph, values), memory::available_memory());
    match needed > available {
        true => Err(CompileError::TooLarge { factors, needed, available }),
        false => Ok(()),
    }
}

/// Sorts values into columns, by type.
fn columns(graph: &Graph, values: &Values) -> (Vec<ProblemVariable>, Columns) {
    let mut columns = Columns::default();
    let mut sizes: Vec<usize> = vec![];
    let place = |(key, value): (&Key, &dyn manifactor_graph::Variable)| {
        let erased = value.erased();
        let id = erased.type_id();
        let column = columns.position(id).unwrap_or_else(|| {
            sizes.push(0);
            columns.add(id, erased.new_column())
        });
        columns.column_mut(column).push(value);
        sizes[column] += 1;
        let tangent = erased.tangent();
        let held = graph.fixed().get(key).map_or(0, |f| f.bits(tangent));
        ProblemVariable { key: key.clone(), column, index: sizes[column] - 1, tangent, start: None, held }
    };
    let variables = values.iter().map(place).collect();
    (variables, columns)
}

/// Sorts factors into batches, by residual type, kind of noise and type of loss. Also returns the position
/// of each factor.
fn batches(
    graph: &Graph,
    resolved: Vec<Resolved>,
    variables: &[ProblemVariable],
    block: &[Option<usize>],
    layout: &Layout,
) -> (Vec<Box<dyn Batch>>, Vec<ProblemFactor>) {
    let mut batches = Batches::default();
    // the batch of each factor, and for each batch the number of factors and of their variables, so that
    // memory is reserved only once
    let mut places = Vec::with_capacity(resolved.len());
    let mut sizes: Vec<(usize, usize)> = vec![];
    for (factor, Resolved { variables, whitener }) in graph.factors().iter().zip(&resolved) {
        let batch = batches.place(factor.factor.erased(), whitener, factor.loss.as_deref());
        sizes.resize(sizes.len().max(batch + 1), (0, 0));
        places.push((batch as u32, sizes[batch].0 as u32));
        sizes[batch].0 += 1;
        sizes[batch].1 += variables.len();
    }
    let mut batches = batches.into_vec();
    for (batch, (factors, variables)) in batches.iter_mut().zip(sizes) {
        batch.reserve(factors, variables);
    }
    let mut factors = Vec::with_capacity(resolved.len());
    let (mut index, mut starts, mut held, mut slots) = (vec![], vec![], vec![], vec![]);
    for (entry, (factor, Resolved { variables: ids, whitener })) in
        graph.factors().iter().zip(resolved).enumerate()
    {
        index.clear();
        starts.clear();
        held.clear();
        slots.clear();
        for (n, a) in ids.iter().map(|a| *a as usize).enumerate() {
            index.push(variables[a].index as u32);
            starts.push(variables[a].start.map_or(FIXED, |s| s as u32));
            held.push(if variables[a].start.is_some() { variables[a].held } else { 0 });
            for &b in &ids[..=n] {
                let both = block[a].zip(block[b as usize]);
                slots.push(both.and_then(|(a, b)| layout.slot(a, b)).unwrap_or_default());
            }
        }
        let (batch, at) = places[entry];
        batches[batch as usize].push(&Member {
            entry,
            factor: factor.factor.erased().as_any(),
            index: &index,
            starts: &starts,
            fixed: &held,
            slots: &slots,
            whitener: &whitener,
            loss: factor.loss.as_deref(),
        });
        let (name, all_rows) =
            (factor.factor.typetag_name(), factor.factor.erased().signature().rows.unwrap_or(0) as u32);
        let own_name = factor.name.clone();
        let is_constraint = factor.is_constraint();
        let mut place = ProblemFactor {
            variables: ids,
            name,
            own_name,
            all_rows,
            rows: all_rows,
            is_constraint,
            batch,
            index: at,
        };
        place.observe(&factor.noise);
        factors.push(place);
    }
    (batches, factors)
}
