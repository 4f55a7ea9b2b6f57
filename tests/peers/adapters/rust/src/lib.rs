//! The protocol of the adapters (described in adapters/protocol.py), and pose graphs as lines.
use std::fmt::Display;
use std::fs;
use std::io::Write;
use std::time::Instant;

/// `METHOD INPUT OUTPUT MAX_ITERATIONS RELATIVE_COST`
pub struct Task {
    pub method: String,
    pub input: String,
    pub output: String,
    pub max_iterations: usize,
    pub relative_cost: f64,
}

impl Task {
    pub fn from_arguments() -> Self {
        let words: Vec<String> = std::env::args().skip(1).collect();
        let [method, input, output, iterations, relative_cost] = words.try_into().expect("five arguments");
        Self {
            method,
            input,
            output,
            max_iterations: iterations.parse().expect("MAX_ITERATIONS: a number"),
            relative_cost: relative_cost.parse().expect("RELATIVE_COST: a number"),
        }
    }
}

/// Runs the timed part.
pub fn timed<T>(solve: impl FnOnce() -> T) -> (T, f64) {
    let began = Instant::now();
    let solution = solve();
    (solution, began.elapsed().as_secs_f64())
}

/// Prints the report.
pub fn report(seconds: f64, iterations: usize, status: impl Display) {
    println!(r#"{{"seconds": {seconds}, "iterations": {iterations}, "status": "{status}"}}"#);
}

/// Poses are (x, y, angle) or (x, y, z, qx, qy, qz, qw).
pub struct PoseGraph {
    pub spatial: bool,
    pub vertices: Vec<(u64, Vec<f64>)>,
    pub edges: Vec<Edge>,
}

pub struct Edge {
    pub ends: [u64; 2],
    pub measured: Vec<f64>,
    /// Upper triangle by rows, translation first.
    pub information: Vec<f64>,
}

impl Edge {
    /// Element of the symmetric information matrix.
    pub fn information(&self, row: usize, column: usize) -> f64 {
        let n = if self.measured.len() == 3 { 3 } else { 6 };
        let (i, j) = (row.min(column), row.max(column));
        self.information[i * n - i * (i + 1) / 2 + j]
    }
}

impl PoseGraph {
    pub fn read(path: &str) -> Self {
        let mut graph = Self { spatial: false, vertices: Vec::new(), edges: Vec::new() };
        for line in fs::read_to_string(path).expect("INPUT is readable").lines() {
            let mut words = line.split_whitespace();
            let tag = words.next().unwrap_or_default();
            let numbers: Vec<f64> = words.map(|w| w.parse().expect("a number")).collect();
            let width = if tag.contains("SE3") { 7 } else { 3 };
            graph.spatial |= width == 7;
            if tag.starts_with("VERTEX") {
                graph.vertices.push((numbers[0] as u64, numbers[1..].to_vec()));
            } else if tag.starts_with("EDGE") {
                let (measured, information) = numbers[2..].split_at(width);
                graph.edges.push(Edge {
                    ends: [numbers[0] as u64, numbers[1] as u64],
                    measured: measured.to_vec(),
                    information: information.to_vec(),
                });
            }
        }
        graph
    }
}

/// Writes an estimate as vertex lines.
pub fn write(path: &str, poses: impl Iterator<Item = (u64, Vec<f64>)>) {
    let mut out = std::io::BufWriter::new(fs::File::create(path).expect("OUTPUT is writable"));
    for (id, pose) in poses {
        let tag = if pose.len() == 3 { "VERTEX_SE2" } else { "VERTEX_SE3:QUAT" };
        let numbers: Vec<String> = pose.iter().map(f64::to_string).collect();
        writeln!(out, "{tag} {id} {}", numbers.join(" ")).expect("OUTPUT is writable");
    }
}
