//! The laws of manifolds.
use crate::differences::differentiate;
use crate::error::{LawError, json_of};
use manifactor_graph::quantity::variable_quantity;
use manifactor_graph::{Motion, Variable};
use serde_json::Value;

/// Largest distance of two points that count as equal, relative to the largest coordinate or to 1.
const TOLERANCE: f64 = 1e-9;
/// Longest step of the differences.
const LONGEST_STEP: f64 = 1e-2;
/// Step of the differences along motions of the frame.
const MOTION_STEP: f64 = 1e-4;
/// Largest difference between the derivatives of `seed` and numeric ones, relative to the largest derivative
/// or to 1.
const SEED_TOLERANCE: f64 = 1e-6;

/// Checks the laws of a manifold at two points, and for a tangent vector `delta` at the first. `delta` has to
/// be inside of the chart (for rotations: shorter than π).
///
/// The laws are `x ⊞ 0 = x`; `x ⊞ (y ⊟ x) = y`; `(x ⊞ δ) ⊟ x = δ`; all results are finite; steps add to
/// coordinates; each direction has a name; motions of the frame move its position; a document of x reads back as an equal document; [`seed_law`].
///
/// # Errors
/// The first law that does not hold.
pub fn manifold_laws(x: &dyn Variable, y: &dyn Variable, delta: &[f64]) -> Result<(), LawError> {
    let broken =
        |law, error| LawError::Manifold { law, error, x: json_of(x), y: json_of(y), delta: delta.to_vec() };
    let (from, to) = (x.erased(), y.erased());
    let require = |holds: bool, law| if holds { Ok(()) } else { Err(broken(law, f64::INFINITY)) };
    let dim = from.dim();
    let mut names = from.tangent().to_vec();
    names.sort_unstable();
    names.dedup();
    require(names.len() == dim, "each tangent direction has a name of its own")?;
    require((1..=32).contains(&dim), "a tangent space has 1 to 32 dimensions")?;
    require(delta.len() == dim && from.type_id() == to.type_id(), "x, y and delta are of one manifold")?;
    require(from.is_finite() && to.is_finite(), "x and y are finite")?;
    require(from.retract(&vec![0.0; dim + 1]).is_none(), "a tangent vector of another length is refused")?;

    let wrong = |law| move || broken(law, f64::INFINITY);
    let scale = largest(x).max(largest(y)).max(delta.iter().fold(1.0, |max: f64, d| max.max(d.abs())));
    let small = |law, error: Option<f64>| match error.ok_or_else(wrong(law))? {
        e if e <= TOLERANCE * scale => Ok(()),
        e => Err(broken(law, e)),
    };
    let distance = |a: &dyn Variable, b: &dyn Variable| Some(norm(&a.erased().local(b)?));

    let law = "x.retract(0) is x";
    let same = from.retract(&vec![0.0; dim]).ok_or_else(wrong(law))?;
    small(law, distance(x, &*same))?;

    let law = "x.retract(x.local(y)) is y";
    let there = from.retract(&from.local(y).ok_or_else(wrong(law))?).ok_or_else(wrong(law))?;
    small(law, distance(y, &*there))?;

    let law = "x moves with everything in its frame as its position does";
    for motion in Motion::ALL {
        let (Some(moved), Some(position)) = (from.moved(motion), from.position()) else { continue };
        let at = |step: f64| {
            let delta: Vec<f64> = moved.iter().map(|d| step * d).collect();
            from.retract(&delta).and_then(|x| x.erased().position()).ok_or_else(wrong(law))
        };
        let (ahead, behind) = (at(MOTION_STEP)?, at(-MOTION_STEP)?);
        for ((a, b), velocity) in ahead.iter().zip(behind).zip(motion.velocity(position)) {
            let size = position.iter().fold(1.0, |max: f64, x| max.max(x.abs()));
            let error = ((a - b) / (2.0 * MOTION_STEP) - velocity).abs();
            // the third coordinate of a point in the plane stays
            require(error <= SEED_TOLERANCE * size || position[2] == 0.0, law)?;
        }
    }

    let law = "x.local(x.retract(delta)) is delta";
    let moved = from.retract(delta).ok_or_else(wrong(law))?;
    require(moved.erased().is_finite(), "x.retract(delta) is finite")?;
    let back = from.local(&*moved).ok_or_else(wrong(law))?;
    let difference: Vec<f64> = back.iter().zip(delta).map(|(b, d)| b - d).collect();
    small(law, Some(norm(&difference)))?;

    let law = "x.retract(delta) adds to coordinates";
    for (direction, step) in delta.iter().enumerate() {
        let sum = from.coordinate(direction).map(|x| x + step);
        require(moved.erased().coordinate(direction) == sum, law)?;
    }

    let law = "a document reads back as the same document";
    for variable in [x, &*moved] {
        let text = json_of(variable);
        let read = serde_json::from_str::<Box<dyn Variable>>(&text).ok();
        require(read.is_some_and(|read| json_of(&*read) == text), law)?;
    }
    seed_law(x).map(drop)
}

/// Checks that the derivatives of a point's `seed` agree with `retract`. Returns the largest difference,
/// relative to the largest derivative or to 1. Returns `None` if the manifold is not registered by
/// [`register_quantity!`](manifactor_graph::register_quantity), because its values are unknown then.
///
/// # Errors
/// The direction with the largest difference, as `delta`.
pub fn seed_law(x: &dyn Variable) -> Result<Option<f64>, LawError> {
    let (from, law) = (x.erased(), "the derivative of x.seed() is that of x.retract(delta)");
    let Some(quantity) = variable_quantity(from.type_id()) else { return Ok(None) };
    let (dim, size) = (quantity.dimension, quantity.shape.size);
    let flat = |point: &dyn Variable| {
        let mut numbers = vec![0.0; size];
        (quantity.values)(point.erased().as_any(), &mut numbers);
        numbers
    };
    // derivatives by each direction, for each number of the flat form
    let mut seeded = vec![0.0; size * dim];
    (quantity.gradients)(from.as_any(), &mut seeded);
    let scale = seeded.iter().fold(1.0, |max: f64, x| max.max(x.abs()));
    let (mut largest, mut broken) = (0.0, None);
    for direction in 0..dim {
        let along = |h: f64| {
            let mut delta = vec![0.0; dim];
            delta[direction] = h;
            from.retract(&delta).map(|there| flat(&*there))
        };
        for (row, numeric) in differentiate(size, LONGEST_STEP, along).into_iter().flatten().enumerate() {
            let apart = (seeded[row * dim + direction] - numeric.value).abs();
            let error = if apart.is_nan() { f64::INFINITY } else { apart / scale };
            largest = f64::max(largest, error);
            // close to a singularity the finite difference is inaccurate; its own error estimate says so
            let is_exact = apart > 10.0 * numeric.error || apart.is_nan();
            if is_exact && error > SEED_TOLERANCE && broken.is_none_or(|(worst, _)| error > worst) {
                broken = Some((error, direction));
            }
        }
    }
    match broken {
        None => Ok(Some(largest)),
        Some((error, direction)) => {
            let mut delta = vec![0.0; dim];
            delta[direction] = 1.0;
            Err(LawError::Manifold { law, error, x: json_of(x), y: json_of(x), delta })
        }
    }
}

/// Returns the largest absolute entry; infinite if an entry is NaN.
fn norm(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |max: f64, x| if x.is_nan() { f64::INFINITY } else { max.max(x.abs()) })
}

/// Returns the largest absolute number in the document of a variable.
fn largest(variable: &dyn Variable) -> f64 {
    fn of(value: &Value) -> f64 {
        match value {
            Value::Number(n) => n.as_f64().map_or(0.0, f64::abs),
            Value::Array(all) => all.iter().map(of).fold(0.0, f64::max),
            Value::Object(all) => all.values().map(of).fold(0.0, f64::max),
            _ => 0.0,
        }
    }
    serde_json::to_value(variable).as_ref().map_or(0.0, of)
}
