//! A robust loss: quadratic up to a bound, and constant beyond it.
use crate::solve_document;
use manifactor::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Truncated least squares: ρ = min(s, k²).
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Truncated {
    /// The bound k, in standard deviations.
    scale: Positive,
}

impl RobustLoss for Truncated {
    fn rho(&self, s: f64) -> (f64, f64) {
        let bound = self.scale.get().powi(2);
        if s <= bound { (s, 1.0) } else { (bound, 0.0) }
    }
}
register_loss!("test_truncated", Truncated);

#[test]
fn a_graph_names_it_and_the_outlier_does_not_pull() {
    let measure = |position: f64| {
        format!(
            "[[factors]]\nkeys = [\"p\"]\nfactor = {{ type = \"prior_point1\", value = {{ position = [{position:?}] }} }}\n\
             loss = {{ type = \"test_truncated\", scale = 3.0 }}\n"
        )
    };
    let variable = "[[variables]]\nkey = \"p\"\nvalue = { type = \"point1\", position = [0.5] }\n";
    let text = [variable.to_owned(), measure(0.0), measure(2.0), measure(100.0)].concat();
    let solution = solve_document(&text);
    let p: &manifactor::geometry::Point1 = solution.values.get("p").unwrap();
    assert!((p.0.x - 1.0).abs() < 1e-9, "{p:?}");
    // two residuals of one σ, and the bound of the third
    assert!((solution.outcome.final_cost - 0.5 * (1.0 + 1.0 + 9.0)).abs() < 1e-9);
}

/// `Truncated` does not implement `tempered`.
#[test]
fn it_is_tempered_all_the_same() {
    let loss = Truncated { scale: Positive::new(3.0).unwrap() };
    let tempered = loss.erased().tempered(Positive::new(4.0).unwrap());
    assert_eq!(tempered.erased().rho(2.0), (2.0, 1.0));
    assert_eq!(tempered.erased().rho(3.0), (9.0 / 4.0, 0.0));
    let written = serde_json::to_string(&tempered).unwrap();
    let read: Box<dyn Loss> = serde_json::from_str(&written).unwrap();
    assert_eq!(read.erased().rho(3.0), (9.0 / 4.0, 0.0));
}
