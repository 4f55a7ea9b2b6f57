//! Full solves give bit-identical results on one, two and four threads.
use crate::scene;
use manifactor_graph::{Graph, Values};
use manifactor_solve::{Auto, Dogleg, GaussNewton, Gnc, LevenbergMarquardt, Optimizer, Silent, solve};

/// All results of a solve as text, with enough digits to distinguish any two numbers.
fn everything(graph: &Graph, values: &Values, solver: &dyn Optimizer, threads: usize) -> String {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let solution = pool.install(|| solve(graph, values, solver, &mut Silent)).unwrap();
    let steps =
        solution.outcome.history.iter().map(|r| (r.cost, r.trial_cost, r.step, r.gradient, r.accepted));
    let costs: Vec<f64> = solution.factors.iter().map(|f| f.cost).collect();
    let marginals = pool.install(|| solution.marginals(graph, &[])).unwrap();
    let values: Vec<_> = solution.values.iter().collect();
    format!("{:?} {costs:?} {values:?} {marginals:?}", steps.collect::<Vec<_>>())
}

#[test]
fn no_number_of_threads_changes_a_bit() {
    let solvers: [Box<dyn Optimizer>; 5] = [
        Box::new(GaussNewton::default()),
        Box::new(LevenbergMarquardt::default()),
        Box::new(Dogleg::default()),
        Box::new(Auto::default()),
        Box::new(Gnc::default()),
    ];
    for (graph, values) in [scene::sphere(24, 30), scene::desk(60, 12)] {
        assert!(graph.factors().len() > 600, "enough to be shared among threads");
        for solver in &solvers {
            let one = everything(&graph, &values, &**solver, 1);
            for threads in [2, 4] {
                assert!(
                    everything(&graph, &values, &**solver, threads) == one,
                    "{solver:?}, {threads} threads"
                );
            }
        }
    }
}
