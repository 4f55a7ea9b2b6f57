//! A graph in space: its variables at their positions, before and after a solve, and its factors between them.
mod picture;

use manifactor_graph::{Graph, Key, Values};
use manifactor_solve::Solution;
use nalgebra::Vector3;
use std::collections::HashMap;

/// Largest number of variables whose names are shown, and beside which variables without a position are drawn.
const NAMED: usize = 50;
/// Factors with a smaller weight from their loss or from the solver count as outliers.
const OUTLIER: f64 = 0.5;

/// The variables of a solved graph as points, and its factors as lines.
///
/// A variable without a [position](manifactor_graph::Manifold::position), such as a rotation, is drawn beside the
/// variables that it shares factors with if the graph is small, and left out otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct GraphScene {
    /// Title of pictures and pages.
    pub title: String,
    points: Vec<GraphPoint>,
    lines: Vec<GraphLine>,
    /// Number of variables that are not drawn.
    unplaced: usize,
}

/// A variable.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GraphPoint {
    pub(crate) key: Key,
    pub(crate) of_type: &'static str,
    pub(crate) before: Vector3<f64>,
    pub(crate) after: Vector3<f64>,
    /// Whether at least one of its directions is fixed.
    pub(crate) is_fixed: bool,
}

/// A factor between at least two points.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GraphLine {
    /// Index of the factor in the graph, and its name or that of its type.
    pub(crate) factor: usize,
    pub(crate) name: String,
    /// Indices of its points.
    pub(crate) ends: Vec<usize>,
    /// ½ρ at the estimate.
    pub(crate) cost: f64,
    /// Whether its loss or the solver has reduced its weight.
    pub(crate) is_outlier: bool,
}

/// Returns the weight of a factor: that of its loss times that of the solver.
pub(crate) fn weight(solution: &Solution, factor: usize) -> f64 {
    let of_loss = solution.factors.get(factor).map_or(1.0, |state| state.weight);
    of_loss * solution.weights.get(factor).copied().unwrap_or(1.0)
}

/// Returns whether the weight of a factor is that of an outlier.
pub(crate) fn is_outlier(solution: &Solution, factor: usize) -> bool {
    weight(solution, factor) < OUTLIER
}

impl GraphScene {
    /// Creates the scene of a graph that was solved from the values `start`.
    pub fn new(title: impl Into<String>, graph: &Graph, start: &Values, solution: &Solution) -> Self {
        let mut points = vec![];
        let mut free = vec![];
        let is_small = start.len() <= NAMED;
        for (key, before) in start.iter() {
            let after = solution.values.variable(key.as_str()).unwrap_or(before);
            let places = before.erased().position().zip(after.erased().position());
            let places = places.filter(|(a, b)| a.iter().chain(b).all(|x| x.is_finite()));
            let (before_at, after_at) = places.unwrap_or_default();
            if places.is_none() {
                free.push(points.len());
                if !is_small {
                    continue;
                }
            }
            points.push(GraphPoint {
                key: key.clone(),
                of_type: before.typetag_name(),
                before: before_at.into(),
                after: after_at.into(),
                is_fixed: graph.fixed().get(key).is_some(),
            });
        }
        let unplaced = if is_small { 0 } else { free.len() };
        let index: HashMap<&str, usize> =
            points.iter().enumerate().map(|(i, point)| (point.key.as_str(), i)).collect();
        let lines = graph.factors().iter().enumerate().filter_map(|(factor, entry)| {
            let ends: Vec<usize> =
                entry.keys.iter().filter_map(|key| index.get(key.as_str()).copied()).collect();
            let state = solution.factors.get(factor)?;
            (ends.len() > 1).then(|| GraphLine {
                factor,
                name: entry.name.as_deref().unwrap_or_else(|| entry.factor.typetag_name()).to_owned(),
                ends,
                cost: state.cost,
                is_outlier: is_outlier(solution, factor),
            })
        });
        let mut scene = Self { title: title.into(), lines: lines.collect(), points, unplaced };
        if is_small {
            scene.place_beside(&free);
        }
        scene
    }

    /// Places points without a position around the middle of the placed ones that they share factors with, at angles
    /// that keep them apart.
    fn place_beside(&mut self, free: &[usize]) {
        let placed = |i: &usize| !free.contains(i);
        let span = self.points.iter().map(|p| p.after.amax()).fold(0.0, f64::max);
        let reach = 0.2 * if span > 0.0 { span } else { 1.0 };
        let middles: Vec<[Vector3<f64>; 2]> = free
            .iter()
            .map(|i| {
                let lines = self.lines.iter().filter(|line| line.ends.contains(i));
                let around: Vec<usize> = lines.flat_map(|line| &line.ends).copied().filter(placed).collect();
                let n = around.len().max(1) as f64;
                let sum = |of: fn(&GraphPoint) -> Vector3<f64>| -> Vector3<f64> {
                    around.iter().filter_map(|k| self.points.get(*k)).map(of).sum()
                };
                [sum(|p| p.before) / n, sum(|p| p.after) / n]
            })
            .collect();
        for (turn, (i, [before, after])) in free.iter().zip(middles).enumerate() {
            // the golden angle
            let angle = 2.4 * turn as f64;
            let aside = Vector3::new(angle.cos(), angle.sin(), 0.0) * reach;
            if let Some(point) = self.points.get_mut(*i) {
                (point.before, point.after) = (before + aside, after + aside);
            }
        }
    }

    pub(crate) fn points(&self) -> &[GraphPoint] {
        &self.points
    }

    pub(crate) fn lines(&self) -> &[GraphLine] {
        &self.lines
    }

    /// Returns whether all points lie in one horizontal plane.
    pub(crate) fn is_planar(&self) -> bool {
        let heights = || self.points.iter().flat_map(|p| [p.before.z, p.after.z]);
        heights().next().is_none_or(|first| heights().all(|z| z == first))
    }

    /// Returns whether names are shown.
    pub(crate) fn has_names(&self) -> bool {
        self.points.len() <= NAMED
    }

    /// Returns what is not drawn, in words.
    pub(crate) fn left_out(&self) -> Option<String> {
        let n = self.unplaced;
        (n > 0).then(|| format!("{n} variable{} without a position", if n == 1 { "" } else { "s" }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_config::{Document, Format, read_graph};
    use manifactor_solve::{Gnc, LevenbergMarquardt, Optimizer, Silent, solve};

    /// A chain of poses along x, a rotation that one of them has as well, and a wrong closure of the first and the last.
    fn scene(poses: usize, more: &str, optimizer: &dyn Optimizer) -> GraphScene {
        let mut text = String::new();
        for i in 0..poses {
            let fixed = i == 0;
            text += &format!(
                "[[variables]]\nkey = 'x{i}'\nvalue = {{ type = 'se2', translation = [{i}.1, 0.2], angle = 0.0 }}\nfixed = {fixed}\n"
            );
        }
        for i in 1..poses {
            let before = i - 1;
            text += &format!(
                "[[factors]]\nfactor = {{ type = 'between_se2', relative = {{ translation = [1.0, 0.0], angle = 0.0 }} }}\nkeys = ['x{before}', 'x{i}']\nnoise = {{ sigma = 0.1 }}\n"
            );
        }
        let document = Document::parse("graph.toml", text + more, Format::Toml).unwrap();
        let (graph, start) = read_graph(&document).unwrap();
        let solution = solve(&graph, &start, optimizer, &mut Silent).unwrap();
        GraphScene::new("graph", &graph, &start, &solution)
    }

    const TURN: &str = "[[variables]]\nkey = 'r'\nvalue = { type = 'so3', rotation = [0.0, 0.0, 0.0, 1.0] }\n\
                        [[factors]]\nfactor = { type = 'prior_so3', value = { rotation = [0.0, 0.0, 0.0, 1.0] } }\nkeys = ['r']\nnoise = { sigma = 0.1 }\n";

    #[test]
    fn a_variable_without_a_position_is_drawn_in_a_small_graph_only() {
        let small = scene(4, TURN, &LevenbergMarquardt::default());
        assert_eq!((small.points().len(), small.lines().len()), (5, 3));
        assert!(small.has_names() && small.is_planar() && small.left_out().is_none());
        assert!(small.points()[0].is_fixed && !small.points()[1].is_fixed);
        assert!((small.points()[3].after - Vector3::new(3.1, 0.2, 0.0)).norm() < 1e-9);
        let large = scene(NAMED, TURN, &LevenbergMarquardt::default());
        assert_eq!(large.points().len(), NAMED);
        assert_eq!(large.left_out().as_deref(), Some("1 variable without a position"));
    }

    #[test]
    fn a_factor_that_the_solver_rejects_is_an_outlier() {
        let wrong = "[[factors]]\nfactor = { type = 'between_se2', relative = { translation = [0.0, 3.0], angle = 0.0 } }\nkeys = ['x0', 'x5']\nnoise = { sigma = 0.1 }\n";
        let outliers = |optimizer: &dyn Optimizer| {
            let scene = scene(6, wrong, optimizer);
            scene.lines().iter().filter(|line| line.is_outlier).map(|line| line.factor).collect::<Vec<_>>()
        };
        assert_eq!(outliers(&Gnc::default()), [5]);
        assert!(outliers(&LevenbergMarquardt::default()).is_empty());
    }
}
