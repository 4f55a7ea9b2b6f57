//! Builds a graph and its values from the records of a file.
use super::anchor::anchors;
use super::information::{EdgeNoise, noise};
use super::record::{Absolute, AbsoluteMeasurement, Edge, Measurement, Record, Vertex, VertexType};
use super::{PoseGraph, PoseGraphOptions, PoseGraphReport};
use crate::error::{Mistake, ProblemList};
use crate::text::plausible;
use manifactor_geometry::{
    BearingRange2, Between, Coordinates, Landmark, LieGroup, Point3, Position, Prior, Se2, Se3, So2,
    spanning_tree,
};
use manifactor_graph::checked::Positive;
use manifactor_graph::noise::NoiseError;
use manifactor_graph::{Factor, FactorEntry, Graph, Key, Noise, ValueError, Values};
use nalgebra::{DMatrix, DVector};
use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

/// Builds the graph, and records all problems. `None` if there is a problem.
pub(crate) fn build(
    records: &[(usize, Record)],
    options: &PoseGraphOptions,
    problems: &mut ProblemList<'_>,
) -> Option<PoseGraph> {
    let mut builder = GraphBuilder::new(options);
    // Vertices first: a file may use them before their definition.
    for (line, record) in records {
        let defined = match record {
            Record::Vertex { id, value } => builder.define(*line, *id, value),
            Record::Sensor { id, pose } => builder.sensor(*line, *id, *pose),
            _ => Ok(()),
        };
        problems.ok(*line, defined);
    }
    for (line, record) in records {
        let added = match record {
            Record::Edge(edge) => builder.edge(*line, edge),
            Record::Absolute(absolute) => builder.absolute(*line, absolute),
            _ => Ok(()),
        };
        problems.ok(*line, added);
    }
    for (line, record) in records {
        let added = match record {
            Record::Fix(ids) => ids.iter().try_for_each(|id| builder.fix(*id)),
            Record::Equivalent(a, b) => builder.equivalent(*a, *b),
            _ => Ok(()),
        };
        problems.ok(*line, added);
    }
    if !problems.is_empty() {
        return None;
    }
    problems.ok(0, builder.finish().map_err(Mistake::from))
}

struct GraphBuilder<'a> {
    options: &'a PoseGraphOptions,
    graph: Graph,
    /// All edges, including omitted ones: their measurements still place vertices.
    measured: Graph,
    /// Vertices with a line.
    values: Values,
    report: PoseGraphReport,
    /// Type of each vertex, and the line that determined it.
    types: HashMap<u64, (usize, VertexType)>,
    /// Vertices without a line.
    missing: BTreeMap<u64, VertexType>,
    /// Poses of sensors on the vehicle, each with its line.
    sensors: HashMap<u64, (usize, Se3)>,
    /// Poses from absolute measurements, for vertices without a line.
    located: Values,
    /// Pairs with an edge between them, the smaller number first.
    linked: HashSet<(u64, u64)>,
}

fn key(id: u64, vertex_type: VertexType) -> Key {
    Key::indexed(if vertex_type.is_pose() { "x" } else { "l" }, id)
}

impl<'a> GraphBuilder<'a> {
    fn new(options: &'a PoseGraphOptions) -> Self {
        Self {
            options,
            graph: Graph::new(),
            measured: Graph::new(),
            values: Values::new(),
            report: PoseGraphReport::default(),
            types: HashMap::new(),
            missing: BTreeMap::new(),
            sensors: HashMap::new(),
            located: Values::new(),
            linked: HashSet::new(),
        }
    }

    fn define(&mut self, line: usize, id: u64, value: &Vertex) -> Result<(), Mistake> {
        let vertex_type = value.vertex_type();
        if let Some((first, _)) = self.types.get(&id) {
            return Err(Mistake::DuplicateVertex { id, first: *first });
        }
        self.types.insert(id, (line, vertex_type));
        let key = key(id, vertex_type);
        match *value {
            Vertex::Se2(x) => self.values.insert(key, x),
            Vertex::Se3(x) => self.values.insert(key, x),
            Vertex::Point2(x) => self.values.insert(key, x),
            Vertex::Point3(x) => self.values.insert(key, x),
        };
        self.report.vertices += 1;
        Ok(())
    }

    /// Returns the key of a vertex that this line uses with the expected type.
    fn use_as(&mut self, line: usize, id: u64, expected: VertexType) -> Result<Key, Mistake> {
        let (first, found) = *self.types.entry(id).or_insert_with(|| {
            self.missing.insert(id, expected);
            (line, expected)
        });
        if found == expected {
            return Ok(key(id, found));
        }
        Err(Mistake::VertexType { id, expected: expected.name(), found: found.name(), first })
    }

    fn sensor(&mut self, line: usize, id: u64, pose: Se3) -> Result<(), Mistake> {
        match self.sensors.entry(id) {
            Entry::Occupied(known) => Err(Mistake::DuplicateSensor { id, first: known.get().0 }),
            Entry::Vacant(new) => {
                new.insert((line, pose));
                Ok(())
            }
        }
    }

    fn sensor_pose(&self, id: u64) -> Result<Se3, Mistake> {
        let known = self.sensors.get(&id).map(|(_, pose)| *pose);
        known.ok_or(Mistake::Unknown { what: "PARAMS_SE3OFFSET", id })
    }

    fn absolute(&mut self, line: usize, absolute: &Absolute) -> Result<(), Mistake> {
        self.report.edges += 1;
        let Absolute { id, measurement, information } = absolute;
        let of_pose = match measurement {
            AbsoluteMeasurement::Se3 { .. } => VertexType::Se3,
            AbsoluteMeasurement::Se2(_) | AbsoluteMeasurement::Position2(_) => VertexType::Se2,
        };
        let key = self.use_as(line, *id, of_pose)?;
        let (factor, information): (Arc<dyn Factor>, _) = match *measurement {
            AbsoluteMeasurement::Se2(value) => {
                self.located.insert(key.clone(), value);
                (Arc::new(Prior { value }), information.clone())
            }
            AbsoluteMeasurement::Position2(position) => {
                self.located.insert(key.clone(), Se2::new(So2::identity(), position.0));
                let position = Coordinates::new(position.0)?;
                (Arc::new(Position { position, lever_arm: Coordinates::default() }), information.clone())
            }
            AbsoluteMeasurement::Se3 { pose, sensor } => {
                // Log(z⁻¹ x o) = Ad(o⁻¹) Log((z o⁻¹)⁻¹ x), with the sensor pose o on the vehicle and z in the
                // world.
                let offset = self.sensor_pose(sensor)?;
                let value = pose.compose(&offset.inverse());
                let adjoint = Se3::adjoint_of_inverse(&offset);
                let adjoint = DMatrix::from_column_slice(6, 6, adjoint.as_slice());
                let mut turned = adjoint.transpose() * information * &adjoint;
                // The product is symmetric only up to rounding.
                turned.fill_lower_triangle_with_upper_triangle();
                self.located.insert(key.clone(), value);
                (Arc::new(Prior { value }), turned)
            }
        };
        self.with_noise(
            line,
            FactorEntry { keys: vec![key], name: None, factor, noise: Noise::unit(), loss: None },
            Some(information),
            Ok,
        )
    }

    fn edge(&mut self, line: usize, edge: &Edge) -> Result<(), Mistake> {
        self.report.edges += 1;
        let Edge { from, to, .. } = *edge;
        if from == to {
            return Err(Mistake::SelfEdge { id: from });
        }
        let (measurement, information) = self.in_vehicle_frame(edge)?;
        let (a, b) = measurement.ends();
        let keys = [self.use_as(line, from, a)?, self.use_as(line, to, b)?];
        let entry = entry(keys, measurement)?;
        self.measured.push(entry.clone());
        self.linked.insert((from.min(to), from.max(to)));
        let is_bearing = matches!(measurement, Measurement::Bearing2(_));
        self.with_noise(line, entry, information, if is_bearing { of_bearing } else { Ok })
    }

    /// Adds a factor with the information of its line, or omits it.
    fn with_noise(
        &mut self,
        line: usize,
        mut entry: FactorEntry,
        information: Option<DMatrix<f64>>,
        of_factor: fn(Noise) -> Result<Noise, NoiseError>,
    ) -> Result<(), Mistake> {
        match information.map(|m| noise(&m, self.options.repair)).transpose()? {
            None => {}
            Some(EdgeNoise::AsWritten(noise)) => entry.noise = of_factor(noise)?,
            Some(EdgeNoise::Clamped(noise)) => {
                self.report.clamped.push(line);
                entry.noise = of_factor(noise)?;
            }
            Some(EdgeNoise::Rejected) => {
                self.report.rejected.push(line);
                return Ok(());
            }
        }
        self.graph.push(entry);
        Ok(())
    }

    /// Transforms a point to the vehicle frame. Its error, and so its information, rotates with the sensor.
    fn in_vehicle_frame(&self, edge: &Edge) -> Result<(Measurement, Option<DMatrix<f64>>), Mistake> {
        let Measurement::Point3 { position, sensor: Some(id) } = edge.measurement else {
            return Ok((edge.measurement, edge.information.clone()));
        };
        let sensor = self.sensor_pose(id)?;
        let position = Point3::new(sensor.act(&position));
        let r = sensor.rotation.matrix();
        let turned = |m: &DMatrix<f64>| {
            let mut m = r * m * r.transpose();
            // The product is symmetric only up to rounding.
            m.fill_lower_triangle_with_upper_triangle();
            DMatrix::from_column_slice(3, 3, m.as_slice())
        };
        let information = edge.information.as_ref().map(turned);
        Ok((Measurement::Point3 { position, sensor: None }, information))
    }

    fn fix(&mut self, id: u64) -> Result<(), Mistake> {
        let (_, vertex_type) = self.types.get(&id).ok_or(Mistake::Unknown { what: "vertex", id })?;
        self.graph.fix(key(id, *vertex_type));
        Ok(())
    }

    fn equivalent(&mut self, a: u64, b: u64) -> Result<(), Mistake> {
        if a == b {
            return Err(Mistake::SelfEdge { id: a });
        }
        let ends = |id| self.types.get(&id).copied().ok_or(Mistake::Unknown { what: "vertex", id });
        let ((_, a_type), (first, b_type)) = (ends(a)?, ends(b)?);
        let measurement = match a_type {
            VertexType::Se2 => Measurement::Se2(Se2::identity()),
            _ => Measurement::Se3(Se3::identity()),
        };
        if a_type != b_type || !a_type.is_pose() {
            let expected = measurement.ends().0.name();
            return Err(Mistake::VertexType { id: b, expected, found: b_type.name(), first });
        }
        if self.linked.contains(&(a.min(b), a.max(b))) {
            self.report.equivalences_by_edge += 1;
            return Ok(());
        }
        self.report.equivalences_added += 1;
        let mut entry = entry([key(a, a_type), key(b, b_type)], measurement)?;
        entry.noise = Noise::sigma(self.options.equivalence_sigma.get())?;
        self.measured.push(entry.clone());
        self.graph.push(entry);
        Ok(())
    }

    /// Computes initial values of the missing vertices.
    fn fill(&mut self) -> Result<(), ValueError> {
        if self.missing.is_empty() {
            return Ok(());
        }
        let mut all = spanning_tree(&self.measured, &self.values, self.options.tree)?;
        let poses = self.missing.iter().filter(|(_, t)| t.is_pose()).map(|(id, t)| (key(*id, *t), *t));
        let alone: Vec<_> = poses.filter(|(key, _)| !all.contains(key.as_str())).collect();
        if !alone.is_empty() {
            // Poses that only measure points: no relative measurement places them.
            for (key, vertex_type) in alone {
                if let Some(value) = self.located.variable(key.as_str()) {
                    all.insert_boxed(key, value.erased().clone_box());
                    continue;
                }
                match vertex_type {
                    VertexType::Se2 => all.insert(key, Se2::identity()),
                    _ => all.insert(key, Se3::identity()),
                };
            }
            all = spanning_tree(&self.measured, &all, self.options.tree)?;
        }
        for (id, vertex_type) in &self.missing {
            let key = key(*id, *vertex_type);
            if let Some(value) = all.variable(key.as_str()) {
                self.report.filled.push(key.clone());
                self.values.insert_boxed(key, value.erased().clone_box());
            }
        }
        Ok(())
    }

    fn finish(mut self) -> Result<PoseGraph, ValueError> {
        self.fill()?;
        let steps = self.graph.factors().iter().filter(|entry| are_consecutive(&entry.keys));
        let steps = steps.filter_map(|entry| entry.factor.erased().as_any().downcast_ref::<Between<Se3>>());
        self.report.doubts = plausible::relative_pose_doubts(steps.map(|step| &step.relative));
        if self.options.anchor {
            let is_pose = |key: &Key| key.as_str().starts_with('x');
            self.report.anchored = anchors(&self.graph, &self.values, is_pose);
            self.report.anchored.iter().for_each(|key| self.graph.fix(key));
        }
        Ok(PoseGraph { graph: self.graph, values: self.values, report: self.report })
    }
}

/// Returns the noise model of a bearing for a factor that also has a range; the range is masked, as it was
/// not measured.
#[allow(clippy::needless_pass_by_value, reason = "one of several functions of this type")]
fn of_bearing(noise: Noise) -> Result<Noise, NoiseError> {
    let bearing = noise.information_matrix(1)?.trace();
    let both = DMatrix::from_diagonal(&DVector::from_vec(vec![bearing, 1.0]));
    Ok(Noise::information(both)?.observing(&[true, false]))
}

/// Returns whether the keys are two poses with consecutive numbers.
fn are_consecutive(keys: &[Key]) -> bool {
    let number = |key: &Key| key.as_str().strip_prefix('x').and_then(|number| number.parse::<u64>().ok());
    match keys {
        [a, b] => number(a).zip(number(b)).is_some_and(|(a, b)| b.checked_sub(a) == Some(1)),
        _ => false,
    }
}

fn entry(keys: [Key; 2], measurement: Measurement) -> Result<FactorEntry, Mistake> {
    let factor: Arc<dyn Factor> = match measurement {
        Measurement::Se2(relative) => Arc::new(Between { relative }),
        Measurement::Se3(relative) => Arc::new(Between { relative }),
        Measurement::Point2(p) => Arc::new(Landmark { position: Coordinates::new(p.0)? }),
        Measurement::Bearing2(bearing) => Arc::new(BearingRange2::new(bearing, Positive::literal(1.0))),
        Measurement::Point3 { position: p, .. } => Arc::new(Landmark { position: Coordinates::new(p.0)? }),
    };
    Ok(FactorEntry { keys: keys.into(), name: None, factor, noise: Noise::unit(), loss: None })
}
