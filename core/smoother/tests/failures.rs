//! A failed update leaves no trace, and does not affect later updates.
use crate::history::{Change, History, allowed, bits, change, outliers, window};
use crate::toy::{At, Careless, Plane};
use crate::world::{Shadow, Space};
use manifactor_graph::checked::NotNegative;
use manifactor_graph::{Fixed, Graph, Noise, Values};
use manifactor_smoother::{Smoother, SmootherSettings, UpdateReport};
use proptest::prelude::*;
use std::num::NonZeroUsize;

/// Pushes, removes, weights and holds, and then fails: by a residual that is not finite, or by a sum that
/// overflows.
fn fail(history: &mut History, n: usize, overflows: bool) {
    let smoother = &mut history.smoother;
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("new", Plane { x: -4.0, y: 1.0 });
    if n.is_multiple_of(3) {
        // a type that the smoother may not have had before
        values.insert("space", Space { at: [1.0, 2.0, 3.0] });
        graph.add(["new", "space"], Shadow { by: [0.0, 0.0] });
    }
    for _ in 0..3 {
        graph.add(["new"], At { at: [3.0, 0.0] }).noise(Noise::sigma(1e-154).unwrap());
    }
    if !overflows {
        graph.add(["new"], Careless {});
    }
    for key in history.keys.iter().take(n % 5) {
        allowed(smoother.fix(key, &Fixed::Whole(n.is_multiple_of(2))));
        if key.as_str().starts_with('p') && smoother.estimate(key.as_str()).is_some() {
            graph.add([key.clone(), "new".into()], crate::toy::Apart { by: [1.0, 0.0] });
        }
    }
    smoother.push(&graph, &values).unwrap();
    for id in history.ids.iter().skip(n % 7).take(n % 4) {
        allowed(smoother.set_weight(*id, 0.5));
    }
    for id in history.ids.iter().skip(n % 3).step_by(3).take(n % 6) {
        allowed(smoother.remove(&[*id]));
    }
    smoother.update().unwrap_err();
}

proptest! {
    #![proptest_config(ProptestConfig::default())]
    #[test]
    fn a_failed_update_leaves_no_trace(
        before in prop::collection::vec(change(), 0..40),
        after in prop::collection::vec(change(), 1..40),
        n in 0..1000usize,
        overflows in any::<bool>(),
        every in (1..4usize).prop_filter_map("zero", NonZeroUsize::new),
        budget in prop_oneof![Just(None), Just(Some(NotNegative::literal(300.0)))],
        window in prop_oneof![Just(None), window().prop_map(Some)],
        outliers in outliers(),
    ) {
        let settings = SmootherSettings { relinearize_every: every, budget, window, outliers, ..SmootherSettings::default() };
        let [mut one, mut other] = std::array::from_fn(|_| History::new(settings.clone()));
        for history in [&mut one, &mut other] {
            history.apply_all(&before);
            history.apply(&Change::Update);
        }
        fail(&mut one, n, overflows);
        prop_assert_eq!(one.smoother.cost().to_bits(), other.smoother.cost().to_bits());
        prop_assert_eq!(bits(&one.smoother), bits(&other.smoother));
        let loaded = Smoother::load(&one.smoother.save().unwrap());
        prop_assert!(loaded.is_ok(), "{}", loaded.err().map(|error| error.to_string()).unwrap_or_default());
        prop_assert_eq!(bits(&loaded.unwrap()), bits(&other.smoother));
        for change in after.iter().chain(&[Change::Update]) {
            // ids continue after the ones of the failed update
            let [one, other] = [&mut one, &mut other].map(|history| {
                history.apply(change).map(|report| UpdateReport { dropped: vec![], rejected: vec![], readmitted: vec![], ..report })
            });
            prop_assert_eq!(one, other);
        }
        prop_assert_eq!(bits(&one.smoother), bits(&other.smoother));
        let keys = one.present();
        prop_assert_eq!(one.smoother.covariance(&keys), other.smoother.covariance(&keys));
    }
}
