//! Search for undetermined variables and directions.
use crate::linear::Method;
use crate::linear::system::{LinearSystem, NoFactor};
use crate::outcome::Undetermined;
use crate::problem::{Model, Problem};
use manifactor_graph::Motion;
use std::time::Instant;

/// A pivot below this share of its diagonal entry triggers the search.
const SEARCH_PIVOT: f64 = 1e-11;
/// A direction v of unit length in the metric of the diagonal is undetermined if ‖J v‖² is below this.
const MAX_CURVATURE: f64 = 1e-15;
/// A diagonal entry below this share of its [reference](references) is rounding error.
const ROUNDING_SHARE: f64 = 1e-24;
/// Lower bound of diagonal entries in that metric, as a share of their reference.
const DIAGONAL_FLOOR: f64 = 1e-9;
/// Damping that makes the matrix positive definite for the search.
const SEARCH_DAMPING: f64 = 1e-10;
/// Largest share of a direction that is left when the motions of the whole are taken from it.
const MAX_REST: f64 = 1e-3;
/// Number of variables named in a report.
const MAX_NAMED: usize = 3;

/// Looks for an undetermined direction of the linearized problem. Searches only if the last factorization
/// failed, or if a pivot is so small that it may come from rounding and damping alone. `damping` is a share
/// of the diagonal, times the number of unknowns over which it may have accumulated.
///
/// The search overwrites the factorization.
pub(crate) fn undetermined(problem: &mut Problem, failed: bool, damping: f64) -> Option<Undetermined> {
    let clock = Instant::now();
    let has_factor = problem.system.cholesky().is_some();
    let found = match problem.system.method {
        Method::Cholesky(_) => search(problem, failed, damping),
        // the remaining methods have no pivots to inspect
        Method::Qr(_) => match problem.system.factorize_directly(None) {
            Err(NoFactor::OutOfMemory) => None,
            done => search(problem, done.is_err(), 0.0),
        },
        Method::ConjugateGradients(_) if failed => search(problem, true, damping),
        // or if a query has factorized them before
        Method::ConjugateGradients(_) if has_factor => search(problem, failed, damping),
        Method::ConjugateGradients(_) => None,
    };
    problem.times.diagnose += clock.elapsed().as_secs_f64();
    found
}

/// Returns what each diagonal entry of H is compared with: the largest one among the unknowns that share a factor with
/// it. Coordinates below one are counted in units of their own value, so that a capacity in farads does not hide a voltage.
fn references(problem: &Problem) -> Vec<f64> {
    let coordinates = problem.coordinates();
    let size = |x: &Option<f64>| x.filter(|x| *x != 0.0).map_or(1.0, |x| x.abs().min(1.0));
    let mut entries: Vec<f64> =
        problem.system.diagonal().zip(&coordinates).map(|(d, x)| d * size(x) * size(x)).collect();
    // the diagonal of unknowns that are held at a bound is set to one
    problem.system.held_at_bound().iter().for_each(|i| entries[*i] = 0.0);
    let (starts, rows, ..) = problem.normal_equations();
    let mut largest = entries.clone();
    for (column, range) in starts.windows(2).enumerate() {
        for row in &rows[range[0]..range[1]] {
            let row = *row as usize;
            largest[column] = largest[column].max(entries[row]);
            largest[row] = largest[row].max(entries[column]);
        }
    }
    largest
}

fn search(problem: &mut Problem, failed: bool, damping: f64) -> Option<Undetermined> {
    let largest = problem.system.largest();
    let (mut is_pivot_small, mut is_entry_small) = (false, false);
    if !failed {
        let share = SEARCH_PIVOT.max(10.0 * damping);
        problem.system.pivots(&mut |pivot, entry| {
            // a pivot that is NaN is suspicious too
            is_pivot_small |= pivot.is_nan() || pivot < share * entry;
            is_entry_small |= entry <= ROUNDING_SHARE * largest;
        });
        if !is_pivot_small && !is_entry_small {
            return None;
        }
    }
    let references = references(problem);
    let Problem { model, system, .. } = problem;
    let is_rounding = |(entry, reference): (&f64, &f64)| *entry <= ROUNDING_SHARE * reference;
    if !failed && !is_pivot_small && !system.diagonal().zip(&references).any(is_rounding) {
        return None;
    }
    let floor = |reference: f64| if reference > 0.0 { DIAGONAL_FLOOR * reference } else { 1.0 };
    let scale: Vec<f64> = system.diagonal().zip(&references).map(|(d, r)| d.max(floor(*r))).collect();
    let shift: Vec<f64> = scale.iter().map(|d| SEARCH_DAMPING * d).collect();
    system.factorize_directly(Some(&shift)).ok()?;
    // inverse iteration from a start vector with a component in every direction
    let mut v: Vec<f64> = (0..scale.len()).map(|i| ((i * 7919 % 104_729) as f64 + 1.0).sin()).collect();
    for _ in 0..6 {
        v.iter_mut().zip(&scale).for_each(|(v, d)| *v *= d);
        system.cholesky()?.solve(&mut v);
        let length = v.iter().zip(&scale).map(|(v, d)| v * v * d).sum::<f64>().sqrt();
        v.iter_mut().for_each(|v| *v /= length);
    }
    if curvature(model, system, &v) >= MAX_CURVATURE {
        return None;
    }
    let (motions, possible) = free_motions(model, system, &scale);
    let mut found = Undetermined { free: words(&motions, &possible), ..Undetermined::default() };
    for (_, motion) in &motions {
        let along: f64 = product(&v, motion, &scale);
        v.iter_mut().zip(motion).for_each(|(v, m)| *v -= along * m);
    }
    // the rest of a direction that is no motion of the whole
    if motions.is_empty() || product(&v, &v, &scale) > MAX_REST {
        found = Undetermined { free: found.free, ..name(model, &v, &scale) };
    } else {
        found.moving = model.variables.iter().filter(|place| place.start.is_some()).count();
    }
    Some(found)
}

/// Returns ‖J v‖², with the squares of what is held at a bound. From the rows of J, because rounding would dominate the
/// quadratic form of H.
fn curvature(model: &Model, system: &LinearSystem, v: &[f64]) -> f64 {
    let mut bent: f64 = system.held.iter().map(|i| v[*i] * v[*i]).sum();
    model.rows(&mut |factor| {
        let rows = factor.residual.len();
        for row in 0..rows {
            let along = |(start, block): &(usize, Vec<f64>)| -> f64 {
                block.iter().skip(row).step_by(rows).zip(&v[*start..]).map(|(j, v)| j * v).sum()
            };
            bent += factor.blocks.iter().map(along).sum::<f64>().powi(2);
        }
    });
    bent
}

fn product(a: &[f64], b: &[f64], scale: &[f64]) -> f64 {
    a.iter().zip(b).zip(scale).map(|((a, b), d)| a * b * d).sum()
}

/// Returns the motions of the whole along which the cost is constant, orthogonal and of unit length in the metric of the
/// diagonal, and all that move something.
fn free_motions(
    model: &Model,
    system: &LinearSystem,
    scale: &[f64],
) -> (Vec<(Motion, Vec<f64>)>, Vec<Motion>) {
    let (mut free, mut possible): (Vec<(Motion, Vec<f64>)>, _) = (vec![], vec![]);
    for motion in Motion::ALL {
        let (mut v, mut moving, mut is_anchored) = (vec![0.0; scale.len()], 0, false);
        for place in &model.variables {
            let value = model.columns().column(place.column).get(place.index);
            let moved = value.and_then(|x| x.erased().moved(motion)).unwrap_or_default();
            if moved.iter().all(|x| *x == 0.0) {
                continue;
            }
            match place.start {
                Some(start) => v[start..start + moved.len()].copy_from_slice(&moved),
                // beside a fixed variable, the whole cannot move
                None => is_anchored = true,
            }
            moving += 1;
        }
        let length = product(&v, &v, scale).sqrt();
        // a single variable is named itself
        if moving < 2 || is_anchored || !(length > 0.0 && length.is_finite()) {
            continue;
        }
        possible.push(motion);
        v.iter_mut().for_each(|v| *v /= length);
        if curvature(model, system, &v) >= MAX_CURVATURE {
            continue;
        }
        for (_, other) in &free {
            let along = product(&v, other, scale);
            v.iter_mut().zip(other).for_each(|(v, m)| *v -= along * m);
        }
        let length = product(&v, &v, scale).sqrt();
        if length > MAX_REST {
            v.iter_mut().for_each(|v| *v /= length);
            free.push((motion, v));
        }
    }
    (free, possible)
}

/// Returns the words for motions. Those along or about all axes on which something moves have one.
fn words(motions: &[(Motion, Vec<f64>)], possible: &[Motion]) -> Vec<String> {
    let translation =
        |motion: &Motion| if let Motion::Translation(axis) = motion { Some(*axis) } else { None };
    let rotation = |motion: &Motion| if let Motion::Rotation(axis) = motion { Some(*axis) } else { None };
    let mut words = vec![];
    let mut add = |name: &str, preposition: &str, axis: &dyn Fn(&Motion) -> Option<usize>| {
        let free: Vec<&str> =
            motions.iter().filter_map(|(motion, _)| ["x", "y", "z"].get(axis(motion)?).copied()).collect();
        let all = possible.iter().filter(|motion| axis(motion).is_some()).count();
        match free.len() {
            0 => {}
            n if n == all => words.push(name.to_owned()),
            _ => words.push(format!("{name} {preposition} {}", free.join(" and "))),
        }
    };
    add("position", "along", &translation);
    add("orientation", "about", &rotation);
    if motions.iter().any(|(motion, _)| *motion == Motion::Scale) {
        words.push("scale".to_owned());
    }
    words
}

/// Describes a direction by variables and the names of their tangent directions.
pub(crate) fn name(model: &Model, v: &[f64], scale: &[f64]) -> Undetermined {
    let mut moves: Vec<(usize, f64)> = vec![];
    for (i, place) in model.variables.iter().enumerate() {
        if let Some(start) = place.start {
            let range = start..start + place.tangent.len();
            let square = v[range.clone()].iter().zip(&scale[range]).map(|(v, d)| v * v * d).sum::<f64>();
            moves.push((i, square.sqrt()));
        }
    }
    moves.sort_by(|a, b| b.1.total_cmp(&a.1));
    let most = moves.first().map_or(0.0, |m| m.1);
    let moving = moves.iter().filter(|m| m.1 > 1e-3 * most).count();
    moves.truncate(MAX_NAMED.min(moving));
    let mut direction = vec![];
    for (i, _) in &moves {
        let place = &model.variables[*i];
        let Some(start) = place.start else { continue };
        let part = &v[start..start + place.tangent.len()];
        let largest = part.iter().fold(0.0, |m, x| f64::max(m, x.abs()));
        // the sign of a direction is arbitrary: make its largest entry positive
        let sign = part.iter().find(|x| x.abs() == largest).map_or(1.0, |x| x.signum());
        let entries = part.iter().zip(place.tangent).filter(|(x, _)| x.abs() > 0.1 * largest);
        direction.extend(entries.map(|(x, name)| (place.key.clone(), *name, sign * x / largest)));
    }
    let keys = moves.iter().map(|(i, _)| model.variables[*i].key.clone()).collect();
    Undetermined { free: vec![], keys, direction, moving }
}
