//! Writes graphs as g2o files.
use crate::error::FormatError;
use crate::pose_graph::record::exchange_halves;
use crate::text::write_text;
use crate::words::{count, omission_notes};
use manifactor_geometry::{BearingRange2, Between, Landmark, Point2, Point3, Position, Prior, Se2, Se3};
use manifactor_graph::{Factor, FactorEntry, Fixed, Graph, Key, Manifold, Values, Variable};
use nalgebra::DMatrix;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

/// Parts of a graph that g2o cannot express and that were omitted.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct G2oOmissions {
    /// Factors without an equivalent in g2o, by type name.
    pub factors: BTreeMap<&'static str, usize>,
    /// Variables that are neither poses nor points, by type name.
    pub variables: BTreeMap<&'static str, usize>,
    /// Robust losses; their factors are written without a loss.
    pub losses: usize,
    /// Variables with some directions held; they are written as free.
    pub partly_fixed: Vec<Key>,
    /// Variables with bounds; they are written without.
    pub bounded: Vec<Key>,
    /// New vertex numbers, if the keys are not all `x<id>` for poses and `l<id>` for points.
    pub renamed: Vec<(Key, u64)>,
}

impl G2oOmissions {
    /// Returns the omitted parts as text.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = omission_notes("g2o", &self.variables, &self.factors);
        if self.losses > 0 {
            notes.push(format!("g2o cannot express robust losses: {} left out", self.losses));
        }
        if !self.partly_fixed.is_empty() {
            let n = self.partly_fixed.len();
            notes.push(format!("g2o cannot express held directions: {n} left out"));
        }
        if !self.bounded.is_empty() {
            notes.push(format!("g2o cannot express bounds: {} left out", self.bounded.len()));
        }
        if !self.renamed.is_empty() {
            let renamed = count(self.renamed.len(), "variable");
            notes.push(format!("{renamed} renamed: g2o has numbers only"));
        }
        notes
    }
}

/// Returns the g2o text of a graph, and the parts that could not be written.
///
/// Numbers are written with all digits. Values, measurements and information read back bit for bit if the
/// noise is an information matrix, otherwise up to rounding.
pub fn format(graph: &Graph, values: &Values) -> (String, G2oOmissions) {
    let mut writer = Writer { ids: HashMap::new(), text: String::new(), omitted: G2oOmissions::default() };
    writer.number(values);
    for (key, variable) in values.iter() {
        writer.vertex(key, variable);
    }
    for (key, fixed) in graph.fixed() {
        writer.fix(key, fixed);
    }
    writer.omitted.bounded.extend(graph.bounds().keys().cloned());
    let has_sensor = |entry: &FactorEntry| {
        downcast::<Landmark<3>>(entry).is_some() || downcast::<Prior<Se3>>(entry).is_some()
    };
    if graph.factors().iter().any(has_sensor) {
        writer.text += "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n";
    }
    for entry in graph.factors() {
        if writer.edge(entry).or_else(|| writer.absolute(entry)).is_none() {
            *writer.omitted.factors.entry(entry.factor.typetag_name()).or_default() += 1;
        }
    }
    (writer.text, writer.omitted)
}

/// Writes a graph as a g2o file, and returns the parts that could not be written.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: impl AsRef<Path>, graph: &Graph, values: &Values) -> Result<G2oOmissions, FormatError> {
    let (text, omitted) = format(graph, values);
    write_text(path.as_ref(), &text).map(|()| omitted)
}

struct Writer {
    ids: HashMap<Key, u64>,
    text: String,
    omitted: G2oOmissions,
}

fn value<M: Manifold>(variable: &dyn Variable) -> Option<&M> {
    variable.erased().as_any().downcast_ref()
}

fn downcast<F: 'static>(entry: &FactorEntry) -> Option<&F> {
    Factor::erased(&*entry.factor).as_any().downcast_ref()
}

/// Returns the number in a key that this crate's reader generated.
fn own_number(key: &Key, variable: &dyn Variable) -> Option<u64> {
    let is_pose = value::<Se2>(variable).is_some() || value::<Se3>(variable).is_some();
    let number = key.as_str().strip_prefix(if is_pose { 'x' } else { 'l' })?;
    // `x+1` and `x007` would be read back with a different key.
    number.parse().ok().filter(|id: &u64| id.to_string() == number)
}

impl Writer {
    fn number(&mut self, values: &Values) {
        let own: Option<Vec<u64>> = values.iter().map(|(key, v)| own_number(key, v)).collect();
        let own = own.filter(|ids| ids.iter().collect::<HashSet<_>>().len() == ids.len());
        let ids = own.clone().unwrap_or_else(|| (0..values.len() as u64).collect());
        self.ids = values.iter().map(|(key, _)| key.clone()).zip(ids.iter().copied()).collect();
        if own.is_none() {
            self.omitted.renamed = values.iter().map(|(key, _)| key.clone()).zip(ids).collect();
        }
    }

    fn line(&mut self, tag: &str, ids: &[u64], numbers: &[f64]) {
        self.text += tag;
        let ids = ids.iter().map(u64::to_string);
        // Debug writes all digits, with exponents for very small or large numbers.
        for field in ids.chain(numbers.iter().map(|x| format!("{x:?}"))) {
            self.text.push(' ');
            self.text += &field;
        }
        self.text.push('\n');
    }

    fn vertex(&mut self, key: &Key, variable: &dyn Variable) {
        let Some(&id) = self.ids.get(key) else { return };
        if let Some(x) = value::<Se2>(variable) {
            self.line("VERTEX_SE2", &[id], &se2(x));
        } else if let Some(x) = value::<Se3>(variable) {
            self.line("VERTEX_SE3:QUAT", &[id], &se3(x));
        } else if let Some(x) = value::<Point2>(variable) {
            self.line("VERTEX_XY", &[id], x.as_slice());
        } else if let Some(x) = value::<Point3>(variable) {
            self.line("VERTEX_TRACKXYZ", &[id], x.as_slice());
        } else {
            *self.omitted.variables.entry(variable.typetag_name()).or_default() += 1;
        }
    }

    fn fix(&mut self, key: &Key, fixed: &Fixed) {
        match (self.ids.get(key), fixed) {
            (Some(&id), Fixed::Whole(true)) => self.line("FIX", &[id], &[]),
            (_, Fixed::Directions(_)) => self.omitted.partly_fixed.push(key.clone()),
            _ => {}
        }
    }

    /// Writes a binary edge; `None` if g2o has no such edge.
    fn edge(&mut self, entry: &FactorEntry) -> Option<()> {
        let [a, b] = entry.keys.as_slice() else { return None };
        let ids = [*self.ids.get(a)?, *self.ids.get(b)?];
        if let Some(f) = downcast::<Between<Se2>>(entry) {
            let information = information(entry, 3)?;
            self.line("EDGE_SE2", &ids, &[&se2(&f.relative)[..], &upper_triangle(&information)].concat());
        } else if let Some(f) = downcast::<Between<Se3>>(entry) {
            let information = exchange_halves(&information(entry, 6)?);
            self.line(
                "EDGE_SE3:QUAT",
                &ids,
                &[&se3(&f.relative)[..], &upper_triangle(&information)].concat(),
            );
        } else if let Some(f) = downcast::<Landmark<2>>(entry) {
            let numbers = [f.position.as_slice(), &upper_triangle(&information(entry, 2)?)].concat();
            self.line("EDGE_SE2_XY", &ids, &numbers);
        } else if let Some(f) = downcast::<Landmark<3>>(entry) {
            let numbers = [f.position.as_slice(), &upper_triangle(&information(entry, 3)?)].concat();
            self.line("EDGE_SE3_TRACKXYZ", &[ids[0], ids[1], 0], &numbers);
        } else if let Some(f) = downcast::<BearingRange2>(entry) {
            // A factor whose range was measured as well has no equivalent.
            let bearing = (entry.noise.observed()? == [true, false]).then(|| f.measured())?;
            let information = entry.noise.information_matrix(2).ok()?.get((0, 0)).copied()?;
            self.line("EDGE_BEARING_SE2_XY", &ids, &[bearing.y.atan2(bearing.x), information]);
        } else {
            return None;
        }
        self.omitted.losses += usize::from(entry.loss.is_some());
        Some(())
    }

    /// Writes a measurement in the world frame; `None` if g2o has no such line.
    fn absolute(&mut self, entry: &FactorEntry) -> Option<()> {
        let [key] = entry.keys.as_slice() else { return None };
        let id = *self.ids.get(key)?;
        if let Some(f) = downcast::<Prior<Se2>>(entry) {
            let numbers = [&se2(&f.value)[..], &upper_triangle(&information(entry, 3)?)].concat();
            self.line("EDGE_PRIOR_SE2", &[id], &numbers);
        } else if let Some(f) = downcast::<Prior<Se3>>(entry) {
            let information = exchange_halves(&information(entry, 6)?);
            let numbers = [&se3(&f.value)[..], &upper_triangle(&information)].concat();
            self.line("EDGE_SE3_PRIOR", &[id, 0], &numbers);
        } else if let Some(f) = downcast::<Position<2>>(entry) {
            let is_origin = f.lever_arm.iter().all(|x| *x == 0.0);
            let information = is_origin.then(|| information(entry, 2)).flatten()?;
            self.line(
                "EDGE_PRIOR_SE2_XY",
                &[id],
                &[f.position.as_slice(), &upper_triangle(&information)].concat(),
            );
        } else {
            return None;
        }
        self.omitted.losses += usize::from(entry.loss.is_some());
        Some(())
    }
}

/// Returns the information matrix; `None` if some rows are not observed, as a matrix of full rank cannot
/// express that.
fn information(entry: &FactorEntry, rows: usize) -> Option<DMatrix<f64>> {
    let all = entry.noise.observed().is_none_or(|o| o.iter().all(|o| *o));
    entry.noise.information_matrix(rows).ok().filter(|_| all)
}

fn se2(x: &Se2) -> [f64; 3] {
    [x.translation.x, x.translation.y, x.rotation.angle()]
}

fn se3(x: &Se3) -> [f64; 7] {
    let ([x, y, z], [qx, qy, qz, qw]): ([f64; 3], _) = (x.translation.into(), x.rotation.quaternion_xyzw());
    [x, y, z, qx, qy, qz, qw]
}

fn upper_triangle(m: &DMatrix<f64>) -> Vec<f64> {
    (0..m.nrows()).flat_map(|r| (r..m.ncols()).map(move |c| m[(r, c)])).collect()
}
