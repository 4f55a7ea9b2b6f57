//! Variations of a graph: fixed variables and omitted factors.
use crate::failure::Failure;
use crate::output::text::count;
use clap::Args;
use manifactor::config::nearest;
use manifactor::graph::{Graph, Values};

/// `--freeze` and `--drop`.
#[derive(Debug, Args)]
pub(crate) struct WhatIf {
    /// Fix a variable, such as `x0`, or one direction of it, such as `q0.log_a`; may be repeated.
    #[arg(long, value_name = "KEY")]
    freeze: Vec<String>,
    /// Omit a factor by the number in reports, or all factors of a type, such as `bounding_box`; may be
    /// repeated.
    #[arg(long, value_name = "FACTOR")]
    drop: Vec<String>,
}

impl WhatIf {
    /// Changes the graph, and returns a description of each change.
    pub(crate) fn apply(&self, graph: &mut Graph, values: &Values) -> Result<Vec<String>, Failure> {
        let mut notes = vec![];
        for key in &self.freeze {
            freeze(graph, values, key)?;
            notes.push(format!("fixed {key}"));
        }
        let mut dropped = vec![false; graph.factors().len()];
        for which in &self.drop {
            let before = dropped.iter().filter(|d| **d).count();
            mark(graph, which, &mut dropped)?;
            let n = dropped.iter().filter(|d| **d).count() - before;
            notes.push(format!("omitted {} by `--drop {which}`", count(n, "factor")));
        }
        let mut places = dropped.iter();
        graph.factors_mut().retain(|_| !places.next().copied().unwrap_or(false));
        Ok(notes)
    }
}

fn freeze(graph: &mut Graph, values: &Values, key: &str) -> Result<(), Failure> {
    if values.contains(key) {
        graph.fix(key);
        return Ok(());
    }
    let direction =
        key.rsplit_once('.').and_then(|(key, direction)| Some((key, direction, values.variable(key)?)));
    let Some((whole, direction, variable)) = direction else {
        let names = values.iter().map(|(key, _)| key.as_str());
        let meant = nearest(key, names).map(|k| format!("did you mean `{k}`? ")).unwrap_or_default();
        let help = format!("{meant}expected a key of the graph, or a key and a direction such as `q0.log_a`");
        return Err(Failure::with_help(format!("--freeze {key}: the graph has no such variable"), help));
    };
    let tangent = variable.erased().tangent();
    if !tangent.contains(&direction) {
        let what = format!("--freeze {key}: `{whole}` has no direction `{direction}`");
        return Err(Failure::with_help(what, format!("its directions are {}", tangent.join(", "))));
    }
    let held = match graph.fixed().get(whole) {
        Some(manifactor::graph::Fixed::Directions(held)) => held.clone(),
        _ => vec![],
    };
    let held: Vec<&str> = held.iter().map(String::as_str).chain([direction]).collect();
    graph.fix_directions(whole, &held);
    Ok(())
}

fn mark(graph: &Graph, which: &str, dropped: &mut [bool]) -> Result<(), Failure> {
    let factors = dropped.len();
    if let Ok(number) = which.parse::<usize>() {
        let Some(place) = dropped.get_mut(number) else {
            let what = format!("--drop {which}: the graph has {}", count(factors, "factor"));
            return Err(Failure::with_help(
                what,
                "factors are numbered from 0; `manifactor graph` lists them",
            ));
        };
        *place = true;
        return Ok(());
    }
    let names = || graph.factors().iter().map(|f| f.factor.typetag_name());
    if !names().any(|name| name == which) {
        let meant = nearest(which, names()).map(|n| format!("did you mean `{n}`? ")).unwrap_or_default();
        let help = format!("{meant}expected a number or a type, as `manifactor graph` lists them");
        return Err(Failure::with_help(
            format!("--drop {which}: the graph has no factor of this type"),
            help,
        ));
    }
    dropped.iter_mut().zip(names()).for_each(|(dropped, name)| *dropped |= name == which);
    Ok(())
}
