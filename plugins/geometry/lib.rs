//! Rotations, poses and points, and the factors between them.
