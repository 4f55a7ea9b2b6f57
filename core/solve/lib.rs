//! Compiled problems, sparse linear algebra and solvers.
