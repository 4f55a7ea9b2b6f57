//! What a solve has to tell, for people.
use crate::text::{count, seconds};
use manifactor::solve::Outcome;

/// A few lines: how it ended, what it cost, where the time went.
pub(crate) fn outcome(outcome: &Outcome) -> String {
    let times = &outcome.times;
    let mut out = format!("{}\n", outcome.termination);
    out += &format!(
        "cost {:.9} -> {:.9} in {}\n",
        outcome.initial_cost,
        outcome.final_cost,
        count(outcome.iterations, "iteration")
    );
    if outcome.inactive > 0 {
        let (inactive, all) = (outcome.inactive, count(outcome.factors, "factor"));
        out += &format!("{inactive} of {all} are not defined at these values and take no part\n");
    }
    if let Some(undetermined) = &outcome.undetermined {
        out += &format!("warning: {undetermined}\n");
    }
    out += &format!(
        "{}: compile {}, linearize {}, factorize {}, solve {}, other {}\n",
        seconds(times.total),
        seconds(times.compile),
        seconds(times.linearize),
        seconds(times.factorize),
        seconds(times.solve),
        seconds(times.other)
    );
    out
}
