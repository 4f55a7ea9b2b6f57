//! The graph as a picture from above: variables at their positions, factors between them.
use super::{Inspection, VariableRow};
use manifactor::viz::escape;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Width and height of the picture, and its margin. Unit: pixels.
const SIZE: f64 = 900.0;
const MARGIN: f64 = 60.0;

type Places<'a> = BTreeMap<&'a str, [f64; 2]>;

/// Variables are dots with their names, factors are lines to the middle of their variables; expensive
/// factors are redder.
pub(super) fn write(inspection: &Inspection) -> String {
    let places = scaled(places(inspection));
    let place = |key: &str| places.get(key).copied().unwrap_or([SIZE / 2.0; 2]);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {SIZE} {SIZE}\" font-family=\"sans-serif\" \
         font-size=\"11\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    let cost = |i: usize| {
        let row = &inspection.factors[i];
        row.after.as_ref().unwrap_or(&row.before).cost
    };
    let largest = (0..inspection.factors.len()).map(cost).fold(0.0, f64::max);
    for (i, row) in inspection.factors.iter().enumerate() {
        let share = if largest > 0.0 { cost(i) / largest } else { 0.0 };
        let color = format!(
            "rgb({:.0},{:.0},{:.0})",
            120.0 + 100.0 * share,
            140.0 - 110.0 * share,
            160.0 - 130.0 * share
        );
        let ends: Vec<[f64; 2]> = row.keys.iter().map(|key| place(key)).collect();
        let [x, y] = middle(&ends);
        // writing to a String cannot fail
        let _ = writeln!(
            out,
            "<g stroke=\"{color}\" fill=\"{color}\"><title>{}</title>",
            escape(&title(inspection, i))
        );
        for [kx, ky] in &ends {
            let _ = writeln!(out, "<line x1=\"{x:.1}\" y1=\"{y:.1}\" x2=\"{kx:.1}\" y2=\"{ky:.1}\"/>");
        }
        let _ =
            writeln!(out, "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"5\" height=\"5\"/></g>", x - 2.5, y - 2.5);
    }
    for row in &inspection.variables {
        let [x, y] = place(&row.key);
        let fill = if row.fixed.is_some() { "black" } else { "white" };
        let _ = writeln!(
            out,
            "<g><title>{0}: {1}</title><circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"{fill}\" stroke=\"black\"/>\
             <text x=\"{2:.1}\" y=\"{3:.1}\">{0}</text></g>",
            escape(&row.key),
            row.of_type,
            x + 7.0,
            y - 5.0
        );
    }
    out + "</svg>\n"
}

fn title(inspection: &Inspection, factor: usize) -> String {
    let row = &inspection.factors[factor];
    let after = row.after.as_ref().map(|s| format!(" -> {:.4}", s.cost)).unwrap_or_default();
    format!("{} {} ({}): {:.4}{after}", row.number, row.label(), row.keys.join(", "), row.before.cost)
}

/// Positions of the variables. A variable without a position is drawn next to the variables that share its
/// factors.
fn places(inspection: &Inspection) -> Places<'_> {
    let known = |row: &VariableRow| {
        let value = row.after.as_ref().unwrap_or(&row.before);
        let at = value.get("translation").or_else(|| value.get("position"))?;
        let coordinate = |i: usize| at.get(i).and_then(Value::as_f64).filter(|x| x.is_finite());
        Some([coordinate(0)?, coordinate(1)?])
    };
    let mut places: Places<'_> =
        inspection.variables.iter().filter_map(|row| Some((row.key.as_str(), known(row)?))).collect();
    let all: Vec<_> = places.values().copied().collect();
    let span = all.iter().flatten().fold(0.0, |max: f64, x| max.max(x.abs())).max(1.0);
    for (i, row) in inspection.variables.iter().enumerate() {
        if places.contains_key(row.key.as_str()) {
            continue;
        }
        let factors = inspection.factors_by_key.get(&row.key).into_iter().flatten();
        let neighbours = factors.flat_map(|f| &inspection.factors[*f].keys);
        let around: Vec<_> = neighbours.filter_map(|key| places.get(key.as_str()).copied()).collect();
        let (angle, [x, y]) = (2.4 * i as f64, middle(&around));
        places.insert(&row.key, [x + 0.2 * span * angle.cos(), y + 0.2 * span * angle.sin()]);
    }
    places
}

fn middle(points: &[[f64; 2]]) -> [f64; 2] {
    let n = points.len().max(1) as f64;
    [0, 1].map(|i| points.iter().map(|p| p[i]).sum::<f64>() / n)
}

/// Maps positions into the picture, with the second coordinate upwards and one scale for both.
fn scaled(places: Places<'_>) -> Places<'_> {
    let bounds = |i: usize| {
        let all = places.values().map(|p| p[i]);
        (all.clone().fold(f64::INFINITY, f64::min), all.fold(f64::NEG_INFINITY, f64::max))
    };
    let ((x0, x1), (y0, y1)) = (bounds(0), bounds(1));
    let scale = (SIZE - 2.0 * MARGIN) / (x1 - x0).max(y1 - y0).max(1e-9);
    let to = |[x, y]: [f64; 2]| [MARGIN + (x - x0) * scale, SIZE - MARGIN - (y - y0) * scale];
    places.into_iter().map(|(key, p)| (key, to(p))).collect()
}
