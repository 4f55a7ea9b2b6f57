//! factrs on a pose graph. Methods: gn, lm.
use factrs::assign_symbols;
use factrs::core::{GaussNewton, LevenMarquardt, SE2, SE3, Values};
use factrs::optimizers::{BaseOptParams, LevenParams, OptError, OptObserver};
use factrs::traits::Optimizer;
use factrs::utils::load_g20;
use peers::{PoseGraph, Task, report, timed, write};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

assign_symbols!(X: SE2, SE3);

struct Count(Arc<AtomicUsize>);

impl OptObserver for Count {
    fn on_step(&self, _: &Values, _: i64) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

fn pose(values: &Values, id: u64) -> Option<Vec<f64>> {
    let key = X(u32::try_from(id).ok()?);
    if let Some(x) = values.get_unchecked::<_, SE2>(key) {
        return Some(vec![x.x(), x.y(), x.theta()]);
    }
    let x: &SE3 = values.get_unchecked(X(u32::try_from(id).ok()?))?;
    let (t, q) = (x.xyz(), x.rot());
    Some(vec![t[0], t[1], t[2], q.x(), q.y(), q.z(), q.w()])
}

fn main() {
    let task = Task::from_arguments();
    let ids = PoseGraph::read(&task.input).vertices.into_iter().map(|(id, _)| id);
    // its reader puts a prior on the first pose
    let (graph, start) = load_g20(&task.input);
    let base = BaseOptParams {
        max_iterations: task.max_iterations,
        error_tol_relative: task.relative_cost,
        error_tol_absolute: 0.0,
        ..BaseOptParams::default()
    };
    let steps = Arc::new(AtomicUsize::new(0));
    let (result, seconds) = timed(|| {
        let mut solver: Box<dyn ErasedOptimizer> = match task.method.as_str() {
            "gn" => Box::new(GaussNewton::new(base, graph)),
            _ => Box::new(LevenMarquardt::new(LevenParams { base, ..LevenParams::default() }, graph)),
        };
        solver.run(start, Count(steps.clone()))
    });
    let (values, status) = match result {
        Ok(values) => (values, "returned"),
        Err(OptError::MaxIterations(values)) => (values, "max iterations"),
        Err(error) => panic!("{error:?}"),
    };
    write(&task.output, ids.filter_map(|id| Some((id, pose(&values, id)?))));
    report(seconds, steps.load(Ordering::Relaxed), status);
}

/// Both optimizers as one type.
trait ErasedOptimizer {
    fn run(&mut self, start: Values, count: Count) -> Result<Values, OptError>;
}

impl<O: Optimizer> ErasedOptimizer for O {
    fn run(&mut self, start: Values, count: Count) -> Result<Values, OptError> {
        self.observers_mut().add(count);
        self.optimize(start)
    }
}
