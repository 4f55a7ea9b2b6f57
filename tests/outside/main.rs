//! Types that are defined outside the workspace's crates, using only the facade: one file per extension
//! point.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic, clippy::print_stderr)]
#[path = "../../examples/01_new_factor/rests_on.rs"]
mod rests_on;

mod book;
mod examples;
mod factor;
mod first_factor;
mod loss;
mod manifold;
mod measurement;
mod motion;
mod own_manifold;
mod solver;
mod source;

use manifactor::config::{Document, Errors, Format, read_graph_section};
use manifactor::prelude::*;

/// Reads a literal graph that names its solver, and solves it.
fn solve_document(text: &str) -> Solution {
    let document = Document::parse("test.toml", text, Format::Toml).unwrap_or_else(|e| panic!("{e}"));
    let errors = Errors::new();
    let read = document.section(&errors).map(|mut section| {
        let graph = read_graph_section(&mut section);
        let solver = section.optional::<Box<dyn Optimizer>>("solver");
        section.finish();
        (graph, solver)
    });
    let ((graph, values), solver) = errors.finish(read).unwrap_or_else(|e| panic!("{e}"));
    let solver = solver.unwrap_or_else(|| Box::new(LevenbergMarquardt::default()));
    solve(&graph, &values, &*solver, &mut Silent).unwrap()
}
