use super::{Loss, RobustLoss};
use crate::register_loss;
use crate::registry::checked::Positive;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A loss at a different temperature: ρ(τs)/τ.
///
/// If τ residuals of a kind carry the information of one, their σ is multiplied by √τ. This loss still
/// counts in the σ of a single residual: an outlier is one among single residuals, not among means of τ of
/// them. Small residuals cost as much as without the loss. The built-in losses need no wrapper, which is
/// cheaper: use `scale` / √τ, or `scale` / τ for `dcs`.
///
/// ```toml
/// loss = { type = "tempered", tau = 4.0, loss = { type = "huber", scale = 1.345 } }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tempered {
    /// τ: the number of residuals that carry the information of one.
    pub tau: Positive,
    /// The loss ρ.
    pub loss: Arc<dyn Loss>,
}

impl RobustLoss for Tempered {
    fn rho(&self, s: f64) -> (f64, f64) {
        let tau = self.tau.get();
        let (rho, weight) = self.loss.erased().rho(tau * s);
        (rho / tau, weight)
    }
    fn tempered(&self, tau: Positive) -> Option<Self> {
        let tau = Positive::new(self.tau.get() * tau.get()).ok()?;
        Some(Self { tau, loss: self.loss.clone() })
    }
}
register_loss!("tempered", Tempered);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loss::{Cauchy, Dcs, L1};

    /// A loss without a `tempered` method, as a plugin may have.
    #[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
    struct Outside {}
    impl RobustLoss for Outside {
        fn rho(&self, s: f64) -> (f64, f64) {
            (3.0 * s.min(2.0), if s < 2.0 { 3.0 } else { 0.0 })
        }
    }
    register_loss!("test_outside", Outside);

    fn tempered(loss: &dyn Loss, tau: f64) -> Arc<dyn Loss> {
        loss.erased().tempered(Positive::new(tau).unwrap())
    }

    #[test]
    fn a_loss_without_a_method_of_its_own_is_tempered_by_the_wrapper() {
        let loss = tempered(&Outside {}, 4.0);
        assert_eq!(loss.erased().rho(0.25), (0.75, 3.0));
        assert_eq!(loss.erased().rho(9.0), (1.5, 0.0));
        let twice = tempered(&*loss, 2.0);
        assert_eq!(twice.erased().rho(9.0), (0.75, 0.0));
        let text = serde_json::to_string(&twice).unwrap();
        assert_eq!(text, r#"{"type":"tempered","tau":8.0,"loss":{"type":"test_outside"}}"#);
        let again: Box<dyn Loss> = serde_json::from_str(&text).unwrap();
        assert_eq!(again.erased().rho(9.0), twice.erased().rho(9.0));
    }

    #[test]
    fn a_built_in_loss_stays_of_its_type() {
        let text = |loss: &dyn Loss| serde_json::to_string(&tempered(loss, 4.0)).unwrap();
        assert_eq!(text(&Cauchy::new(2.8).unwrap()), r#"{"type":"cauchy","scale":1.4}"#);
        assert_eq!(text(&Dcs::new(2.8).unwrap()), r#"{"type":"dcs","scale":0.7}"#);
        assert_eq!(text(&L1::default()), r#"{"type":"l1","scale":0.5}"#);
    }

    #[test]
    fn a_scale_that_is_no_number_any_more_is_left_to_the_wrapper() {
        let loss = tempered(&Dcs::new(1e-300).unwrap(), 1e300);
        assert_eq!((loss.typetag_name(), loss.erased().rho(0.0)), ("tempered", (0.0, 1.0)));
    }
}
