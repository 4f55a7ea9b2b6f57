//! Commands that check whether a plugin's types keep their laws.
mod factor;
mod manifold;

use crate::failure::Failure;
use manifactor::config::nearest;
use manifactor::graph::catalogue::{Entry, entries, find};

pub(crate) use factor::CheckFactor;
pub(crate) use manifold::CheckManifold;

/// Returns the registered type with this kind and name.
fn linked(kind: &'static str, name: &str, register: &str) -> Result<&'static Entry, Failure> {
    find(kind, name).ok_or_else(|| {
        let names = entries(kind);
        let meant = nearest(name, names.iter().map(|e| e.name));
        let meant = meant.map(|m| format!("did you mean `{m}`? ")).unwrap_or_default();
        let help = format!(
            "`manifactor list {kind}s` prints the linked ones. A {kind} of a plugin needs its line `{register}`, and a binary that \
             links its crate: `use my_plugin as _;`"
        );
        Failure::with_help(format!("unknown {kind} `{name}`"), meant + &help)
    })
}
