//! Manifactor: nonlinear least squares on factor graphs, and object-level SLAM on top of it.
