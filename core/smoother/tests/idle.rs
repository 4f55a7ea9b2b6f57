//! Updates without changes converge to the nearest minimum.
use crate::toy::{Apart, At, Distance, Plane};
use manifactor_graph::checked::NotNegative;
use manifactor_graph::loss::{Cauchy, Dcs, Fair, GemanMcClure, Huber, L1, Loss, Tukey, Welsch};
use manifactor_graph::{Graph, Key, Noise, Values};
use manifactor_smoother::{Smoother, SmootherSettings};
use manifactor_solve::{LevenbergMarquardt, Silent, Stopping};
use proptest::prelude::*;
use std::num::NonZeroUsize;
use std::sync::Arc;

/// Largest remaining cost above the minimum. Unit: nats.
const LEFT: f64 = 1e-3;

/// Returns the cost of the smoother minus the cost that a batch solver reaches from its estimate with this
/// number of iterations. Only that number ends the solve, so the solver does not escape from a saddle point.
fn left(smoother: &mut Smoother, iterations: usize) -> f64 {
    let stop = Stopping {
        max_iterations: iterations,
        relative_cost: Some(NotNegative::literal(if iterations == 1 { 1.0 } else { 0.0 })),
        absolute_cost: NotNegative::literal(0.0),
        gradient: NotNegative::literal(0.0),
        step: NotNegative::literal(0.0),
    };
    let batch = LevenbergMarquardt { stop, ..LevenbergMarquardt::default() };
    smoother.cost() - smoother.finish(&batch, &mut Silent).unwrap().outcome.final_cost
}

#[test]
fn a_step_too_short_for_a_new_linearization_still_changes_robust_weights() {
    let mut smoother = Smoother::new(SmootherSettings {
        relinearize_every: NonZeroUsize::MIN,
        ..SmootherSettings::default()
    });
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: 0.0, y: 0.0 });
    graph.add(["p"], At { at: [0.0, 0.0] });
    smoother.push(&graph, &values).unwrap();
    smoother.update().unwrap();
    for (x, sigma, k) in [(-1.3, 1.0, 2.0), (1.4, 0.16, 2.0), (-1.3, 0.2, 2.4)] {
        let mut graph = Graph::new();
        let loss = Huber { scale: k.try_into().unwrap() };
        graph.add(["p"], At { at: [x, 0.0] }).noise(Noise::sigma(sigma).unwrap()).loss(loss);
        smoother.push(&graph, &Values::new()).unwrap();
        smoother.update().unwrap();
    }
    for _ in 0..100 {
        smoother.update().unwrap();
    }
    let p: Plane = smoother.get("p").unwrap();
    assert!(left(&mut smoother, 100) < LEFT, "{p:?}");
}

/// All losses. The first [`CONVEX`] of them are convex.
fn losses() -> Vec<Option<Arc<dyn Loss>>> {
    vec![
        None,
        Some(Arc::new(Huber::default())),
        Some(Arc::new(Fair::default())),
        Some(Arc::new(L1::default())),
        Some(Arc::new(Cauchy::default())),
        Some(Arc::new(Tukey::default())),
        Some(Arc::new(Welsch::default())),
        Some(Arc::new(GemanMcClure::default())),
        Some(Arc::new(Dcs::default())),
    ]
}
const CONVEX: usize = 4;

/// A factor of a random graph: its two variables, its measurement, and its σ.
type Link = (usize, usize, f64, f64, f64);

fn link() -> impl Strategy<Value = Link> {
    (0..5usize, 0..5usize, -3.0..3.0, -3.0..3.0, 0.05..1.0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn an_idle_smoother_comes_to_the_minimum(
        links in prop::collection::vec(link(), 1..24),
        loss in 0..9usize,
        every in prop_oneof![Just(1usize), Just(10)],
        ranges in any::<bool>(),
    ) {
        let (is_convex, is_l1) = (loss < CONVEX && !ranges, loss == 3);
        let loss = losses()[loss].clone();
        let mut smoother = Smoother::new(SmootherSettings { relinearize_every: NonZeroUsize::new(every).unwrap(), ..SmootherSettings::default() });
        let (mut graph, mut values) = (Graph::new(), Values::new());
        for v in 0..5 {
            let x = v as f64;
            values.insert(Key::indexed("p", v), Plane { x, y: -x });
            graph.add([Key::indexed("p", v)], At { at: [x, -x] });
        }
        smoother.push(&graph, &values).unwrap();
        smoother.update().unwrap();
        for (i, (a, b, x, y, sigma)) in links.into_iter().enumerate() {
            let (mut graph, noise) = (Graph::new(), Noise::sigma(sigma).unwrap());
            let (a, b) = (Key::indexed("p", a), Key::indexed("p", b));
            let added = match (a == b, ranges && i % 3 == 0) {
                (true, _) => graph.add([a], At { at: [x, y] }),
                (false, true) => graph.add([a, b], Distance { by: 1.0 + x.abs() }),
                (false, false) => graph.add([a, b], Apart { by: [x, y] }),
            };
            let added = added.noise(noise);
            added.loss.clone_from(&loss);
            smoother.push(&graph, &Values::new()).unwrap();
            smoother.update().unwrap();
        }
        for _ in 0..300 {
            smoother.update().unwrap();
        }
        // with several minima, one iteration shows whether the estimate is at a minimum
        let left = left(&mut smoother, if is_convex { 100 } else { 1 });
        // reweighting converges ever more slowly towards the kinks of L1
        let most = if is_l1 { 10.0 * LEFT } else { LEFT };
        prop_assert!(left < most, "{left} nats");
    }
}
